#include "dynamics/explicit_dynamics_implementation.hpp"

#include "plan/bodies/critical_time_step.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

[[noreturn]] void refuse(const char* what, std::size_t node, double value) {
    throw std::invalid_argument(std::string(what) + " of node " + std::to_string(node) + " = " + std::to_string(value) +
                                " is not allowed: it must be finite");
}

/// A motion would carry one bad number to every node, and tell of it only much later.
template <class T>
void check_finite(const VectorField<const T>& in, const char* what) {
    for (const T* component : {in.x, in.y, in.z}) {
        for (std::size_t n = 0; n < in.size; ++n) {
            if (const T value = component[static_cast<std::ptrdiff_t>(n) * in.stride]; !std::isfinite(value)) {
                refuse(what, n, static_cast<double>(value));
            }
        }
    }
}

double longest_spring(const Network& network) {
    double longest = 0;
    for (const Network::Spring& spring : network.springs) {
        const auto& r = spring.rest_vector;
        longest = std::max(longest, std::hypot(r[0], r[1], r[2]));
    }
    return longest;
}

} // namespace

template <class T>
ExplicitDynamics<T>::ExplicitDynamics(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(plan_body<T>(lattice, material, options, Operation::step),
                                                       lattice.cell_size())) {}
template <class T>
ExplicitDynamics<T>::ExplicitDynamics(const Network& network, const PlanOptions& options)
    : implementation_(
          std::make_unique<Implementation>(plan_body<T>(network, options, Operation::step), longest_spring(network))) {}
template <class T>
ExplicitDynamics<T>::ExplicitDynamics(ExplicitDynamics&&) noexcept = default;
template <class T>
ExplicitDynamics<T>& ExplicitDynamics<T>::operator=(ExplicitDynamics&&) noexcept = default;
template <class T>
ExplicitDynamics<T>::~ExplicitDynamics() = default;

template <class T>
std::size_t ExplicitDynamics<T>::node_count() const {
    return implementation_->body->node_count();
}

template <class T>
void ExplicitDynamics<T>::prescribe(std::span<const PrescribedNode> nodes) {
    const Body<T>& body = *implementation_->body;
    const double scale = 1 / body.length_unit();
    std::vector<PrescribedComponent<T>> components;
    for (const PrescribedNode& p : nodes) {
        if (p.node >= body.node_count()) {
            throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": the body has " +
                                        std::to_string(body.node_count()) + " nodes");
        }
        if (p.axes > 7) {
            throw std::invalid_argument("prescribed node " + std::to_string(p.node) + ": axes = " +
                                        std::to_string(p.axes) + " is not allowed: it must be a sum of 1, 2 and 4");
        }
        const std::size_t index = body.index_of(p.node);
        for (std::size_t c = 0; c < 3; ++c) {
            if (p.axes >> c & 1) {
                if (!std::isfinite(p.displacement[c])) {
                    refuse("prescribed displacement", p.node, p.displacement[c]);
                }
                if (!std::isfinite(p.velocity[c])) {
                    refuse("prescribed velocity", p.node, p.velocity[c]);
                }
                components.push_back({index, static_cast<int>(c), static_cast<T>(p.displacement[c] * scale),
                                      static_cast<T>(p.velocity[c] * scale)});
            }
        }
    }
    implementation_->prescribed = std::move(components);
    for (const auto& effect : implementation_->effects) {
        effect->set_prescribed(implementation_->prescribed);
    }
    hybmss::set_prescribed<T>(implementation_->state, implementation_->prescribed);
}

template <class T>
void ExplicitDynamics<T>::load(std::span<const NodalLoad> loads) {
    const Body<T>& body = *implementation_->body;
    std::map<std::uint32_t, std::array<double, 3>> forces;
    for (const NodalLoad& load : loads) {
        if (load.node >= body.node_count()) {
            throw std::invalid_argument("loaded node " + std::to_string(load.node) + ": the body has " +
                                        std::to_string(body.node_count()) + " nodes");
        }
        for (std::size_t c = 0; c < 3; ++c) {
            if (!std::isfinite(load.force[c])) {
                throw std::invalid_argument("load on node " + std::to_string(load.node) + ": the force along " +
                                            "xyz"[c] + " is not finite");
            }
            forces[load.node][c] += load.force[c];
        }
    }
    std::vector<LoadedComponent<T>> components;
    for (const auto& [node, force] : forces) {
        for (std::size_t c = 0; c < 3; ++c) {
            if (force[c] != 0 && body.masses()[node] > 0) { // not where all cells have been cut away
                const double acceleration = force[c] / (body.masses()[node] * body.length_unit());
                components.push_back({body.index_of(node), static_cast<int>(c), static_cast<T>(acceleration)});
            }
        }
    }
    implementation_->loaded = std::move(components);
    for (const auto& effect : implementation_->effects) {
        effect->set_loaded(implementation_->loaded);
    }
    implementation_->loads.clear();
    for (const auto& [node, force] : forces) {
        if (force != std::array<double, 3>{0, 0, 0}) {
            implementation_->loads.push_back({node, force});
        }
    }
}

template <class T>
void ExplicitDynamics<T>::step(const StepParameters& parameters, long count) {
    if (count < 0) {
        throw std::invalid_argument("count = " + std::to_string(count) +
                                    " is not allowed: it must be at least 0 steps");
    }
    take_steps<T>(*implementation_->body, implementation_->state, parameters,
                  {implementation_->effects, implementation_->prescribed, implementation_->loaded}, count);
}

template <class T>
void ExplicitDynamics<T>::get_displacements(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.read(implementation_->state.displacement, body.length_unit(), out);
}
template <class T>
void ExplicitDynamics<T>::get_velocities(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    body.read(implementation_->state.velocity, body.length_unit(), out);
}
template <class T>
void ExplicitDynamics<T>::set_displacements(VectorField<const T> in) {
    check_finite(in, "displacement");
    implementation_->set(in, implementation_->state.displacement, 1 / implementation_->body->length_unit());
}
template <class T>
void ExplicitDynamics<T>::set_velocities(VectorField<const T> in) {
    check_finite(in, "velocity");
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
    return implementation_->body->kinetic_energy(implementation_->state);
}
template <class T>
double ExplicitDynamics<T>::critical_time_step() const {
    const Implementation& all = *implementation_;
    const FrequencyBounds bounds =
        all.contact ? all.body->frequencies().with(all.contact->obstacles()) : all.body->frequencies();
    return bounds.critical_time_step(all.damping ? all.damping->seconds() : 0);
}
template <class T>
PlanDescription ExplicitDynamics<T>::describe() const {
    PlanDescription description = implementation_->planned.describe();
    description.bytes += implementation_->state.bytes();
    description.bytes += implementation_->prescribed.size() * sizeof(PrescribedComponent<T>);
    description.bytes += implementation_->loaded.size() * sizeof(LoadedComponent<T>);
    for (const auto& effect : implementation_->effects) {
        description.bytes += effect->bytes();
    }
    return description;
}

template class ExplicitDynamics<float>;
template class ExplicitDynamics<double>;

} // namespace hybmss
