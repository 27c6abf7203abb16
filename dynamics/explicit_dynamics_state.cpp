// The state of a moving body as it is read and set: the motion, forces, energies, and what effects remember.
#include "dynamics/explicit_dynamics_implementation.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

/// A motion would carry one bad number to every node, and tell of it only much later.
template <class T>
void check_finite(const Body<T>& body, const VectorField<const T>& in, const char* what) {
    body.check(in);
    const T factor = static_cast<T>(1 / body.length_unit());
    for (const T* component : {in.x, in.y, in.z}) {
        for (std::size_t n = 0; n < in.size; ++n) {
            if (const T value = component[static_cast<std::ptrdiff_t>(n) * in.stride]; !std::isfinite(factor * value)) {
                throw std::invalid_argument(std::string(what) + " of node " + std::to_string(n) + " = " +
                                            std::to_string(static_cast<double>(value)) +
                                            " is not allowed: it must be finite" +
                                            (std::isfinite(value) ? " in units of cells too" : ""));
            }
        }
    }
}

} // namespace

template <class T>
void ExplicitDynamics<T>::get_displacements(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.read(implementation_->state.displacement, body.length_unit(), out);
}
template <class T>
void ExplicitDynamics<T>::get_velocities(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    implementation_->at_whole_step([&] { body.read(implementation_->state.velocity, body.length_unit(), out); });
}
template <class T>
void ExplicitDynamics<T>::set_displacements(VectorField<const T> in) {
    check_finite(*implementation_->body, in, "displacement");
    implementation_->complete();
    implementation_->set(in, implementation_->state.displacement, 1 / implementation_->body->length_unit());
}
template <class T>
void ExplicitDynamics<T>::set_velocities(VectorField<const T> in) {
    check_finite(*implementation_->body, in, "velocity");
    implementation_->set(in, implementation_->state.velocity, 1 / implementation_->body->length_unit());
}
template <class T>
std::vector<T> ExplicitDynamics<T>::exact_state() const {
    const Body<T>& body = *implementation_->body;
    std::vector<T> values(6 * body.node_count());
    body.read(implementation_->state.displacement, 1, VectorField<T>::aos(values.data(), body.node_count(), 6));
    body.read(implementation_->state.velocity, 1, VectorField<T>::aos(values.data() + 3, body.node_count(), 6));
    return values;
}
template <class T>
void ExplicitDynamics<T>::set_exact_state(std::span<const T> values) {
    const std::size_t nodes = implementation_->body->node_count();
    if (values.size() != 6 * nodes) {
        throw std::invalid_argument("state of " + std::to_string(values.size()) + " values given: the body's " +
                                    std::to_string(nodes) + " nodes have six each");
    }
    implementation_->set(VectorField<const T>::aos(values.data(), nodes, 6), implementation_->state.displacement, 1);
    implementation_->set(VectorField<const T>::aos(values.data() + 3, nodes, 6), implementation_->state.velocity, 1);
}
template <class T>
void ExplicitDynamics<T>::get_forces(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.compute_forces(implementation_->state);
    body.read(implementation_->state.force, 1, out);
}

template <class T>
std::span<const double> ExplicitDynamics<T>::masses() const {
    return implementation_->body->masses();
}
template <class T>
PotentialEnergy ExplicitDynamics<T>::potential_energy() const {
    return implementation_->body->energy(implementation_->state);
}
template <class T>
double ExplicitDynamics<T>::kinetic_energy() const {
    return implementation_->at_whole_step(
        [&] { return implementation_->body->kinetic_energy(implementation_->state); });
}
template <class T>
double ExplicitDynamics<T>::critical_time_step() const {
    StepBounds bounds{implementation_->body->frequencies()};
    for (const auto& effect : implementation_->effects) {
        effect->narrow(bounds);
    }
    return bounds.frequencies.critical_time_step(bounds.stiffness_damping);
}
template <class T>
void ExplicitDynamics<T>::get_effect_forces(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    State<T>& state = implementation_->state;
    NodeField<T> force;
    Body<T>::allocate_like(state.velocity, force);
    if (!implementation_->effects.empty()) {
        implementation_->at_whole_step([&] {
            for (const auto& effect : implementation_->effects) {
                effect->add_forces(body, state, force);
            }
        });
    }
    body.read(force, 1, out);
}

