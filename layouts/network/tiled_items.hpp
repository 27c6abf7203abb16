#pragma once

#include "layouts/network/item_runs.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// The items (springs, cells) of each tile: those whose lowest node is one of the tile's.
struct TiledItems {
    std::vector<std::vector<ItemRun>> runs;          ///< [tile]
    std::vector<std::vector<std::uint32_t>> singles; ///< [tile], items in no run
};

/// \param nodes of all items, `nodes_per_item` each
/// \param tile_nodes a multiple of kBlockItems: tile t owns the nodes [t tile_nodes, (t + 1) tile_nodes)
TiledItems tile_items(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t tile_nodes,
                      std::size_t tiles);

/// Adds to touched[t] the nodes that the tile's items touch, those in the gaps of runs included.
void add_touched_nodes(const TiledItems& tiled, std::span<const std::int32_t> nodes, std::size_t nodes_per_item,
                       std::vector<std::vector<std::int32_t>>& touched);

} // namespace hybmss
