#pragma once

#include "solvers/multigrid/cell_stiffness.hpp"

namespace hybmss {

/// matrix = P^T matrix P along one axis, for the half of a merged cell on the low or the high side: the corners of the
/// half are interpolated linearly between the corners of the whole.
///
///     low half:   fine 0 = coarse 0,  fine 1 = (coarse 0 + coarse 1) / 2
///     high half:  fine 0 = (coarse 0 + coarse 1) / 2,  fine 1 = coarse 1
void spread_half(CellMatrix& matrix, unsigned axis, bool high);

/// sum += term
void add(const CellMatrix& term, CellMatrix& sum);

} // namespace hybmss
