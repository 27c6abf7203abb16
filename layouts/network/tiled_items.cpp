#include "layouts/network/tiled_items.hpp"

#include <algorithm>
#include <numeric>

namespace hybmss {

namespace {

/// Items that make a run worth its gaps: sixteen lanes of a run take as long as six springs in blocks.
constexpr std::size_t kLeastRun = 6;

} // namespace

TiledItems tile_items(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t tile_nodes,
                      std::size_t tiles) {
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
        tiled.runs[t] = find_runs({begin, end}, nodes, nodes_per_item, kLeastRun, tiled.singles[t]);
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
