#pragma once

#include <array>

namespace hybmss::distributed {

/// How many boxes of nodes a grid is cut into along each axis.
using ProcessGrid = std::array<long, 3>;

/// The cut into `ranks` boxes by which a rank has the fewest ghosts. Where several have as few, x is cut the least,
/// then y: the kernels run along x. Throws std::invalid_argument where no cut gives every rank a node.
ProcessGrid choose_process_grid(const std::array<long, 3>& nodes, long ranks);

/// The most ghosts that a rank has where `nodes` are cut so, one layer thick: those of a box of ceil(nodes/processes)
/// nodes along each axis that stands between others.
double most_ghosts(const std::array<long, 3>& nodes, const ProcessGrid& processes);

} // namespace hybmss::distributed
