#pragma once

#include "layouts/network/conflict_free_blocks.hpp"
#include "layouts/network/network_blocks.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

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

} // namespace hybmss
