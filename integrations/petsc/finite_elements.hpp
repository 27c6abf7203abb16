#pragma once

/// \file
/// A general peer of solve_equilibrium(): the same box of finite elements, written as PETSc's own example of elasticity
/// at large strain is (SNES tutorial ex16), solved by PETSc alone.

#include "integrations/petsc/petsc.hpp"

#include "hybmss/material.hpp"

#include <array>
#include <string>

namespace hybmss::distributed {

struct FiniteElementSolution {
    bool converged = false;
    std::string reason; ///< PETSc's word for how the solve ended
    int newton_iterations = 0, krylov_iterations = 0;
    double residual = 0;    ///< as EquilibriumResult::residual
    double plate_force = 0; ///< N: of the upper plate on the box
};

/// A box of `cells` trilinear hexahedra of the edge `cell_size` (m), 2x2x2 points of integration each, of the
/// neo-Hookean law
///
///     W = mu/2 (tr F^T F - 3 - 2 ln J) + lambda/2 (ln J)^2,
///
/// pressed together along y by the part `compression` of its height between plates that hold all components, from the
/// state in which all of it is compressed alike. DMDA; SNES with its line search and Eisenstat and Walker's tolerances;
/// GMRES, as the tutorial has it, with GAMG (smoothed aggregation, the rigid motions as near-kernel, interpolations
/// kept from one Newton iteration to the next). PETSc's own options are read. Ends where the largest unbalanced force
/// is below `tolerance` of the largest support force. Collective.
FiniteElementSolution press_finite_elements(MPI_Comm communicator, const std::array<PetscInt, 3>& cells,
                                            double cell_size, const Material& material, double compression,
                                            double tolerance);

} // namespace hybmss::distributed
