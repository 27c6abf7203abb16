#pragma once

#include "hybmss/equilibrium.hpp"

#include <span>
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

    std::size_t node_count() const { return solver_.node_count(); }

    /// One backward Euler step to the state that the loading holds. Where it does not converge, the state stays.
    EquilibriumResult step(const Loading& loading, double time_step, double mass_damping,
                           const EquilibriumOptions& options);
    /// Follows a path of loadings from the fraction 0 to equilibrium at 1; the velocity becomes zero.
    EquilibriumResult follow(const std::function<Loading(double fraction)>& path, const EquilibriumOptions& options);

    void get_displacements(VectorField<T> out) const;
    void get_velocities(VectorField<T> out) const;
    void set_displacements(VectorField<const T> in);
    void set_velocities(VectorField<const T> in);
    /// What later steps depend on with every bit: six values a node, m and m/s, and the solver's memory.
    std::vector<T> exact_state() const;
    void set_exact_state(std::span<const T> values);
    /// Sets (not adds) the internal forces, N, at the present displacements.
    void get_forces(VectorField<T> out) const;
    void damp_springs(double stiffness_damping) { solver_.damp_springs(stiffness_damping); }
    void get_effect_forces(VectorField<T> out) const {
        solver_.get_effect_forces(view(displacement_), view(velocity_), out);
    }
    std::vector<EffectEnergy> effect_energies() const { return solver_.effect_energies(); }
    std::vector<double> effect_memory() const { return solver_.effect_memory(); }
    void set_effect_memory(std::span<const double> memory) { solver_.set_effect_memory(memory); }
    std::span<const double> masses() const { return solver_.masses(); }

    PotentialEnergy potential_energy() const;
    double kinetic_energy() const;
    PlanDescription describe() const { return solver_.describe(); }

private:
    using Field = std::vector<T>; ///< x y z a node
    VectorField<T> view(Field& field) const { return VectorField<T>::aos(field.data(), node_count()); }
    VectorField<const T> view(const Field& field) const {
        return VectorField<const T>::aos(field.data(), node_count());
    }

    mutable EquilibriumSolver<T> solver_; ///< has scratch of its own
    Field displacement_, velocity_;
};

extern template class ImplicitDynamics<float>;
extern template class ImplicitDynamics<double>;

} // namespace hybmss
