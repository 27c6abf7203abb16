#pragma once

#include "plan/threads/workers.hpp"
#include "solvers/multigrid/padded_grid.hpp"

namespace hybmss {

/// The grid of cells merged two by two along every axis with more than one; the last one of an odd number stays alone,
/// as the low half of a merged cell.
PaddedGrid coarsened(const PaddedGrid& fine);

/// coarse = P^T fine: P interpolates linearly along each axis that was merged.
void restrict_to(const PaddedGrid& fine_grid, const GridVector& fine, const PaddedGrid& coarse_grid, GridVector& coarse,
                 const Workers& workers);

/// fine += P coarse
void add_prolonged(const PaddedGrid& coarse_grid, const GridVector& coarse, const PaddedGrid& fine_grid,
                   GridVector& fine, const Workers& workers);

} // namespace hybmss
