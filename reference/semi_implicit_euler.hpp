#pragma once

/// \file
/// The explicit time steps: semi-implicit (symplectic) Euler, and leapfrog.

#include "hybmss/explicit_dynamics.hpp"
#include "reference/body.hpp"

#include <span>
#include <vector>

namespace hybmss::reference {

/// Displacements (m) and velocities (m/s), one a node.
struct State {
    std::vector<Vector3d> u;
    std::vector<Vector3d> v;
};

/// At rest: u = v = 0.
State rest_state(const Body& body);

/// Sets the named axes of the named nodes to their given displacement and velocity.
void prescribe(std::span<const PrescribedNode> nodes, State& state);

/// One step of all nodes, then the prescribed ones are set.
void semi_implicit_euler_step(const Body& body, const StepParameters& parameters,
                              std::span<const PrescribedNode> prescribed, State& state);

/// The same by leapfrog: half a kick, a drift, half a kick, and all velocities at the time of the displacements.
void leapfrog_step(const Body& body, const StepParameters& parameters, std::span<const PrescribedNode> prescribed,
                   State& state);

/// 1/2 sum m v.v, J.
double kinetic_energy(const Body& body, const State& state);

} // namespace hybmss::reference
