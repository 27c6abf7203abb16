#include "layouts/coloring.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace hybmss {

Coloring color_greedily(std::span<const std::int32_t> nodes, std::size_t nodes_per_item, std::size_t node_count) {
    const std::size_t items = nodes.size() / nodes_per_item;
    constexpr std::uint32_t kUncolored = ~0u;
    std::vector<std::uint32_t> color(items, kUncolored);

    // 64 colours at a time, a bit each; what finds none waits for the next round. A lattice's node has 26 springs.
    std::vector<std::uint32_t> waiting(items);
    std::iota(waiting.begin(), waiting.end(), 0u);
    for (std::uint32_t base = 0; !waiting.empty(); base += 64) {
        std::vector<std::uint64_t> used(node_count, 0);
        std::vector<std::uint32_t> next;
        for (std::uint32_t item : waiting) {
            const auto own = nodes.subspan(item * nodes_per_item, nodes_per_item);
            std::uint64_t taken = 0;
            for (std::int32_t n : own) {
                taken |= used[static_cast<std::size_t>(n)];
            }
            const int free = std::countr_one(taken);
            if (free == 64) {
                next.push_back(item);
                continue;
            }
            color[item] = base + static_cast<std::uint32_t>(free);
            for (std::int32_t n : own) {
                used[static_cast<std::size_t>(n)] |= std::uint64_t{1} << free;
            }
        }
        waiting.swap(next);
    }

    Coloring coloring;
    coloring.order.resize(items);
    std::iota(coloring.order.begin(), coloring.order.end(), 0u);
    std::stable_sort(coloring.order.begin(), coloring.order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return color[a] < color[b]; });
    coloring.begin.push_back(0);
    for (std::size_t i = 1; i < items; ++i) {
        if (color[coloring.order[i]] != color[coloring.order[i - 1]]) {
            coloring.begin.push_back(i);
        }
    }
    if (items > 0) {
        coloring.begin.push_back(items);
    }
    return coloring;
}

} // namespace hybmss
