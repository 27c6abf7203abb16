#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"

#include <limits>

namespace hybmss {

/// Whether multigrid is likely to take less time than block Jacobi for a solve of the lattice.
///
/// A rule in Hessian products, from `hybmss-study bench solvers`: with n cells along the longest edge, more for a
/// slender body, and r = 1 + kappa/G, block Jacobi takes about 9.2 n r^0.44 of them for a static solve, multigrid about
/// 300 for its matrices and 130 r^0.48 for its cycles, by as much more as the bounding box has more cells than the
/// body. `reach` bounds n: an implicit step of dt lets no node feel farther than about dt over the critical step, in
/// cells.
bool multigrid_pays(const Lattice& lattice, const Material& material,
                    double reach = std::numeric_limits<double>::infinity());

} // namespace hybmss
