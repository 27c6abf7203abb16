#include "dynamics/step.hpp"

#include <algorithm>

namespace hybmss {

template <class T>
void set_prescribed(State<T>& state, std::span<const PrescribedComponent<T>> prescribed) {
    for (const PrescribedComponent<T>& p : prescribed) {
        const auto axis = static_cast<std::size_t>(p.axis);
        const Component<T> u = component(state.displacement, axis), v = component(state.velocity, axis);
        u.first[static_cast<std::ptrdiff_t>(p.index) * u.stride] = p.displacement;
        v.first[static_cast<std::ptrdiff_t>(p.index) * v.stride] = p.velocity;
    }
}

namespace {

/// Pieces of a list of components, in parallel: visit(part of the list).
template <class Component, class Visit>
Stage stage_over(std::span<const Component> all, const Visit& visit) {
    constexpr std::size_t kPiece = 512;
    return {(all.size() + kPiece - 1) / kPiece, [=](std::size_t piece, std::size_t) {
                const std::size_t begin = piece * kPiece;
                visit(all.subspan(begin, std::min(kPiece, all.size() - begin)));
            }};
}

template <class T>
Stage load_stage(State<T>& state, const StepFactors& factors, std::span<const LoadedComponent<T>> loaded) {
    const T time_step = static_cast<T>(factors.time_step), factor = static_cast<T>(factors.late_force);
    return stage_over(loaded, [&state, time_step, factor](std::span<const LoadedComponent<T>> part) {
        for (const LoadedComponent<T>& p : part) {
            const auto axis = static_cast<std::size_t>(p.axis);
            const Component<T> u = component(state.displacement, axis), v = component(state.velocity, axis);
            const T gain = factor * p.acceleration;
            v.first[static_cast<std::ptrdiff_t>(p.index) * v.stride] += gain;
            u.first[static_cast<std::ptrdiff_t>(p.index) * u.stride] += time_step * gain;
        }
    });
}

} // namespace

template <class T>
void take_steps(const Body<T>& body, State<T>& state, const StepFactors& factors, const StepActions<T>& actions,
                long count) {
    std::vector<Stage> stages;
    for (const auto& effect : actions.effects) {
        effect->add_stages(body, state, factors, stages);
    }
    append(body.step_stages(state, factors), stages);
    // A load adds its part to the integrated motion, which is linear in the force.
    if (!actions.loaded.empty()) {
        stages.push_back(load_stage(state, factors, actions.loaded));
    }
    std::vector<Stage> last;
    for (const auto& effect : actions.effects) {
        effect->add_last_stages(body, state, factors, last);
    }
    const auto hold = [&] {
        if (!actions.prescribed.empty()) {
            stages.push_back(stage_over(actions.prescribed, [&state](std::span<const PrescribedComponent<T>> part) {
                set_prescribed(state, part);
            }));
        }
    };
    if (!actions.lead || !last.empty()) {
        hold();
        append(std::move(last), stages);
    }
    if (actions.lead) {
        stages.push_back({1, [lead = actions.lead](std::size_t, std::size_t) { lead(); }});
        hold();
    }
    body.workers().run(stages, count);
}

template <class T>
void take_steps(const Body<T>& body, State<T>& state, const StepParameters& parameters,
                const std::optional<StepParameters>& before, const StepActions<T>& actions, long count) {
    // The first leapfrog step of a kind begins with another kick than those that follow.
    const bool leapfrog = parameters.integrator == Integrator::leapfrog;
    const bool first_differs = leapfrog && count > 0 && before != parameters;
    take_steps(body, state, step_factors(parameters, before), actions, first_differs ? 1 : count);
    if (first_differs && count > 1) {
        take_steps(body, state, step_factors(parameters, parameters), actions, count - 1);
    }
}

template void set_prescribed(State<float>&, std::span<const PrescribedComponent<float>>);
template void set_prescribed(State<double>&, std::span<const PrescribedComponent<double>>);
template void take_steps(const Body<float>&, State<float>&, const StepFactors&, const StepActions<float>&, long);
template void take_steps(const Body<double>&, State<double>&, const StepFactors&, const StepActions<double>&, long);
template void take_steps(const Body<float>&, State<float>&, const StepParameters&, const std::optional<StepParameters>&,
                         const StepActions<float>&, long);
template void take_steps(const Body<double>&, State<double>&, const StepParameters&,
                         const std::optional<StepParameters>&, const StepActions<double>&, long);

} // namespace hybmss
