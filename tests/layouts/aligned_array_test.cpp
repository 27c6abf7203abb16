// Where arrays lie in memory, whatever the allocator.

#include "layouts/aligned_array.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace hybmss {
namespace {

/// Whole pages, as an engine's allocator might give them; remembers what is out.
struct Pages {
    std::map<void*, std::size_t> taken;
    static void* take(std::size_t bytes, std::size_t, void* user) {
        void* memory = std::aligned_alloc(4096, (bytes + 4095) / 4096 * 4096);
        static_cast<Pages*>(user)->taken[memory] = bytes;
        return memory;
    }
    static void give(void* memory, std::size_t bytes, std::size_t, void* user) {
        auto& taken = static_cast<Pages*>(user)->taken;
        EXPECT_TRUE(taken.count(memory)) << "memory that was never taken";
        EXPECT_EQ(taken[memory], bytes);
        taken.erase(memory);
        std::free(memory);
    }
};

std::size_t line_in_page(const AlignedArray<float>& array) {
    return reinterpret_cast<std::uintptr_t>(array.data()) % 4096 / 64;
}

class ArraysInPages : public ::testing::Test {
protected:
    ArraysInPages() { set_allocator({&Pages::take, &Pages::give, &pages}); }
    ~ArraysInPages() override { set_allocator({}); }
    std::vector<AlignedArray<float>> arrays(std::size_t count, std::size_t size) {
        std::vector<AlignedArray<float>> all;
        for (std::size_t i = 0; i < count; ++i) {
            all.emplace_back(size);
        }
        return all;
    }
    Pages pages;
};

TEST_F(ArraysInPages, BeginAtDifferentPlaces) {
    std::set<std::size_t> lines;
    for (const AlignedArray<float>& array : arrays(64, 10000)) {
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.data()) % kArrayAlignment, 0u);
        lines.insert(line_in_page(array));
    }
    EXPECT_EQ(lines.size(), 64u);
    // Neighbours are not next to each other.
    const auto few = arrays(12, 10000);
    for (std::size_t i = 0; i < few.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const auto apart = (line_in_page(few[i]) + 64 - line_in_page(few[j])) % 64;
            EXPECT_TRUE(apart >= 4 && apart <= 60) << i << " " << j;
        }
    }
}

TEST_F(ArraysInPages, TakeAQuarterMoreAtMost) {
    for (const std::size_t size : {1u, 63u, 64u, 500u, 3000u, 5000u, 100000u}) {
        const AlignedArray<float> array(size);
        EXPECT_LE(array.bytes(), size * sizeof(float) + std::min<std::size_t>(size * sizeof(float) / 4, 4096));
        EXPECT_LE(reinterpret_cast<const char*>(array.data() + size),
                  static_cast<const char*>(pages.taken.begin()->first) + array.bytes());
        EXPECT_GE(reinterpret_cast<const char*>(array.data()), pages.taken.begin()->first);
    }
}

TEST_F(ArraysInPages, GoBackWhereTheyCameFrom) {
    {
        AlignedArray<float> kept(5000);
        const float* place = kept.data();
        AlignedArray<float> moved = std::move(kept);
        EXPECT_EQ(moved.data(), place);
        set_allocator({}); // what comes later is another's
        moved = AlignedArray<float>(7000);
        EXPECT_TRUE(pages.taken.empty());
        EXPECT_EQ(AlignedArray<float>(0).data(), nullptr);
    }
    EXPECT_TRUE(pages.taken.empty());
}

} // namespace
} // namespace hybmss
