#pragma once

#include "layouts/aligned_array.hpp"

#include <cstdint>
#include <cstring>
#include <unordered_map>
#include <vector>

namespace hybmss {

/// Rows of numbers, each kept once, whoever uses it: the dictionary of a layout. Row is plain numbers without gaps, in
/// whole words of eight bytes.
template <class Row>
class DistinctRows {
public:
    /// The number of the row with these very bits, new or old.
    std::uint32_t number_of(const Row& row) {
        const auto number = static_cast<std::uint32_t>(rows_.size());
        const auto [begin, end] = known_.equal_range(hash(row));
        for (auto it = begin; it != end; ++it) {
            if (std::memcmp(&rows_[it->second], &row, sizeof row) == 0) {
                return it->second;
            }
        }
        known_.emplace(hash(row), number);
        rows_.push_back(row);
        return number;
    }

    AlignedArray<Row> array() const {
        AlignedArray<Row> all(rows_.size());
        std::copy(rows_.begin(), rows_.end(), all.data());
        return all;
    }

private:
    static std::uint64_t hash(const Row& row) {
        static_assert(sizeof(Row) % 8 == 0);
        std::uint64_t words[sizeof(Row) / 8];
        std::memcpy(words, &row, sizeof row);
        std::uint64_t h = 14695981039346656037ull; // FNV-1a, by words
        for (const std::uint64_t word : words) {
            h = (h ^ word) * 1099511628211ull;
            h ^= h >> 32;
        }
        return h;
    }

    std::vector<Row> rows_;
    std::unordered_multimap<std::uint64_t, std::uint32_t> known_;
};

} // namespace hybmss
