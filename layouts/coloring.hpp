#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// Items (springs, cells) sorted by colour; within a colour no node belongs to two items, so all of a colour may be
/// scattered at once.
struct Coloring {
    std::vector<std::uint32_t> order; ///< item numbers, colour after colour, ascending within each
    std::vector<std::size_t> begin;   ///< where each colour starts in `order`; one more entry at the end

    std::size_t colors() const { return begin.size() - 1; }
};

/// Greedy: each item, in order, takes the first colour that none of its nodes has yet. At most as many colours as the
/// number of items that an item can meet, plus one.
///
/// \param nodes `nodes_per_item` node numbers an item, all below `node_count`.
Coloring color_greedily(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t node_count);

/// Tiles (bundles of springs and cells) sorted by colour; tiles of one colour share no node, so they may run at the
/// same time, and every node gets its contributions in the order of the colours, whoever runs them. Greedy likewise.
///
/// \param tile_nodes for each tile the nodes it touches, all below `node_count`
Coloring color_tiles(std::span<const std::vector<std::int32_t>> tile_nodes, std::size_t node_count);

} // namespace hybmss
