#pragma once

/// \file
/// The dynamics of either kind and precision, seen in double.

#include "hybmss/equilibrium.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "simulation/scene/scene_body.hpp"

#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace hybmss {

/// The implicit twin of ExplicitDynamics: a body that moves by backward Euler steps, or goes to equilibrium.
///
/// Nodes are numbered as in the body. Not for concurrent use. The body starts at rest: u = v = 0.
template <class T>
class ImplicitDynamics {
public:
    using Scalar = T;

    ImplicitDynamics(const Lattice& lattice, const Material& material, const PlanOptions& options);
    ImplicitDynamics(const Network& network, const PlanOptions& options);

    std::size_t node_count() const { return solver_.node_count(); }

    /// One backward Euler step to the state that the loading holds. Where it does not converge, the state stays.
    EquilibriumResult step(const Loading& loading, double time_step, double mass_damping,
                           const EquilibriumOptions& options);
    /// Follows a path of loadings from the fraction 0 to equilibrium at 1; the velocity becomes zero.
    EquilibriumResult follow(const std::function<Loading(double fraction)>& path, const EquilibriumOptions& options);

    /// Vibrations about the present displacements.
    ModesResult modes(std::span<const PrescribedNode> supports, const ModesOptions& options) {
        return solver_.modes(supports, view(std::as_const(displacement_)), options);
    }
    BucklingResult buckling(const Loading& loading, const ModesOptions& options) {
        return solver_.buckling(loading, options);
    }

    void get_displacements(VectorField<T> out) const { copy(view(displacement_), out); }
    void get_velocities(VectorField<T> out) const { copy(view(velocity_), out); }
    void set_displacements(VectorField<const T> in) { copy(in, view(displacement_)); }
    void set_velocities(VectorField<const T> in) { copy(in, view(velocity_)); }
    /// What later steps depend on with every bit: six values a node, m and m/s, and the solver's memory.
    std::vector<T> exact_state() const;
    void set_exact_state(std::span<const T> values);
    /// Sets (not adds) the internal forces, N, at the present displacements.
    void get_forces(VectorField<T> out) const { solver_.get_forces(view(displacement_), out); }
    void press(std::span<const SurfaceFace> faces, std::span<const double> pressures) {
        solver_.press(faces, pressures);
    }
    void actuate(std::span<const std::uint32_t> cells) { solver_.actuate(cells); }
    void set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles) {
        solver_.set_obstacles(surface, obstacles);
    }
    std::vector<ObstacleReading> obstacle_readings() const { return solver_.obstacle_readings(view(displacement_)); }
    void damp_springs(double stiffness_damping) { solver_.damp_springs(stiffness_damping); }
    void get_effect_forces(VectorField<T> out) const {
        solver_.get_effect_forces(view(displacement_), view(velocity_), out);
    }
    std::vector<EffectEnergy> effect_energies() const { return solver_.effect_energies(); }
    std::vector<double> effect_memory() const { return solver_.effect_memory(); }
    void set_effect_memory(std::span<const double> memory) { solver_.set_effect_memory(memory); }
    std::span<const double> masses() const { return solver_.masses(); }

    PotentialEnergy potential_energy() const {
        Field force(displacement_.size());
        return solver_.get_forces(view(displacement_), view(force));
    }
    double kinetic_energy() const;
    PlanDescription describe() const { return solver_.describe(); }
    double estimate_seconds() const { return solver_.estimate_seconds(); }

private:
    using Field = std::vector<T>; ///< x y z a node
    static void copy(VectorField<const T> from, VectorField<T> to);
    VectorField<T> view(Field& field) const { return VectorField<T>::aos(field.data(), node_count()); }
    VectorField<const T> view(const Field& field) const {
        return VectorField<const T>::aos(field.data(), node_count());
    }

    mutable EquilibriumSolver<T> solver_; ///< has scratch of its own
    Field displacement_, velocity_;
};

extern template class ImplicitDynamics<float>;
extern template class ImplicitDynamics<double>;

using AnyDynamics =
    std::variant<ExplicitDynamics<float>, ExplicitDynamics<double>, ImplicitDynamics<float>, ImplicitDynamics<double>>;

/// Explicit or implicit, as the method asks for.
AnyDynamics make_dynamics(const Lattice& lattice, const Material& material, SolverMethod method,
                          const SimulationOptions& options);
AnyDynamics make_dynamics(const Network& network, SolverMethod method, const SimulationOptions& options);

/// One vector a node: displacements (m), velocities (m/s), forces (N) of the body itself and of effects.
std::vector<Vector3> displacements_of(const AnyDynamics& dynamics);
std::vector<Vector3> velocities_of(const AnyDynamics& dynamics);
std::vector<Vector3> forces_of(const AnyDynamics& dynamics);

/// N, one vector a node: what obstacles exert; zero where there is no contact.
std::vector<Vector3> contact_forces_of(const AnyDynamics& dynamics);

std::vector<EffectEnergy> effect_energies_of(const AnyDynamics& dynamics);
std::vector<double> effect_memory_of(const AnyDynamics& dynamics);
void set_effect_memory(AnyDynamics& dynamics, std::span<const double> memory);

void set_state(AnyDynamics& dynamics, std::span<const Vector3> displacements, std::span<const Vector3> velocities);

} // namespace hybmss
