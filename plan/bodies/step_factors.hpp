#pragma once

#include "hybmss/explicit_dynamics.hpp"
#include "kernels/arguments.hpp"

#include <array>
#include <optional>

namespace hybmss {

/// What a step does to every node with the force f, by either integrator:
///
///     v <- velocity v + force (f/m) + gain,   u <- u + time_step v
///
/// Symplectic Euler and leapfrog are these kicks and drifts with other factors, so they cost the same.
struct StepFactors {
    double time_step;                   ///< s: of the drift
    double velocity;                    ///< what damping leaves of a velocity
    double force;                       ///< s
    std::array<double, 3> gain;         ///< m/s
    bool driven;                        ///< velocity or gain do something
    double kick;                        ///< s: `force` by `velocity`, of a force that acts before the sweep
    double late_force;                  ///< s: `force` for what acts behind the sweep, which may round it otherwise
    double acting;                      ///< s: how long the forces act
    std::array<double, 3> acceleration; ///< gravity in that time, m/s^2
};

/// Of a step; `before` is the leapfrog step before it, where its second half kick is still to come: it is then part of
/// this one's kick. Throws std::invalid_argument for a damping that is not allowed.
StepFactors step_factors(const StepParameters& parameters, const std::optional<StepParameters>& before = {});

/// Of a leapfrog step's second half kick alone; nothing drifts.
StepFactors half_kick(const StepParameters& parameters);

/// For a state in units of `length_unit` m. Throws std::invalid_argument for what is not finite, or no time step, in
/// the body's precision.
template <class T>
kernels::StepConstants<T> step_constants(const StepFactors& factors, double length_unit);

} // namespace hybmss