template <class T>
std::vector<EffectEnergy> ExplicitDynamics<T>::effect_energies() const {
    const Body<T>& body = *implementation_->body;
    State<T>& state = implementation_->state;
    std::vector<EffectEnergy> energies;
    if (!implementation_->effects.empty()) {
        implementation_->at_whole_step([&] {
            for (const auto& effect : implementation_->effects) {
                energies.push_back(
                    {std::string(effect->name()), effect->energy(body, state), effect->dissipated(body, state)});
            }
        });
    }
    return energies;
}

template <class T>
std::vector<double> ExplicitDynamics<T>::effect_memory() const {
    std::vector<double> memory;
    for (const auto& effect : implementation_->effects) {
        const std::vector<double> part = effect->memory();
        memory.insert(memory.end(), part.begin(), part.end());
    }
    if (const auto& half = implementation_->half) {
        const auto& g = half->acceleration;
        memory.insert(memory.end(), {half->time_step, half->mass_damping, g[0], g[1], g[2]});
    }
    return memory;
}

template <class T>
void ExplicitDynamics<T>::set_effect_memory(std::span<const double> memory) {
    std::size_t wanted = 0;
    for (const auto& effect : implementation_->effects) {
        wanted += effect->memory_size();
    }
    constexpr std::size_t kHalf = 5; // of a leapfrog step whose second half kick is to come
    if (memory.size() != wanted && memory.size() != wanted + kHalf) {
        throw std::invalid_argument("effect memory of " + std::to_string(memory.size()) +
                                    " numbers given: the body's effects have " + std::to_string(wanted) +
                                    ", leapfrog steps " + std::to_string(kHalf) + " more");
    }
    std::optional<StepParameters> half;
    if (memory.size() > wanted) {
        const std::span<const double> last = memory.last(kHalf);
        half = {last[0], {last[2], last[3], last[4]}, last[1], Integrator::leapfrog};
        static_cast<void>(step_constants<T>(step_factors(*half), implementation_->body->length_unit()));
    }
    for (const auto& effect : implementation_->effects) {
        effect->set_memory(memory.first(effect->memory_size()));
        memory = memory.subspan(effect->memory_size());
    }
    implementation_->half = half;
}

#define HYBMSS_INSTANTIATE(T)                                                                                          \
    template void ExplicitDynamics<T>::get_displacements(VectorField<T>) const;                                        \
    template void ExplicitDynamics<T>::get_velocities(VectorField<T>) const;                                           \
    template void ExplicitDynamics<T>::set_displacements(VectorField<const T>);                                        \
    template void ExplicitDynamics<T>::set_velocities(VectorField<const T>);                                           \
    template std::vector<T> ExplicitDynamics<T>::exact_state() const;                                                  \
    template void ExplicitDynamics<T>::set_exact_state(std::span<const T>);                                            \
    template void ExplicitDynamics<T>::get_forces(VectorField<T>) const;                                               \
    template std::span<const double> ExplicitDynamics<T>::masses() const;                                              \
    template PotentialEnergy ExplicitDynamics<T>::potential_energy() const;                                            \
    template double ExplicitDynamics<T>::kinetic_energy() const;                                                       \
    template double ExplicitDynamics<T>::critical_time_step() const;                                                   \
    template void ExplicitDynamics<T>::get_effect_forces(VectorField<T>) const;                                        \
    template std::vector<EffectEnergy> ExplicitDynamics<T>::effect_energies() const;                                   \
    template std::vector<double> ExplicitDynamics<T>::effect_memory() const;                                           \
    template void ExplicitDynamics<T>::set_effect_memory(std::span<const double>)

HYBMSS_INSTANTIATE(float);
HYBMSS_INSTANTIATE(double);

} // namespace hybmss
