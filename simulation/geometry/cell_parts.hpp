#pragma once

/// \file
/// Whether a body is in one piece.

#include "hybmss/lattice.hpp"

#include <cstddef>
#include <vector>

namespace hybmss {

/// The numbers of cells of the body's parts, largest first. Cells are of one part where a path through shared faces
/// leads from one to the other; cells that share only an edge or a corner hang together as by a hinge, so they count
/// as apart. Time in proportion to the grid's cells, memory to the runs of filled cells along x.
std::vector<std::size_t> cell_parts(const Lattice& lattice);

} // namespace hybmss
