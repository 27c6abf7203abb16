#pragma once

#include "integrations/petsc/block.hpp"
#include "integrations/petsc/block_forces.hpp"

#include "hybmss/equilibrium.hpp"

#include <array>

namespace hybmss::distributed {

/// From `displacement` to where the forces of springs, cells and gravity balance at every free component: as
/// EquilibriumSolver does, its Newton's method in a trust region, its multigrid and its coarser meshes, each rank with
/// the kernels on its own cells, what meets at nodes between ranks added up. Without turned steps and bands for slender
/// bodies and without `leave_saddles`.
///
/// Multigrid wants a Block that is cut evenly; else, and where small bodies do not pay for it, it is each node's 3x3
/// block. Supports move on straight lines and gravity grows in proportion, in one load step where that works.
/// Collective; all ranks get the same result, whose counts are of the body itself. Throws std::invalid_argument where a
/// rank has no cell.
EquilibriumResult solve_equilibrium(BlockForces& forces, const Supports& supports, const std::array<double, 3>& gravity,
                                    Vec displacement, const EquilibriumOptions& options = {});

/// The force that the supports with a high enough node number j along y exert on the body, N: the sum over ranks of
/// internal forces, with the sign changed, at nodes of the layer j. Collective; uses the present displacement.
std::array<double, 3> support_force(BlockForces& forces, PetscInt layer);

} // namespace hybmss::distributed
