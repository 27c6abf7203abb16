#pragma once

#include "hybmss/explicit_dynamics.hpp"

#include "dynamics/step.hpp"
#include "layouts/node_numbers.hpp"
#include "plan/bodies/step_factors.hpp"
#include "plan/tuning/planned_body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace hybmss {

/// Bodies that a batch steps side by side: what they are now is here, and each fetches it when it is asked for.
template <class T>
struct BodiesAbreast {
    explicit BodiesAbreast(State<T> of_all) : state(std::move(of_all)) {}

    /// `body`: one of them.
    bool finite(const Body<T>& body, std::size_t lane) {
        if (!all_finite) {
            all_finite = body.finite(state.displacement) && body.finite(state.velocity);
        }
        const auto lane_is = [&](const NodeField<T>& field) {
            for (const auto& component : field) {
                for (std::size_t n = lane; n < component.size(); n += state.bodies) {
                    if (!std::isfinite(component[n])) {
                        return false;
                    }
                }
            }
            return true;
        };
        return *all_finite || (lane_is(state.displacement) && lane_is(state.velocity));
    }

    State<T> state;
    std::optional<bool> all_finite; ///< known since the last steps
    // Of all lanes.
    std::vector<PrescribedComponent<T>> prescribed;
    std::vector<LoadedComponent<T>> loaded;
};

template <class T>
struct ExplicitDynamics<T>::Implementation {
    /// A lane that the body has in a batch.
    struct Seat {
        std::shared_ptr<BodiesAbreast<T>> row;
        std::size_t lane = 0;
        bool taken = false; ///< the state is there, not here
        long cuts = 0;      ///< when the seat was given
    };

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
    void complete_effects() {
        if (half) {
            for (const auto& effect : effects) {
                effect->complete(state, half_kick(*half));
            }
        }
    }
    void replace_loads(std::vector<LoadedComponent<T>> loads_from_now);

    /// The padding too: a motion that ended in NaN has reached it, and the next one must start clean.
    void set(VectorField<const T> in, NodeField<T>& field, double factor) {
        complete_effects();
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
    /// Counts steps taken, and looks where it is time.
    void took(const StepParameters& parameters, long count);
    /// Looks at the whole state.
    void look() const;

    /// between(element of the own state, that of the seat) for all of displacements and velocities.
    template <class Between>
    void with_seat(const Between& between) {
        const auto fields = [&](NodeField<T>& own, NodeField<T>& all) {
            for (std::size_t c = 0; c < 3; ++c) {
                T* const here = own[c].data();
                T* const there = all[c].data() + seat.lane;
                const std::size_t size = own[c].size(), bodies = seat.row->state.bodies;
                for (std::size_t n = 0; n < size; ++n) {
                    between(here[n], there[n * bodies]);
                }
            }
        };
        fields(state.displacement, seat.row->state.displacement);
        fields(state.velocity, seat.row->state.velocity);
    }
    void sit_down() {
        with_seat([](const T& here, T& there) { there = here; });
        seat.taken = true;
    }
    void come_home() {
        with_seat([](T& here, const T& there) { here = there; });
        seat.taken = false;
    }

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
    std::vector<NodalLoad> loads; ///< that `loaded` comes from
    double pushed = 0;            ///< m/s^2, that effects accelerate a node by at most; see StepEffect::set_pushed()
    long steps = 0;               ///< taken
    long settings = 0;            ///< of displacements, so far
    long holds = 0;               ///< likewise of velocities and of prescribed nodes
    long cuts = 0;                ///< likewise
    Seat seat;
    bool watched = false;           ///< a world looks at the state where it lies
    mutable long looked_at = 0;     ///< the count of steps at the last look at the state; -1: never since it was set
    mutable long not_finite_at = 0; ///< that of the first look that found it not finite, or 0
    std::optional<NodeNumbers> numbers;  ///< from the first cut on
    std::array<int, 3> grid = {0, 0, 0}; ///< likewise
};

} // namespace hybmss
