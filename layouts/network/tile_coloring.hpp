#pragma once

#include "layouts/coloring.hpp"

namespace hybmss {

/// Tiles (bundles of springs and cells) sorted by colour; tiles of one colour share no node, so they may run at the
/// same time, and every node gets its contributions in the order of the colours, whoever runs them. Greedy, as
/// color_greedily.
///
/// \param tile_nodes for each tile the nodes it touches, all below `node_count`
Coloring color_tiles(std::span<const std::vector<std::int32_t>> tile_nodes, std::size_t node_count);

} // namespace hybmss
