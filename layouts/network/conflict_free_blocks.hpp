#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

} // namespace hybmss
