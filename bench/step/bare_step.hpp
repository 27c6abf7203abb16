#pragma once

/// \file
/// The explicit step without a place for effects, loads or prescribed nodes: what a step with them is measured by.

#include "hybmss/explicit_dynamics.hpp"

#include <functional>

namespace hybmss::bench {

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
