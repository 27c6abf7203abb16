#pragma once

/// \file
/// The dynamics of either kind and precision, seen in double.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "simulation/run/implicit_dynamics.hpp"
#include "simulation/run/motion.hpp"

#include <span>
#include <variant>
#include <vector>

namespace hybmss {

using AnyDynamics =
    std::variant<ExplicitDynamics<float>, ExplicitDynamics<double>, ImplicitDynamics<float>, ImplicitDynamics<double>>;

/// Explicit for symplectic Euler, else implicit.
AnyDynamics make_dynamics(const Lattice& lattice, const Material& material, SolverMethod method,
                          const SimulationOptions& options);

/// One vector a node: displacements (m), velocities (m/s), forces (N) of the body itself and of effects.
std::vector<Vector3> displacements_of(const AnyDynamics& dynamics);
std::vector<Vector3> velocities_of(const AnyDynamics& dynamics);
std::vector<Vector3> forces_of(const AnyDynamics& dynamics);

std::vector<EffectEnergy> effect_energies_of(const AnyDynamics& dynamics);
std::vector<double> effect_memory_of(const AnyDynamics& dynamics);
void set_effect_memory(AnyDynamics& dynamics, std::span<const double> memory);

void set_state(AnyDynamics& dynamics, std::span<const Vector3> displacements, std::span<const Vector3> velocities);

} // namespace hybmss
