#include "layouts/coloring.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace hybmss {
namespace {

/// nodes_of(item): the nodes of items below `items`.
template <class NodesOf>
Coloring color(std::size_t items, const NodesOf& nodes_of, std::size_t node_count) {
    std::vector<std::uint32_t> color_of(items);
    // 64 colours at a time, a bit each; what finds none waits for the next round. A lattice's node has 26 springs;
    // tiles need more only where all of them meet, as with springs across the whole body.
    std::vector<std::uint32_t> waiting(items);
    std::iota(waiting.begin(), waiting.end(), 0u);
    for (std::uint32_t base = 0; !waiting.empty(); base += 64) {
        std::vector<std::uint64_t> used(node_count, 0);
        std::vector<std::uint32_t> next;
        for (const std::uint32_t item : waiting) {
            std::uint64_t taken = 0;
            for (const std::int32_t n : nodes_of(item)) {
                taken |= used[static_cast<std::size_t>(n)];
            }
            const int free = std::countr_one(taken);
            if (free == 64) {
                next.push_back(item);
                continue;
            }
            color_of[item] = base + static_cast<std::uint32_t>(free);
            for (const std::int32_t n : nodes_of(item)) {
                used[static_cast<std::size_t>(n)] |= std::uint64_t{1} << free;
            }
        }
        waiting.swap(next);
    }

    Coloring coloring;
    coloring.order.resize(items);
    std::iota(coloring.order.begin(), coloring.order.end(), 0u);
    std::stable_sort(coloring.order.begin(), coloring.order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return color_of[a] < color_of[b]; });
    coloring.begin.push_back(0);
    for (std::size_t i = 1; i <= items; ++i) {
        if (i == items || color_of[coloring.order[i]] != color_of[coloring.order[i - 1]]) {
            coloring.begin.push_back(i);
        }
    }
    return coloring;
}

} // namespace

Coloring color_greedily(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t node_count) {
    return color(
        nodes.size() / nodes_per_item,
        [&](std::uint32_t item) { return nodes.subspan(item * nodes_per_item, nodes_per_item); }, node_count);
}

Coloring color_tiles(std::span<const std::vector<std::int32_t>> tile_nodes, std::size_t node_count) {
    return color(
        tile_nodes.size(), [&](std::uint32_t tile) -> const std::vector<std::int32_t>& { return tile_nodes[tile]; },
        node_count);
}

} // namespace hybmss
