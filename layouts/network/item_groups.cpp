#include "layouts/network/item_groups.hpp"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

namespace hybmss {

// ---- blocks

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

// ---- runs

namespace {

/// The runs of one row of sixteen low nodes, apart where their last nodes overlap: first the first of every cluster of
/// near ones, then the second of every cluster ...
void spread(std::span<ItemRun> runs, std::size_t last) {
    std::vector<std::pair<std::size_t, std::size_t>> place; // position in its cluster, number
    std::size_t position = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const bool near = i > 0 && runs[i].node[last] - runs[i - 1].node[last] < kBlockItems;
        position = near ? position + 1 : 0;
        place.emplace_back(position, i);
    }
    std::sort(place.begin(), place.end());
    std::vector<ItemRun> sorted;
    sorted.reserve(runs.size());
    for (const auto& [unused, i] : place) {
        sorted.push_back(runs[i]);
    }
    std::copy(sorted.begin(), sorted.end(), runs.begin());
}

/// The nodes of items.
struct ItemNodes {
    std::span<const std::int32_t> nodes;
    std::size_t per_item;

    std::span<const std::int32_t> of(std::uint32_t item) const { return nodes.subspan(item * per_item, per_item); }
    std::int32_t lowest(std::uint32_t item) const {
        const auto own = of(item);
        return *std::min_element(own.begin(), own.end());
    }
    std::int32_t lane(std::uint32_t item) const { return lowest(item) % kBlockItems; }
    /// Node c of lane 0 in a run that the item belongs to: items are of one run where all of these are the same.
    std::int32_t first(std::uint32_t item, std::size_t c) const { return of(item)[c] - lane(item); }
    /// An order by the first nodes, the last corner's before the others'.
    bool before(std::uint32_t a, std::uint32_t b) const {
        for (std::size_t c = per_item; c-- > 0;) {
            if (first(a, c) != first(b, c)) {
                return first(a, c) < first(b, c);
            }
        }
        return false;
    }
};

/// One run of items that all could be in it, and those that find their lane taken: a second one between the same nodes.
ItemRun make_run(const ItemNodes& nodes, std::span<const std::uint32_t> items, std::vector<std::uint32_t>& left) {
    ItemRun run{};
    run.item.fill(kNoItem);
    for (std::size_t c = 0; c < nodes.per_item; ++c) {
        run.node[c] = nodes.first(items[0], c);
    }
    for (const std::uint32_t item : items) {
        std::uint32_t& place = run.item[static_cast<std::size_t>(nodes.lane(item))];
        if (place == kNoItem) {
            place = item;
        } else {
            left.push_back(item);
        }
    }
    return run;
}

} // namespace

std::vector<ItemRun> find_runs(std::span<const std::uint32_t> items, std::span<const std::int32_t> nodes,
                               std::size_t nodes_per_item, std::size_t least, std::vector<std::uint32_t>& rest) {
    const ItemNodes all{nodes, nodes_per_item};
    std::vector<ItemRun> runs;
    std::vector<std::uint32_t> row, left;
    for (std::size_t begin = 0, end = 0; begin < items.size(); begin = end) {
        const std::int32_t which = all.lowest(items[begin]) / kBlockItems;
        while (end < items.size() && all.lowest(items[end]) / kBlockItems == which) {
            ++end;
        }
        const auto from_row = items.subspan(begin, end - begin);
        row.assign(from_row.begin(), from_row.end());
        const auto before = [&](std::uint32_t a, std::uint32_t b) { return all.before(a, b); };
        std::stable_sort(row.begin(), row.end(), before);
        const std::size_t first_run = runs.size();
        for (auto i = row.begin(), next = i; i != row.end(); i = next) {
            next = std::upper_bound(i, row.end(), *i, before);
            left.clear();
            const ItemRun run = make_run(all, {&*i, static_cast<std::size_t>(next - i)}, left);
            if (static_cast<std::size_t>(next - i) - left.size() >= least) {
                runs.push_back(run);
                rest.insert(rest.end(), left.begin(), left.end());
            } else {
                rest.insert(rest.end(), i, next);
            }
        }
        spread(std::span(runs).subspan(first_run), nodes_per_item - 1);
    }
    return runs;
}

// ---- tiles

TiledItems tile_items(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t tile_nodes,
                      std::size_t tiles, std::size_t least) {
    const std::size_t count = nodes.size() / nodes_per_item;
    std::vector<std::uint64_t> key(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto own = nodes.subspan(i * nodes_per_item, nodes_per_item);
        const auto [low, high] = std::minmax_element(own.begin(), own.end());
        key[i] = static_cast<std::uint64_t>(*low) << 32 | static_cast<std::uint64_t>(*high);
    }
    std::vector<std::uint32_t> items(count);
    std::iota(items.begin(), items.end(), 0u);
    std::stable_sort(items.begin(), items.end(), [&](std::uint32_t a, std::uint32_t b) { return key[a] < key[b]; });
    TiledItems tiled{std::vector<std::vector<ItemRun>>(tiles), std::vector<std::vector<std::uint32_t>>(tiles)};
    auto begin = items.begin();
    for (std::size_t t = 0; t < tiles; ++t) {
        const auto end = std::partition_point(begin, items.end(),
                                              [&](std::uint32_t i) { return (key[i] >> 32) < (t + 1) * tile_nodes; });
        const auto own = std::span<const std::uint32_t>(items).subspan(static_cast<std::size_t>(begin - items.begin()),
                                                                       static_cast<std::size_t>(end - begin));
        tiled.runs[t] = find_runs(own, nodes, nodes_per_item, least, tiled.singles[t]);
        begin = end;
    }
    return tiled;
}

void add_touched_nodes(const TiledItems& tiled, std::span<const std::int32_t> nodes, std::size_t nodes_per_item,
                       std::vector<std::vector<std::int32_t>>& touched) {
    for (std::size_t t = 0; t < tiled.runs.size(); ++t) {
        std::vector<std::int32_t>& all = touched[t];
        for (const std::uint32_t item : tiled.singles[t]) {
            const auto own = nodes.subspan(item * nodes_per_item, nodes_per_item);
            all.insert(all.end(), own.begin(), own.end());
        }
        for (const ItemRun& run : tiled.runs[t]) {
            for (std::size_t c = 0; c < nodes_per_item; ++c) {
                for (std::int32_t lane = 0; lane < kBlockItems; ++lane) {
                    all.push_back(run.node[c] + lane);
                }
            }
        }
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
    }
}

} // namespace hybmss
