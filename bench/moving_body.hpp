#pragma once

/// \file
/// A body that trembles, for timing its steps; and its step without a place for effects, loads or prescribed nodes,
/// which a step with them is measured by.

#include "bench/bench_row.hpp"
#include "bench/interleaved.hpp"
#include "bench/yardstick.hpp"
#include "hybmss/explicit_dynamics.hpp"

#include <functional>
#include <vector>

namespace hybmss::bench {

/// The largest component of a random displacement, in cell edges: strains are near it.
inline constexpr double kDisturbance = 0.01;

/// Displacements (m) of `nodes` nodes, x y z each: random, at a strain near kDisturbance.
template <class T>
std::vector<T> random_displacements(std::size_t nodes, double cell_size);

/// Gives a body random displacements, so that it trembles.
template <class T>
void disturb(ExplicitDynamics<T>& dynamics, double cell_size);

/// The row's body, trembling.
template <class T>
ExplicitDynamics<T> row_dynamics(const BenchRow& row);

/// Half the critical step and a hundred thousandth of damping a step. The body keeps trembling for the whole row (1e5
/// steps take the energy to about 1/e), so nothing blows up, and nothing decays into denormal numbers: displacements
/// stay near 1e-3 m, their squares far above 1e-38.
template <class T>
StepParameters gentle_steps(const ExplicitDynamics<T>& dynamics);

/// Whether every displacement is finite.
template <class T>
bool all_finite(const ExplicitDynamics<T>& dynamics);
bool all_finite(const Yardstick& body);

/// The same body, with the same displacements, as the yardstick; and its steps, for as long as it lives.
Yardstick moving_yardstick(const Lattice& lattice, const Material& material);
Work steps_of(Yardstick& body, const StepParameters& parameters);

/// A body at rest displaced as given (m, x y z a node); steps() takes so many steps of its sweep alone.
template <class T>
struct BareStep {
    std::function<void(const StepParameters&, long)> steps;
    std::size_t bytes; ///< of plan and state
};

template <class T>
BareStep<T> bare_step(const Lattice& lattice, const Material& material, const PlanOptions& options,
                      const std::vector<T>& displacements);

} // namespace hybmss::bench
