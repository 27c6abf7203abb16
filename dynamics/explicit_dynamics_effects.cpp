// What acts on a body beyond its own forces: obstacles, and damping along the springs.
#include "dynamics/explicit_dynamics_implementation.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace hybmss {

template <class T>
void ExplicitDynamics<T>::set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles) {
    Implementation& all = *implementation_;
    auto made =
        obstacles.empty() ? nullptr : std::make_unique<Contact<T>>(*all.body, all.wave_speed, surface, obstacles);
    std::erase_if(all.effects, [&](const auto& effect) { return effect.get() == all.contact; });
    all.contact = made.get();
    all.touching.reset();
    if (made) {
        if (!surface.empty()) {
            all.touching = surface.front();
        }
        made->set_prescribed(all.prescribed);
        made->set_loaded(all.loaded);
        all.effects.push_back(std::move(made));
    }
}

template <class T>
void ExplicitDynamics<T>::damp_springs(double stiffness_damping) {
    if (!(stiffness_damping >= 0) || !std::isfinite(stiffness_damping)) {
        throw std::invalid_argument("stiffness_damping = " + std::to_string(stiffness_damping) +
                                    " is not allowed: it must be finite and at least 0 s");
    }
    Implementation& i = *implementation_;
    std::erase_if(i.effects, [&](const auto& effect) { return effect.get() == i.damping; });
    i.damping = nullptr;
    if (stiffness_damping > 0) {
        auto damping = std::make_unique<SpringDamping<T>>(stiffness_damping);
        damping->set_prescribed(i.prescribed);
        i.damping = damping.get();
        i.effects.push_back(std::move(damping));
    }
}

template <class T>
void ExplicitDynamics<T>::move_obstacles(std::span<const RigidPose> poses) {
    if (!implementation_->contact) {
        if (!poses.empty()) {
            throw std::invalid_argument(std::to_string(poses.size()) + " poses given: the body has no obstacles");
        }
        return;
    }
    implementation_->contact->move(poses);
}

template <class T>
std::vector<ObstacleReading> ExplicitDynamics<T>::obstacle_readings() const {
    const Implementation& all = *implementation_;
    return all.contact ? all.contact->readings(*all.body, all.state) : std::vector<ObstacleReading>();
}

template <class T>
void ExplicitDynamics<T>::get_effect_forces(VectorField<T> out) const {
    const Body<T>& body = *implementation_->body;
    State<T>& state = implementation_->state;
    NodeField<T> force;
    Body<T>::allocate_like(state.velocity, force);
    for (const auto& effect : implementation_->effects) {
        effect->add_forces(body, state, force);
    }
    body.read(force, 1, out);
}

template <class T>
std::vector<EffectEnergy> ExplicitDynamics<T>::effect_energies() const {
    const Body<T>& body = *implementation_->body;
    State<T>& state = implementation_->state;
    std::vector<EffectEnergy> energies;
    for (const auto& effect : implementation_->effects) {
        energies.push_back({std::string(effect->name()), effect->energy(body, state), effect->dissipated(body, state)});
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
    return memory;
}

template <class T>
void ExplicitDynamics<T>::set_effect_memory(std::span<const double> memory) {
    std::size_t wanted = 0;
    for (const auto& effect : implementation_->effects) {
        wanted += effect->memory_size();
    }
    if (memory.size() != wanted) {
        throw std::invalid_argument("effect memory of " + std::to_string(memory.size()) +
                                    " numbers given: the body's effects have " + std::to_string(wanted));
    }
    for (const auto& effect : implementation_->effects) {
        effect->set_memory(memory.first(effect->memory_size()));
        memory = memory.subspan(effect->memory_size());
    }
}

template void ExplicitDynamics<float>::set_obstacles(std::span<const SurfaceNode>, std::span<const Obstacle>);
template void ExplicitDynamics<float>::damp_springs(double);
template void ExplicitDynamics<float>::move_obstacles(std::span<const RigidPose>);
template std::vector<ObstacleReading> ExplicitDynamics<float>::obstacle_readings() const;
template void ExplicitDynamics<float>::get_effect_forces(VectorField<float>) const;
template std::vector<EffectEnergy> ExplicitDynamics<float>::effect_energies() const;
template std::vector<double> ExplicitDynamics<float>::effect_memory() const;
template void ExplicitDynamics<float>::set_effect_memory(std::span<const double>);
template void ExplicitDynamics<double>::set_obstacles(std::span<const SurfaceNode>, std::span<const Obstacle>);
template void ExplicitDynamics<double>::damp_springs(double);
template void ExplicitDynamics<double>::move_obstacles(std::span<const RigidPose>);
template std::vector<ObstacleReading> ExplicitDynamics<double>::obstacle_readings() const;
template void ExplicitDynamics<double>::get_effect_forces(VectorField<double>) const;
template std::vector<EffectEnergy> ExplicitDynamics<double>::effect_energies() const;
template std::vector<double> ExplicitDynamics<double>::effect_memory() const;
template void ExplicitDynamics<double>::set_effect_memory(std::span<const double>);

} // namespace hybmss
