#include "layouts/network/conflict_free_blocks.hpp"

#include <bit>

namespace hybmss {

ConflictFreeBlocks::ConflictFreeBlocks(std::size_t node_count, std::size_t nodes_per_item, std::size_t block_items)
    : nodes_per_item_(nodes_per_item), block_items_(block_items), used_(node_count, 0) {}

void ConflictFreeBlocks::close(std::size_t slot, std::span<const std::int32_t> nodes,
                               std::vector<std::uint32_t>& blocks) {
    std::vector<std::uint32_t>& block = open_[slot];
    for (std::uint32_t item : block) {
        for (std::int32_t n : nodes.subspan(item * nodes_per_item_, nodes_per_item_)) {
            used_[static_cast<std::size_t>(n)] &= ~(std::uint64_t{1} << slot);
        }
    }
    blocks.insert(blocks.end(), block.begin(), block.end());
    blocks.insert(blocks.end(), block_items_ - block.size(), kNoItem);
    block.clear();
}

void ConflictFreeBlocks::append(std::span<const std::uint32_t> items, std::span<const std::int32_t> nodes,
                                std::vector<std::uint32_t>& blocks) {
    std::size_t oldest = 0; // what to close where all 64 have one of the nodes: around a hub of many springs
    for (std::uint32_t item : items) {
        const auto own = nodes.subspan(item * nodes_per_item_, nodes_per_item_);
        std::uint64_t taken = 0;
        for (std::int32_t n : own) {
            taken |= used_[static_cast<std::size_t>(n)];
        }
        auto slot = static_cast<std::size_t>(std::countr_one(taken));
        if (slot == kOpen) {
            slot = oldest;
            oldest = (oldest + 1) % kOpen;
            close(slot, nodes, blocks);
        }
        open_[slot].push_back(item);
        for (std::int32_t n : own) {
            used_[static_cast<std::size_t>(n)] |= std::uint64_t{1} << slot;
        }
        if (open_[slot].size() == block_items_) {
            close(slot, nodes, blocks);
        }
    }
    for (std::size_t slot = 0; slot < kOpen; ++slot) {
        if (!open_[slot].empty()) {
            close(slot, nodes, blocks);
        }
    }
}

} // namespace hybmss
