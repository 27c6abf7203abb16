#pragma once

#include "hybmss/explicit_dynamics.hpp"

#include "dynamics/contact/contact.hpp"
#include "dynamics/effects/spring_damping.hpp"
#include "dynamics/step.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/tuning/planned_body.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace hybmss {

template <class T>
struct ExplicitDynamics<T>::Implementation {
    Implementation(PlannedBody<T> made, double longest_edge)
        : planned(std::move(made)), body(planned.body.get()), state(body->make_state(true)),
          wave_speed(longest_edge / body->critical_time_step()) {}

    /// The padding too: a motion that ended in NaN has reached it, and the next one must start clean.
    void set(VectorField<const T> in, NodeField<T>& field, double factor) {
        for (auto& component : field) {
            std::fill_n(component.data(), component.size(), T(0));
        }
        for (auto& buffer : state.buffers) {
            std::fill_n(buffer.data(), buffer.size(), T(0));
        }
        body->write(in, factor, field);
        for (const auto& effect : effects) {
            effect->state_was_set();
        }
    }

    /// Throws where these cells of this lattice cannot be removed; else makes ready for it.
    void check_cut(const Lattice& lattice, std::span<const std::uint32_t> cells);

    PlannedBody<T> planned;
    const Body<T>* body;
    mutable State<T> state; ///< forces are scratch: computed on demand by calls that leave the motion as it is
    double wave_speed;      ///< m/s, at most: no wave passes an edge in less than the critical time step
    std::vector<std::unique_ptr<StepEffect<T>>> effects;
    Contact<T>* contact = nullptr;       ///< one of the effects; nullptr without obstacles
    std::optional<SurfaceNode> touching; ///< one of those that may touch, if there are any
    SpringDamping<T>* damping = nullptr; ///< one of them, or none
    std::vector<PrescribedComponent<T>> prescribed;
    std::vector<LoadedComponent<T>> loaded;
    std::vector<NodalLoad> loads;        ///< that `loaded` comes from
    std::optional<NodeNumbers> numbers;  ///< from the first cut on
    std::array<int, 3> grid = {0, 0, 0}; ///< likewise
};

} // namespace hybmss
