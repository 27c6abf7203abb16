#include "studies/textbook/problem.hpp"

#include "hybmss/explicit_dynamics.hpp"
#include "studies/stability/body_motion.hpp"
#include "studies/stability/static_body.hpp"

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <numbers>

namespace hybmss::textbook {
namespace {

using reference::Vector3d;
using stability::one_thread;
using stability::Vectors;

/// Waves of half the length of a rod of 1 x 1 x n cells of the length 1 that moves along one axis only: its nodes'
/// displacements, and the lattice's own omega^2 = u.K u / u.M u, of which they are the exact vector.
struct StandingWave {
    StandingWave(const Material& material, int n, Eigen::Index moving)
        : lattice(Lattice::box(1, 1, n, 1.0 / n)), rest(stability::rest_positions_of(lattice)), shape(rest) {
        Vectors none(rest.size(), Vector3d::Zero()), product = none;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            shape[i] = std::sin(kPi * rest[i].z()) * Vector3d::Unit(moving);
        }
        ForcePlan<double>(lattice, material, one_thread())
            .add_hessian_product(stability::view(none), stability::view(shape), stability::view(product));
        const ExplicitDynamics<double> body(lattice, material, one_thread());
        double stiffness = 0, mass = 0;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            stiffness += shape[i].dot(product[i]);
            mass += body.masses()[i] * shape[i].squaredNorm();
        }
        omega = std::sqrt(stiffness / mass);
    }

    Lattice lattice;
    Vectors rest, shape;
    double omega = 0;
};

Answer longitudinal_wave(const Material& material, int n) {
    const double nu = material.poisson_ratio;
    return {StandingWave(material, n, 2).omega / kPi,
            std::sqrt(2 * shear_modulus(material) * (1 - nu) / (1 - 2 * nu) / material.density)};
}

Answer shear_wave(const Material& material, int n) {
    return {StandingWave(material, n, 0).omega / kPi, std::sqrt(shear_modulus(material) / material.density)};
}

/// All but the motion along z is held, and that at both ends.
std::vector<PrescribedNode> guided(const Vectors& rest, bool ends) {
    std::vector<PrescribedNode> nodes;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const bool end = rest[i].z() == 0 || rest[i].z() > 1 - 1e-9;
        nodes.push_back(
            {static_cast<std::uint32_t>(i), static_cast<std::uint8_t>(ends && end ? 7 : 3), {0, 0, 0}, {0, 0, 0}});
    }
    return nodes;
}

double mean(const Vectors& vectors, std::span<const double> masses, Eigen::Index axis) {
    double sum = 0, mass = 0;
    for (std::size_t i = 0; i < vectors.size(); ++i) {
        sum += masses[i] * vectors[i][axis];
        mass += masses[i];
    }
    return sum / mass;
}

/// A dashpot beta k on every spring: the wave dies by exp(-beta omega^2 t / 2). At nu = 1/4 there are springs alone.
/// `n` steps a period, for one period; the rate.
Answer damped_wave(const Material& material, int n) {
    const StandingWave wave(material, 8, 2);
    const double damping = 0.02 / wave.omega, rate = damping * wave.omega * wave.omega / 2,
                 turning = std::sqrt(wave.omega * wave.omega - rate * rate), period = 2 * kPi / turning;
    ExplicitDynamics<double> body(wave.lattice, material, one_thread());
    body.prescribe(guided(wave.rest, true));
    body.damp_springs(damping);
    Vectors u = wave.shape;
    for (Vector3d& v : u) {
        v *= 1e-8;
    }
    Vectors v = u;
    for (Vector3d& velocity : v) {
        velocity *= -rate; // of u = exp(-rate t) cos(turning t)
    }
    body.set_displacements(stability::view(u));
    body.set_velocities(stability::view(v));
    const double before = stability::greatest_length(u);
    body.step({.time_step = period / n, .integrator = Integrator::leapfrog}, n);
    body.get_displacements(stability::view(u));
    return {std::log(before / stability::greatest_length(u)) / period, rate};
}

/// v = exp(-c t) of a body that nothing but the air resists.
Answer air(const Material& material, int n) {
    stability::BodyMotion<double> body(Lattice::box(n, n, n, 1.0 / n), material);
    body.set_velocities(Vectors(body.node_count(), Vector3d(1, 2, 3)));
    const double step = 0.5 * body.critical_time_step(), damping = 1 / (300 * step);
    body.step({.time_step = step, .mass_damping = damping, .integrator = Integrator::leapfrog}, 300);
    return {mean(body.velocities(), body.masses(), 2), 3 / std::numbers::e};
}

Answer free_fall(const Material& material, int n) {
    stability::BodyMotion<double> body(Lattice::box(n, n, n, 1.0 / n), material);
    const double step = 0.5 * body.critical_time_step(), time = 300 * step;
    body.step({.time_step = step, .acceleration = {0, 0, -9.81}, .integrator = Integrator::leapfrog}, 300);
    return {mean(body.displacements(), body.masses(), 2), -9.81 / 2 * time * time};
}

