#pragma once

/// \file
/// A lattice between plates, solved to equilibrium, and the proof that what came out is one.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include "hybmss/equilibrium.hpp"

#include <string_view>

namespace hybmss::stability {

enum class PlateMotion { compression, tension, shear, torsion };
inline constexpr std::array kPlateMotions = {PlateMotion::compression, PlateMotion::tension, PlateMotion::shear,
                                             PlateMotion::torsion};
std::string_view name(PlateMotion motion);

/// The low end of y held, the high end moved as a plate: along y by the strain times the height, or along x by as much,
/// or turned about y so that the shear at the middle of a side is the strain.
Loading plates(const Lattice& lattice, PlateMotion motion, double strain);
/// Only the low end of y held.
Loading held_below(const Lattice& lattice);

/// What the scalar reference says of a state that should be an equilibrium.
struct EquilibriumCheck {
    double residual = 0;        ///< largest force on a free component over the largest on a held one
    int falling_directions = 0; ///< negative eigenvalues of the Hessian over the free components
};
EquilibriumCheck check_equilibrium(const Lattice& lattice, const Material& material, const Loading& loading,
                                   const Vectors& u);

VectorField<double> view(Vectors& vectors);

/// The least eigenvalue of the Hessian over the free components, over that at rest: falls to zero where an equilibrium
/// is lost.
double least_curvature(const Lattice& lattice, const Material& material, const Loading& loading, const Vectors& u);

/// The smallest volume ratio of the lattice's cells.
double least_volume_ratio(const Lattice& lattice, const Vectors& u);

/// A body between plates, solved; the state it ends in, and what the reference says of it.
struct StaticSolve {
    Vectors displacements;
    EquilibriumResult result;
    EquilibriumCheck check; ///< where it converged
    bool converged() const { return result.status == EquilibriumStatus::converged; }
};
/// From the given state. Ends as WRONG where a solve says to be converged and the reference's residual is above 1e-7,
/// or where it is not and there is no message.
StaticSolve solve(const Lattice& lattice, const Material& material, const Loading& loading, Vectors start,
                  const EquilibriumOptions& options = {});

/// The outcome of an error: its message, and the figures of the last state.
Outcome unsolved(const StaticSolve& solve, const Lattice& lattice);
/// The outcome of an answer.
Outcome solved(const StaticSolve& solve, std::string how);

} // namespace hybmss::stability
