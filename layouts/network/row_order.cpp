#include "layouts/network/row_order.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace hybmss {

std::vector<std::uint32_t> row_order(std::span<const std::array<double, 3>> points, double spacing) {
    std::vector<std::uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    if (points.empty()) {
        return order;
    }
    std::array<double, 3> low = points[0], high = points[0];
    for (const auto& x : points) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], x[c]);
            high[c] = std::max(high[c], x[c]);
        }
    }
    std::array<std::size_t, 3> axes = {0, 1, 2}; // fastest first
    const auto counts = [&](std::size_t c) { return std::round((high[c] - low[c]) / spacing); };
    std::stable_sort(axes.begin(), axes.end(), [&](std::size_t a, std::size_t b) { return counts(a) < counts(b); });
    struct Key {
        double plane, row, along;
        bool operator<(const Key& other) const {
            return std::tie(plane, row, along) < std::tie(other.plane, other.row, other.along);
        }
    };
    std::vector<Key> key;
    key.reserve(points.size());
    for (const auto& x : points) {
        const auto count = [&](std::size_t c) { return std::round((x[c] - low[c]) / spacing); };
        key.push_back({count(axes[2]), count(axes[1]), x[axes[0]]});
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key[a] < key[b]; });
    return order;
}

} // namespace hybmss
