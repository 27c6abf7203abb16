#pragma once

#include "integrations/petsc/block.hpp"
#include "integrations/petsc/block_forces.hpp"

#include <array>
#include <string>

namespace hybmss::distributed {

struct DistributedEquilibrium {
    bool converged = false;
    std::string reason; ///< PETSc's word for how the solve ended
    int newton_iterations = 0, linear_iterations = 0;
    double residual = 0; ///< N: norm of the unbalanced forces
};

/// From `displacement` to where the forces of springs, cells and gravity balance at every free component: PETSc's SNES
/// by Newton's method, its KSP by conjugate gradients on Hessian products, preconditioned with each node's 3x3 block.
/// PETSc's own options (-snes_..., -ksp_...) are read. Supports are set at once; where that is too far, come in steps.
DistributedEquilibrium solve_equilibrium(BlockForces& forces, const Supports& supports,
                                         const std::array<double, 3>& gravity, Vec displacement);

/// The force that the supports with a high enough node number j along y exert on the body, N: the sum over ranks of
/// internal forces, with the sign changed, at nodes of the layer j. Collective; uses the present displacement.
std::array<double, 3> support_force(BlockForces& forces, PetscInt layer);

} // namespace hybmss::distributed