/// Spins fast enough to stretch by some percent, and vibrates.
Answer spin(const Material& material, int n) {
    stability::BodyMotion<double> body(Lattice::box(n, n, 2 * n, 1.0 / n), material);
    Vectors v;
    for (const Vector3d& x : body.rest()) {
        v.push_back(Vector3d(0.3, 0.05, 0.1).cross(x - Vector3d(0.5, 0.5, 1)));
    }
    body.set_velocities(v);
    const Vector3d before = body.angular_momentum();
    body.step({.time_step = 0.3 * body.critical_time_step()}, 2000);
    return {body.angular_momentum().norm(), before.norm()};
}

/// A rod flies end on against a wall and leaves it when the wave has come back: after 2 L / c, as fast as it came.
struct Bounce {
    double contact = 0, rebound = 0;
};
Bounce bounce(const Material& material, int n) {
    const Lattice lattice = Lattice::box(1, 1, n, 1.0 / n);
    const Vectors rest = stability::rest_positions_of(lattice);
    ExplicitDynamics<double> body(lattice, material, one_thread());
    body.set_obstacles(surface_nodes(lattice), std::array{Obstacle{.shape = PlaneShape{{0, 0, 1}}}});
    body.prescribe(guided(rest, false));
    const double speed = 1e-6, step = 0.05 * body.critical_time_step();
    Vectors v(rest.size(), Vector3d(0, 0, -speed));
    body.set_velocities(stability::view(v));
    // The layer that touches flutters: the last time counts.
    const double longest = 3 / longitudinal_wave(material, n).exact;
    Bounce bounce;
    for (long steps = 1; static_cast<double>(steps) * step < longest; ++steps) {
        const double before = body.obstacle_readings()[0].impulse[2];
        body.step({.time_step = step});
        if (body.obstacle_readings()[0].impulse[2] != before) {
            bounce.contact = step * static_cast<double>(steps);
        }
    }
    double mass = 0;
    for (const double m : body.masses()) {
        mass += m;
    }
    bounce.rebound = body.obstacle_readings()[0].impulse[2] / (mass * speed) - 1;
    return bounce;
}
Answer bounce_time(const Material& material, int n) {
    return {bounce(material, n).contact, 2 / longitudinal_wave(material, n).exact};
}
Answer bounce_speed(const Material& material, int n) {
    return {bounce(material, n).rebound, 1};
}

/// A block on a slope of 0.8 with the friction 0.5 slides by g (sin - 0.5 cos).
Answer incline(const Material& material, int n) {
    const Lattice lattice = Lattice::box(3 * n, n, n, 1.0 / n);
    const Vectors rest = stability::rest_positions_of(lattice);
    ExplicitDynamics<double> body(lattice, material, one_thread());
    body.set_obstacles(surface_nodes(lattice), std::array{Obstacle{.shape = PlaneShape{}, .friction = 0.5}});
    const double g = 1e-3, cosine = 1 / std::sqrt(1 + 0.8 * 0.8), step = 0.5 * body.critical_time_step();
    const long steps = std::lround(100 / step);
    const auto slide = [&](double damping) {
        body.step({step, {0.8 * g * cosine, -g * cosine, 0}, damping}, steps);
        Vectors v(rest.size());
        body.get_velocities(stability::view(v));
        return mean(v, body.masses(), 0);
    };
    slide(1); // until it lies still across the slope
    const double before = slide(0);
    return {(slide(0) - before) / (static_cast<double>(steps) * step), g * cosine * (0.8 - 0.5)};
}

} // namespace

std::vector<Problem> motion_problems() {
    using enum Agreement;
    return {
        {"longitudinal wave: speed", order, 0.005, 1.9, "cells in half a wave", {5, 10, 20, 40}, longitudinal_wave},
        {"shear wave: speed", order, 0.005, 1.9, "cells in half a wave", {5, 10, 20, 40}, shear_wave},
        {"free fall: way", rounding, 1e-11, 0, "cells across", {1, 4}, free_fall},
        {"damping by mass: speed of a free body", rounding, 1e-11, 0, "cells across", {1, 4}, air},
        {"spin, 2,000 steps: angular momentum", rounding, 1e-11, 0, "cells across", {2, 4}, spin},
        {"block on a slope with friction: acceleration", rounding, 1e-9, 0, "cells high", {2, 4}, incline},
        {"damping along the springs: rate of a wave",
         order,
         2e-4,
         0.9,
         "steps a period",
         {200, 400, 800},
         damped_wave,
         0.25},
        {"rod bounces off a wall: time of contact", order, 0.03, 0.6, "cells along", {10, 20, 40, 80}, bounce_time},
        {"rod bounces off a wall: speed after / before",
         order,
         0.05,
         0.6,
         "cells along",
         {10, 20, 40, 80},
         bounce_speed},
    };
}

} // namespace hybmss::textbook
