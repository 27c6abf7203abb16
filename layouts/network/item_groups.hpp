#pragma once

#include "layouts/network/network_blocks.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

// How the items of a network (springs, cells) are put together for vectors: in blocks, in runs, in tiles of both.

namespace hybmss {

/// A place in a block that no item took.
inline constexpr std::uint32_t kNoItem = ~0u;

/// Puts items (springs, cells) into blocks of `block_items` in which no node occurs twice, so that a vector of items
/// can be added to its nodes without one waiting for the other.
///
/// Items are taken in the order given, each into the first open block that its nodes leave free; at most 64 blocks are
/// open at a time, so an item ends up near its neighbours in the order. Where the order is one in space, blocks touch
/// few cache lines.
class ConflictFreeBlocks {
public:
    /// For nodes below `node_count`, of which an item has `nodes_per_item`.
    ConflictFreeBlocks(std::size_t node_count, std::size_t nodes_per_item, std::size_t block_items);

    /// Appends to `blocks` the numbers of the items, `block_items` a block, gaps (kNoItem) at the end of a block.
    /// \param nodes of all items, `nodes_per_item` each, indexed by item number
    void append(std::span<const std::uint32_t> items, std::span<const std::int32_t> nodes,
                std::vector<std::uint32_t>& blocks);

private:
    static constexpr std::size_t kOpen = 64;
    void close(std::size_t slot, std::span<const std::int32_t> nodes, std::vector<std::uint32_t>& blocks);

    std::size_t nodes_per_item_, block_items_;
    std::vector<std::uint64_t> used_; ///< for each node: in which open blocks it occurs
    std::vector<std::uint32_t> open_[kOpen];
};

/// Items (springs, cells) whose nodes lie in rows: node c of the item in lane i is node[c] + i.
///
///     node:   32  33  34  35 ... 47        a run of springs whose low nodes are 32 ... 47 and whose high nodes
///              \   \       \      \        are 49 ... 64; none begins at node 34
///     node:    49  50  51  52 ... 64
struct ItemRun {
    std::array<std::int32_t, 8> node;            ///< the first `nodes_per_item` count
    std::array<std::uint32_t, kBlockItems> item; ///< kNoItem where a lane has none
};

/// Finds runs of at least `least` items. The lowest node of lane 0 is a multiple of sixteen, so that the runs from the
/// same sixteen nodes follow each other and these nodes are loaded once for all.
///
/// \param items in ascending order of their lowest nodes
/// \param nodes of all items, `nodes_per_item` each, indexed by item number
/// \param rest gets the items that are in no run, those from the same sixteen low nodes together
/// \return in ascending order of the lowest node of lane 0. Those from the same sixteen nodes are ordered such that the
///     ones whose other nodes overlap are apart: what one of them writes is not read at once by the next.
std::vector<ItemRun> find_runs(std::span<const std::uint32_t> items, std::span<const std::int32_t> nodes,
                               std::size_t nodes_per_item, std::size_t least, std::vector<std::uint32_t>& rest);

/// Items that make a run worth its gaps: sixteen lanes of a run take as long as six springs in blocks. No run has
/// kNoRun.
inline constexpr std::size_t kLeastRun = 6, kNoRun = 2 * kBlockItems;

/// The items (springs, cells) of each tile: those whose lowest node is one of the tile's.
struct TiledItems {
    std::vector<std::vector<ItemRun>> runs;          ///< [tile]
    std::vector<std::vector<std::uint32_t>> singles; ///< [tile], items in no run
};

/// \param least items that make a run
/// \param nodes of all items, `nodes_per_item` each
/// \param tile_nodes a multiple of kBlockItems: tile t owns the nodes [t tile_nodes, (t + 1) tile_nodes)
TiledItems tile_items(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t tile_nodes,
                      std::size_t tiles, std::size_t least = kLeastRun);

/// Adds to touched[t] the nodes that the tile's items touch, those in the gaps of runs included.
void add_touched_nodes(const TiledItems& tiled, std::span<const std::int32_t> nodes, std::size_t nodes_per_item,
                       std::vector<std::vector<std::int32_t>>& touched);

} // namespace hybmss
