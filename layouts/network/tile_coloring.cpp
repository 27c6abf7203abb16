#include "layouts/network/tile_coloring.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace hybmss {

Coloring color_tiles(std::span<const std::vector<std::int32_t>> tile_nodes, std::size_t node_count) {
    std::vector<std::uint32_t> color(tile_nodes.size());
    std::vector<std::uint32_t> waiting(tile_nodes.size());
    std::iota(waiting.begin(), waiting.end(), 0u);
    // 64 colours at a time; more are needed only where all tiles meet, as with springs across the whole body.
    for (std::uint32_t base = 0; !waiting.empty(); base += 64) {
        std::vector<std::uint64_t> used(node_count, 0);
        std::vector<std::uint32_t> next;
        for (std::uint32_t tile : waiting) {
            std::uint64_t taken = 0;
            for (std::int32_t n : tile_nodes[tile]) {
                taken |= used[static_cast<std::size_t>(n)];
            }
            const int free = std::countr_one(taken);
            if (free == 64) {
                next.push_back(tile);
                continue;
            }
            color[tile] = base + static_cast<std::uint32_t>(free);
            for (std::int32_t n : tile_nodes[tile]) {
                used[static_cast<std::size_t>(n)] |= std::uint64_t{1} << free;
            }
        }
        waiting.swap(next);
    }

    Coloring coloring;
    coloring.order.resize(tile_nodes.size());
    std::iota(coloring.order.begin(), coloring.order.end(), 0u);
    std::stable_sort(coloring.order.begin(), coloring.order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return color[a] < color[b]; });
    coloring.begin.push_back(0);
    for (std::size_t i = 1; i <= coloring.order.size(); ++i) {
        if (i == coloring.order.size() || color[coloring.order[i]] != color[coloring.order[i - 1]]) {
            coloring.begin.push_back(i);
        }
    }
    return coloring;
}

} // namespace hybmss
