#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace hybmss {

RestShape rest_shape(const Network& network, const Network::Cell& cell) {
    RestShape shape{};
    auto& e = shape.edges;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const auto& x = network.rest_positions[static_cast<std::size_t>(cell.nodes[corner])];
        for (std::size_t edge = 0; edge < 3; ++edge) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                e[3 * edge + axis] += (corner >> edge & 1 ? 0.25 : -0.25) * x[axis];
            }
        }
    }
    shape.volume =
        e[0] * (e[4] * e[8] - e[5] * e[7]) + e[1] * (e[5] * e[6] - e[3] * e[8]) + e[2] * (e[3] * e[7] - e[4] * e[6]);
    return shape;
}

double rest_length2(const Network::Spring& spring) {
    const auto& r = spring.rest_vector;
    return r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
}

MeanCell mean_cell(const Network& network, const Network::Cell& cell) {
    const double h = rest_shape(network, cell).edges[0], k = cell.scale * network.means.springs.cube_diagonal;
    return {k * h, 1 / h, cell.kappa * h / (32 * k)};
}

std::vector<const Network::Cell*> cells_of(const Network& network, bool on_means) {
    std::vector<const Network::Cell*> cells;
    for (const Network::Cell& cell : network.cells) {
        if ((cell.scale > 0) == on_means) {
            cells.push_back(&cell);
        }
    }
    return cells;
}

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
