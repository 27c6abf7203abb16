#pragma once

#include "hybmss/explicit_dynamics.hpp"

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

    /// With leapfrog the state has the velocities of half a step before the displacements. visit() sees it with those
    /// at the same time, which takes an evaluation of the forces.
    template <class Visit>
    auto at_whole_step(const Visit& visit) const {
        if (!half) {
            return visit();
        }
        find_whole_velocity();
        struct Exchange {
            const Implementation& body;
            explicit Exchange(const Implementation& exchanged) : body(exchanged) {
                std::swap(body.state.velocity, body.whole_velocity);
            }
            ~Exchange() { std::swap(body.state.velocity, body.whole_velocity); }
        } exchange(*this);
        return visit();
    }
    void find_whole_velocity() const;
    /// Takes the kick that the velocities lack: what it comes from is about to change.
    void complete();
    void replace_loads(std::vector<LoadedComponent<T>> loads_from_now);

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
        half.reset();
        looked_at = -1;
        not_finite_at = 0;
        ++(&field == &state.displacement ? settings : holds);
    }

    /// The effect of this kind, or null.
    template <class Effect>
    Effect* find() const {
        for (const auto& effect : effects) {
            if (auto* const found = dynamic_cast<Effect*>(effect.get())) {
                return found;
            }
        }
        return nullptr;
    }
    /// Puts an effect in the place of the one of its kind; null takes that away.
    template <class Effect>
    void replace(std::unique_ptr<Effect> effect) {
        complete();
        std::erase_if(effects, [before = find<Effect>()](const auto& other) { return other.get() == before; });
        if (effect) {
            effect->set_prescribed(prescribed);
            effect->set_loaded(loaded);
            effect->set_pushed(pushed);
            effects.push_back(std::move(effect));
        }
    }

    void push(double acceleration) {
        pushed = acceleration;
        for (const auto& effect : effects) {
            effect->set_pushed(pushed);
        }
    }

    /// Takes over where these nodes, the prescribed ones, are led. Throws as prescribe() does, and for other nodes.
    void lead(std::span<const PrescribedNode> nodes);
    /// Looks at the whole state.
    void look() const;

    /// Throws where these cells of this lattice cannot be removed; else makes ready for it.
    void check_cut(const Lattice& lattice, std::span<const std::uint32_t> cells);

    PlannedBody<T> planned;
    const Body<T>* body;
    mutable State<T> state; ///< forces are scratch: computed on demand by calls that leave the motion as it is
    std::optional<StepParameters> half;  ///< the leapfrog step whose second half kick the velocities lack, if any
    mutable NodeField<T> whole_velocity; ///< scratch
    double wave_speed;                   ///< m/s, at most: no wave passes an edge in less than the critical time step
    std::vector<std::unique_ptr<StepEffect<T>>> effects;
    std::vector<PrescribedComponent<T>> prescribed; ///< each once
    std::vector<LoadedComponent<T>> loaded;
    std::vector<NodalLoad> loads;   ///< that `loaded` comes from
    double pushed = 0;              ///< m/s^2, that effects accelerate a node by at most; see StepEffect::set_pushed()
    long steps = 0;                 ///< taken
    long settings = 0;              ///< of displacements, so far
    long holds = 0;                 ///< likewise of velocities and of prescribed nodes
    long cuts = 0;                  ///< likewise
    mutable long looked_at = 0;     ///< the count of steps at the last look at the state; -1: never since it was set
    mutable long not_finite_at = 0; ///< that of the first look that found it not finite, or 0
    std::optional<NodeNumbers> numbers;  ///< from the first cut on
    std::array<int, 3> grid = {0, 0, 0}; ///< likewise
};

} // namespace hybmss
