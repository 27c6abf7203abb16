#pragma once

/// \file
/// A lattice whose whole surface may touch obstacles.

#include "tests/moving_body.hpp"

#include <array>
#include <vector>

namespace hybmss::testing {

using Vector = std::array<double, 3>;

constexpr double kEdge = 0.125; // a power of two: lengths go to the body's unit and back without rounding
inline const Material kMaterial{.young_modulus = 1e6, .poisson_ratio = 0.3, .density = 1000};

template <class T>
struct TouchingBody {
    explicit TouchingBody(const Lattice& shape, const std::vector<Obstacle>& obstacles, const PlanOptions& options = {})
        : lattice(shape), dynamics(lattice, kMaterial, options) {
        dynamics.set_obstacles(surface_nodes(lattice), obstacles);
        time_step = 0.5 * dynamics.critical_time_step();
    }

    void set_velocity(const Vector& velocity) {
        std::vector<T> v;
        for (std::size_t n = 0; n < dynamics.node_count(); ++n) {
            for (const double component : velocity) {
                v.push_back(static_cast<T>(component));
            }
        }
        dynamics.set_velocities(VectorField<const T>::aos(v.data(), dynamics.node_count()));
    }
    std::vector<T> displacements() const {
        std::vector<T> u(3 * dynamics.node_count());
        dynamics.get_displacements(VectorField<T>::aos(u.data(), dynamics.node_count()));
        return u;
    }
    std::vector<T> velocities() const {
        std::vector<T> v(3 * dynamics.node_count());
        dynamics.get_velocities(VectorField<T>::aos(v.data(), dynamics.node_count()));
        return v;
    }
    double mass() const {
        double sum = 0;
        for (const double m : dynamics.masses()) {
            sum += m;
        }
        return sum;
    }
    Vector mean(const std::vector<T>& field) const {
        Vector sum = {0, 0, 0};
        for (std::size_t i = 0; i < field.size(); ++i) {
            sum[i % 3] += dynamics.masses()[i / 3] * static_cast<double>(field[i]) / mass();
        }
        return sum;
    }
    double energy() const {
        double sum = dynamics.potential_energy().total() + dynamics.kinetic_energy();
        for (const EffectEnergy& effect : dynamics.effect_energies()) {
            sum += effect.stored;
        }
        return sum;
    }

    Lattice lattice;
    ExplicitDynamics<T> dynamics;
    double time_step;
};

inline Obstacle floor_at(double height, double friction = 0, double stiffness = 0) {
    return {.shape = PlaneShape{{0, 2, 0}},
            .pose = {.position = {7, height, -3}},
            .friction = friction,
            .stiffness = stiffness};
}

/// The obstacle stiffness that is `part` of the body's own, 1/dt^2.
inline double stiffness_of(double part) {
    const double dt = ForcePlan<double>(Lattice::box(1, 1, 1, kEdge), kMaterial).critical_time_step();
    return part / (dt * dt);
}

/// A rigid body under its weight sinks until sum m w^2 p = M g: one face of a box of n layers has 1/(2 n) of its mass.
inline double rest_depth(int layers, double gravity, double stiffness) {
    return 2 * layers * gravity / stiffness;
}

} // namespace hybmss::testing
