#pragma once

#include "dynamics/effects/step_effect.hpp"

#include <memory>
#include <span>
#include <vector>

namespace hybmss {

/// What a step does besides the body's own forces, gravity and damping. Not owned.
template <class T>
struct StepActions {
    std::span<const std::unique_ptr<StepEffect<T>>> effects;
    std::span<const PrescribedComponent<T>> prescribed;
    std::span<const LoadedComponent<T>> loaded; ///< each component once
};

/// One step after the other: the kicks of the effects, the step proper, the loads, the prescribed components.
template <class T>
void take_steps(const Body<T>& body, State<T>& state, const StepParameters& parameters, const StepActions<T>& actions,
                long count);

template <class T>
void set_prescribed(State<T>& state, std::span<const PrescribedComponent<T>> prescribed);

} // namespace hybmss
