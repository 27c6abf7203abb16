#include "studies/textbook/problem.hpp"

#include "hybmss/equilibrium.hpp"
#include "hybmss/stress.hpp"
#include "reference/homogeneous_lattice.hpp"
#include "studies/calculix/program.hpp"
#include "studies/paper/experiment.hpp"
#include "studies/stability/static_body.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace hybmss::textbook {
namespace {

using reference::Matrix3d;
using reference::Vector3d;
using stability::Vectors;

constexpr double kSmall = 1e-8; // a strain at which every law is linear
constexpr std::uint8_t kX = 1, kY = 2, kZ = 4, kAll = 7;

/// A lattice with what holds and loads it, and its equilibrium.
class Body {
public:
    Body(Lattice lattice, const Material& material)
        : lattice_(std::move(lattice)), material_(material), rest_(stability::rest_positions_of(lattice_)),
          solver_(lattice_, material, stability::one_thread()), u_(rest_.size(), Vector3d::Zero()) {}

    const Vectors& rest() const { return rest_; }
    const Vectors& displacements() const { return u_; }
    Loading& loading() { return loading_; }

    void hold(std::size_t node, std::uint8_t axes, const Vector3d& u = Vector3d::Zero()) {
        loading_.supports.push_back({static_cast<std::uint32_t>(node), axes, {u.x(), u.y(), u.z()}, {0, 0, 0}});
    }
    void push(std::size_t node, const Vector3d& force) {
        loading_.forces.resize(rest_.size(), {0, 0, 0});
        for (std::size_t a = 0; a < 3; ++a) {
            loading_.forces[node][a] += force[static_cast<Eigen::Index>(a)];
        }
    }
    void solve() {
        EquilibriumOptions options;
        options.tolerance = 1e-11;
        const EquilibriumResult result = solver_.solve(loading_, stability::view(u_), options);
        // Rounding may stop it before: what counts is the residual.
        if (result.status != EquilibriumStatus::converged && !(result.residual < 1e-9)) {
            throw std::runtime_error("textbook problem: " + result.message);
        }
        internal_ = Vectors(rest_.size());
        solver_.get_forces(stability::view(u_), stability::view(internal_));
    }
    /// What the supports exert on a node.
    Vector3d support(std::size_t node) const {
        return -internal_[node] - (loading_.forces.empty() ? Vector3d::Zero() : Vector3d(loading_.forces[node].data()));
    }
    std::vector<CellStress> stresses() {
        const StressMeter meter(lattice_, material_, stability::one_thread());
        std::vector<CellStress> stresses(meter.cell_count());
        meter.read<double>(stability::view(u_), stresses);
        return stresses;
    }
    /// Whether two coordinates are the same.
    bool near(double a, double b) const { return std::abs(a - b) < 1e-6 * lattice_.cell_size(); }
    /// The node at rest in this place.
    std::size_t at(const Vector3d& x) const {
        const auto found = std::ranges::find_if(
            rest_, [&](const Vector3d& rest) { return (rest - x).norm() < 1e-6 * lattice_.cell_size(); });
        if (found == rest_.end()) {
            throw std::logic_error("textbook problem: no node where one is looked for");
        }
        return static_cast<std::size_t>(found - rest_.begin());
    }

private:
    Lattice lattice_;
    Material material_;
    Vectors rest_;
    EquilibriumSolver<double> solver_;
    Vectors u_, internal_;
    Loading loading_;
};

/// The cells of a box of n^3 whose centre, from the box's low corner in its edges, is one that `keep` wants.
template <class Keep>
Lattice carved(int nx, int ny, int nz, double h, const Keep& keep) {
    std::vector<float> scales;
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                scales.push_back(keep(Vector3d((i + 0.5) * h, (j + 0.5) * h, (k + 0.5) * h)) ? 1.0f : 0.0f);
            }
        }
    }
    return Lattice::from_cells(nx, ny, nz, h, std::move(scales));
}

Lattice unit_box(int n, int length = 1) {
    return Lattice::box(n, n, length * n, 1.0 / n);
}

// ---- exact on every mesh

/// A homogeneous deformation of the surface is one of the whole: the greatest distance from it, in displacements.
Answer patch(const Lattice& lattice, const Material& material) {
    Matrix3d gradient;
    gradient << 0.06, 0.03, -0.02, -0.01, -0.05, 0.04, 0.02, 0.01, 0.07;
    Body body(lattice, material);
    for (const SurfaceNode& node : surface_nodes(lattice)) {
        body.hold(node.node, kAll, gradient * body.rest()[node.node]);
    }
    body.solve();
    double away = 0, size = 0;
    for (std::size_t n = 0; n < body.rest().size(); ++n) {
        away = std::max(away, (body.displacements()[n] - gradient * body.rest()[n]).norm());
        size = std::max(size, body.displacements()[n].norm());
    }
    return {away, 0, size};
}

Answer box_patch(const Material& material, int n) {
    return patch(unit_box(n), material);
}
Answer hole_patch(const Material& material, int n) {
    return patch(
        carved(n, n, n, 1.0 / n, [](const Vector3d& x) { return (x - Vector3d(0.6, 0.5, 0.4)).norm() > 0.25; }),
        material);
}
Answer blob_patch(const Material& material, int n) {
    return patch(carved(n, n, n, 1.0 / n, [](const Vector3d& x) { return (x - Vector3d(0.5, 0.5, 0.5)).norm() < 0.5; }),
                 material);
}

/// On rollers at z = 0, pulled at z = 1.
Body pulled_block(const Material& material, int n, double strain) {
    Body body(unit_box(n), material);
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d& x = body.rest()[i];
        const bool end = body.near(x.z(), 0) || body.near(x.z(), 1);
        const int axes = (body.near(x.x(), 0) ? kX : 0) | (body.near(x.y(), 0) ? kY : 0) | (end ? kZ : 0);
        if (axes != 0) {
            body.hold(i, static_cast<std::uint8_t>(axes), {0, 0, strain * x.z()});
        }
    }
    body.solve();
    return body;
}

double pull(const Body& body) {
    double force = 0;
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        force += body.near(body.rest()[i].z(), 1) ? body.support(i).z() : 0;
    }
    return force;
}

Answer young_modulus(const Material& material, int n) {
    return {pull(pulled_block(material, n, kSmall)) / kSmall, material.young_modulus};
}

Answer poisson_ratio(const Material& material, int n) {
    const Body body = pulled_block(material, n, kSmall);
    return {-body.displacements()[body.at({1, 1, 1})].x() / kSmall, material.poisson_ratio};
}

/// Thirteen springs and a volume under F = diag(w, w, 1.2): w where nothing pulls sideways, by secants, and the pull.
Answer stretched_bar(const Material& material, int n) {
    const double stretch = 1.2;
    const auto stress = [&](double w) {
        return reference::HomogeneousLattice(material, Vector3d(w, w, stretch).asDiagonal()).stress();
    };
    double w0 = 1, w1 = 0.95;
    for (int i = 0; i < 50 && std::abs(w1 - w0) > 1e-15; ++i) {
        const double s0 = stress(w0)(0, 0), s1 = stress(w1)(0, 0);
        w0 = std::exchange(w1, s1 == s0 ? w1 : w1 - s1 * (w1 - w0) / (s1 - s0));
    }
    return {pull(pulled_block(material, n, stretch - 1)), stress(w1)(2, 2)};
}

/// Turned by a right angle and more: the greatest force on a node, in E h^2.
Answer turned(const Material& material, int n) {
    Body body(unit_box(n), material);
    const double h = 1.0 / n;
    Vectors u = stability::rotation(body.rest(), {1, 2, -2}, 2.0), force(u.size(), Vector3d::Zero());
    ForcePlan<double>(unit_box(n), material, stability::one_thread())
        .add_forces(stability::view(u), stability::view(force));
    return {stability::greatest_length(force), 0, material.young_modulus * h * h};
}

// ---- linear elasticity

/// Integral of x, from the middle, times the hat function of a node over [-1/2, 1/2].
double hat_moment(const Body& body, double x, double h) {
    return body.near(x, 0.5) ? h / 4 - h * h / 6 : body.near(x, -0.5) ? -h / 4 + h * h / 6 : h * x;
}
/// Integral of the hat function alone.
double hat(const Body& body, double x, double h) {
    return body.near(std::abs(x), 0.5) ? h / 2 : h;
}

/// Couples bend a bar of 1 x 1 x 4 to u = k (-(z^2 + nu (x^2 - y^2))/2, -nu x y, x z): the end's deflection.
Answer pure_bending(const Material& material, int n) {
    constexpr double kLength = 4;
    Body body(unit_box(n, 4), material);
    const double h = 1.0 / n;
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d x = body.rest()[i] - Vector3d(0.5, 0.5, 0);
        if (body.near(x.z(), 0)) {
            const bool middle = body.near(x.y(), 0) && body.near(x.x(), 0);
            const bool side = body.near(x.y(), 0) && body.near(x.x(), 0.5);
            body.hold(i, middle ? kAll : side ? kY | kZ : kZ);
        } else if (body.near(x.z(), kLength)) {
            body.push(i, {0, 0, kSmall * material.young_modulus * hat_moment(body, x.x(), h) * hat(body, x.y(), h)});
        }
    }
    body.solve();
    return {body.displacements()[body.at({0.5, 0.5, kLength})].x(), -kSmall * kLength * kLength / 2};
}

constexpr double kCantileverLength = 10; // of 1 x 1 across

/// Clamped at z = 0, with `force` along x spread over the other end; at rest.
Body pushed_cantilever(const Material& material, int n, double force) {
    Body body(unit_box(n, 10), material);
    const double h = 1.0 / n;
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d x = body.rest()[i] - Vector3d(0.5, 0.5, 0);
        if (body.near(x.z(), 0)) {
            body.hold(i, kAll);
        } else if (body.near(x.z(), kCantileverLength)) {
            body.push(i, {force * hat(body, x.x(), h) * hat(body, x.y(), h), 0, 0});
        }
    }
    body.solve();
    return body;
}

/// Timoshenko's cantilever of 1 x 1 x 10 under a shear force at its end.
Answer cantilever(const Material& material, int n) {
    const double force = kSmall * material.young_modulus;
    const Body body = pushed_cantilever(material, n, force);
    double deflection = 0, nodes = 0;
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        if (body.near(body.rest()[i].z(), kCantileverLength)) {
            deflection += body.displacements()[i].x();
            ++nodes;
        }
    }
    const double shear = paper::shear_coefficient(material.poisson_ratio) * shear_modulus(material);
    return {deflection / nodes,
            force * (4 * std::pow(kCantileverLength, 3) / material.young_modulus + kCantileverLength / shear)};
}

/// What the force at the end does, over its square: so the end's deflection, each node's by its share of the force.
template <class Forces, class Displacements>
double compliance(const Forces& forces, const Displacements& displacements) {
    double work = 0, force = 0;
    for (std::size_t n = 0; n < forces.size(); ++n) {
        work += forces[n][0] * displacements[n][0];
        force += forces[n][0];
    }
    return work / (force * force);
}

/// The same cantilever of finite elements; on the end each corner and each middle of an edge has the integral of its
/// shape function.
double element_compliance(double poisson_ratio, int n, calculix::ElementType type) {
    calculix::Problem problem{calculix::brick_mesh(unit_box(n, 10), type),
                              {.young_modulus = 1, .poisson_ratio = poisson_ratio},
                              {},
                              calculix::Geometry::linear,
                              calculix::Law::linear};
    const auto& rest = problem.mesh.rest;
    auto& forces = problem.loading.forces;
    forces.resize(rest.size(), {0, 0, 0});
    for (std::size_t i = 0; i < rest.size(); ++i) {
        if (rest[i][2] < 1e-9) {
            problem.loading.supports.push_back({static_cast<std::uint32_t>(i), kAll, {0, 0, 0}, {0, 0, 0}});
        }
    }
    const std::size_t count = problem.mesh.nodes_per_element();
    for (std::size_t i = 0; i < problem.mesh.elements.size(); ++i) {
        const std::uint32_t node = problem.mesh.elements[i];
        if (rest[node][2] > kCantileverLength - 1e-9) {
            const double share = count == 8 ? 1.0 / 4 : i % count < 8 ? -1.0 / 12 : 1.0 / 3;
            forces[node][0] += kSmall * share / (n * n);
        }
    }
    return compliance(forces, calculix::solve(problem).displacements);
}

/// Saint-Venant: ends of a square bar that turn, free to warp.
Answer torsion(const Material& material, int n) {
    constexpr double kLength = 2;
    Body body(unit_box(n, 2), material);
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d x = body.rest()[i] - Vector3d(0.5, 0.5, 0);
        if (body.near(x.z(), 0) || body.near(x.z(), kLength)) {
            const bool corner = body.near(x.z(), 0) && body.near(x.x(), 0.5) && body.near(x.y(), 0.5);
            body.hold(i, corner ? kAll : kX | kY, {-kSmall * x.z() * x.y(), kSmall * x.z() * x.x(), 0});
        }
    }
    body.solve();
    double torque = 0, sum = 0;
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d x = body.rest()[i] - Vector3d(0.5, 0.5, 0);
        torque += body.near(x.z(), kLength) ? x.x() * body.support(i).y() - x.y() * body.support(i).x() : 0;
    }
    for (int k = 1; k < 40; k += 2) {
        sum += std::tanh(k * std::numbers::pi / 2) / std::pow(k, 5);
    }
    const double stiffness = (1 - 192 / std::pow(std::numbers::pi, 5) * sum) / 3; // of G a^4
    return {torque, kSmall * shear_modulus(material) * stiffness};
}

/// Hangs from z = 4, where it has the displacements of a free bar: rho g / 2E (z^2 - 16 + nu r^2), -nu rho g z x / E.
Answer own_weight(const Material& material, int n) {
    constexpr double kLength = 4;
    Body body(unit_box(n, 4), material);
    const double pull = kSmall / kLength, nu = material.poisson_ratio; // rho g / E
    body.loading().acceleration = {0, 0, -pull * material.young_modulus / material.density};
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d x = body.rest()[i] - Vector3d(0.5, 0.5, 0);
        if (body.near(x.z(), kLength)) {
            body.hold(i, kAll,
                      {-nu * pull * kLength * x.x(), -nu * pull * kLength * x.y(),
                       pull / 2 * nu * (x.x() * x.x() + x.y() * x.y())});
        }
    }
    body.solve();
    return {body.displacements()[body.at({0.5, 0.5, 0})].z(), -pull / 2 * kLength * kLength};
}

// ---- round bodies of cubes

constexpr double kHole = 0.25; // radius in a plate of 1 x 1

/// Kirsch, plane strain: a plate pulled along x, a round hole in its middle; its outer edges have his displacements.
Body kirsch_plate(const Material& material, int n) {
    const double h = 1.0 / n, k = 3 - 4 * material.poisson_ratio, a = kHole,
                 unit = kSmall * material.young_modulus * a / (8 * shear_modulus(material));
    Body body(carved(n, n, 1, h, [](const Vector3d& x) { return std::hypot(x.x() - 0.5, x.y() - 0.5) > kHole; }),
              material);
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d x = body.rest()[i] - Vector3d(0.5, 0.5, 0);
        const double r = std::hypot(x.x(), x.y()), t = std::atan2(x.y(), x.x());
        const Vector3d u(r / a * (k + 1) * std::cos(t) + 2 * a / r * ((1 + k) * std::cos(t) + std::cos(3 * t)) -
                             2 * std::pow(a / r, 3) * std::cos(3 * t),
                         r / a * (k - 3) * std::sin(t) + 2 * a / r * ((1 - k) * std::sin(t) + std::sin(3 * t)) -
                             2 * std::pow(a / r, 3) * std::sin(3 * t),
                         0);
        const bool edge = body.near(std::abs(x.x()), 0.5) || body.near(std::abs(x.y()), 0.5);
        body.hold(i, edge ? kAll : kZ, unit * u);
    }
    body.solve();
    return body;
}

/// How far the hole opens along the pull.
Answer kirsch_opening(const Material& material, int n) {
    const Body body = kirsch_plate(material, n);
    const double k = 3 - 4 * material.poisson_ratio;
    return {body.displacements()[body.at({0.5 + kHole, 0.5, 0})].x(),
            kSmall * material.young_modulus * kHole * 3 * (k + 1) / (8 * shear_modulus(material))};
}

/// The greatest stress along the pull, over that far away.
Answer kirsch_stress(const Material& material, int n) {
    double greatest = 0;
    for (const CellStress& cell : kirsch_plate(material, n).stresses()) {
        greatest = std::max(greatest, cell.cauchy[0]);
    }
    return {greatest / (kSmall * material.young_modulus), 3};
}

/// Lame: pressure p in a hollow ball of radii 1/2 and 1, an eighth of it; the cavity's growth as its surface's way.
Answer hollow_ball(const Material& material, int n) {
    constexpr double kInner = 0.5;
    const double h = 1.0 / n, p = kSmall * material.young_modulus, nu = material.poisson_ratio;
    const auto solid = [](const Vector3d& x) { return x.norm() > kInner && x.norm() < 1; };
    Body body(carved(n, n, n, h, solid), material);
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        const Vector3d& x = body.rest()[i];
        const int axes =
            (body.near(x.x(), 0) ? kX : 0) | (body.near(x.y(), 0) ? kY : 0) | (body.near(x.z(), 0) ? kZ : 0);
        if (axes != 0) {
            body.hold(i, static_cast<std::uint8_t>(axes));
        }
        // A quarter of each face between a cell inside the cavity and one of the ball that meets here.
        for (int face = 0; face < 12; ++face) {
            const int axis = face / 4, second = (axis + 1) % 3, third = (axis + 2) % 3;
            Vector3d low = x;
            low[axis] -= h / 2;
            low[second] += (face & 1 ? h : -h) / 2;
            low[third] += (face & 2 ? h : -h) / 2;
            Vector3d high = low;
            high[axis] += h;
            const bool inside = low[axis] > 0 && low[second] > 0 && low[third] > 0;
            if (inside && low.norm() < kInner && solid(high)) {
                body.push(i, p * h * h / 4 * Vector3d::Unit(axis));
            }
        }
    }
    body.solve();
    double work = 0;
    for (std::size_t i = 0; i < body.rest().size(); ++i) {
        work += Vector3d(body.loading().forces[i].data()).dot(body.displacements()[i]);
    }
    const double inner = std::pow(kInner, 3);
    return {work / p / (std::numbers::pi * kInner * kInner / 2),
            p * kInner * ((1 - 2 * nu) * inner + (1 + nu) / 2) / (material.young_modulus * (1 - inner))};
}

/// Hertz: a stiff ball pressed without friction into a quarter of a block, so deep that it touches within a sixth of
/// the block's edge. The far faces have the displacements of Boussinesq's point force. The force.
Answer hertz(const Material& material, int n) {
    constexpr double kTouch = 1.0 / 6;
    const double depth = kSmall * kTouch, radius = kTouch * kTouch / depth, nu = material.poisson_ratio,
                 force = 4.0 / 3 * material.young_modulus / (1 - nu * nu) * std::sqrt(radius) * std::pow(depth, 1.5);
    Body body(unit_box(n), material);
    const auto from_axis = [](const Vector3d& x) { return std::hypot(x.x(), x.y()); };
    const auto ball = [&](const Vector3d& x) { return from_axis(x) * from_axis(x) / (2 * radius) - depth; };
    std::vector<char> touches(body.rest().size(), 0);
    for (std::size_t i = 0; i < touches.size(); ++i) {
        touches[i] = body.near(body.rest()[i].z(), 1) && ball(body.rest()[i]) < 0;
    }
    const auto far = [&](const Vector3d& x) {
        return body.near(x.z(), 0) || body.near(x.x(), 1) || body.near(x.y(), 1);
    };
    for (int round = 0, changed = 1; changed > 0; ++round) {
        if (round == 30) {
            throw std::runtime_error("textbook problem: Hertz' contact does not come to rest");
        }
        body.loading().supports.clear();
        for (std::size_t i = 0; i < touches.size(); ++i) {
            const Vector3d& x = body.rest()[i];
            const double z = 1 - x.z(), r = from_axis(x), from = std::hypot(r, z);
            if (far(x)) {
                const double unit = force / (4 * std::numbers::pi * shear_modulus(material)),
                             out = unit * (z / std::pow(from, 3) - (1 - 2 * nu) / (from * (from + z)));
                body.hold(i, kAll,
                          {out * x.x(), out * x.y(), -unit * (z * z / std::pow(from, 3) + 2 * (1 - nu) / from)});
            } else if (const int axes =
                           (body.near(x.x(), 0) ? kX : 0) | (body.near(x.y(), 0) ? kY : 0) | (touches[i] ? kZ : 0);
                       axes != 0) {
                body.hold(i, static_cast<std::uint8_t>(axes), {0, 0, ball(x)});
            }
        }
        body.solve();
        changed = 0;
        for (std::size_t i = 0; i < touches.size(); ++i) {
            const Vector3d& x = body.rest()[i];
            if (body.near(x.z(), 1) && !far(x)) {
                const bool now =
                    touches[i] ? body.support(i).z() < 0 : body.displacements()[i].z() > ball(x) + 1e-9 * depth;
                changed += now != static_cast<bool>(touches[i]);
                touches[i] = now;
            }
        }
    }
    double pressed = 0;
    for (std::size_t i = 0; i < touches.size(); ++i) {
        pressed -= touches[i] ? 4 * body.support(i).z() : 0;
    }
    return {pressed, force};
}

} // namespace

std::vector<Problem> static_problems() {
    using enum Agreement;
    return {
        {"patch test at 7 % strain, box: distance", rounding, 1e-9, 0, "cells across", {3, 8}, box_patch},
        {"patch test, box with a hole: distance", rounding, 1e-9, 0, "cells across", {6, 12}, hole_patch},
        {"patch test, ball of cubes: distance", rounding, 1e-9, 0, "cells across", {6, 12}, blob_patch},
        {"turned by 2 rad: force on a node, E h^2", rounding, 1e-13, 0, "cells across", {3, 8}, turned},
        {"Young's modulus", rounding, 1e-7, 0, "cells across", {1, 4}, young_modulus},
        {"Poisson's ratio", rounding, 1e-7, 0, "cells across", {1, 4}, poisson_ratio},
        {"bar stretched by 20 %: force", rounding, 1e-9, 0, "cells across", {1, 4}, stretched_bar},
        {"bar bent by couples: deflection", order, 0.08, 1.7, "cells across", {2, 4, 8, 16}, pure_bending},
        {"cantilever, Timoshenko: deflection", theory, 0.25, 0, "cells across", {1, 2, 4, 8}, cantilever},
        {"torsion, Saint-Venant: torque", order, 0.08, 1.7, "cells across", {2, 4, 8, 16}, torsion},
        {"bar hung up: lengthening", order, 3e-4, 0, "cells across", {2, 4, 8}, own_weight},
        {"hole in a plate, Kirsch: opening",
         order,
         1e-3,
         0,
         "cells in the radius",
         {4, 8, 16, 32},
         [](const Material& m, int n) { return kirsch_opening(m, 4 * n); }},
        {"hole in a plate, Kirsch: greatest stress",
         order,
         0.12,
         1,
         "cells in the radius",
         {4, 8, 16, 32},
         [](const Material& m, int n) { return kirsch_stress(m, 4 * n); }},
        {"hollow ball under pressure, Lame: inner radius",
         order,
         0.08,
         0.6,
         "cells in the radius",
         {4, 8, 16},
         [](const Material& m, int n) { return hollow_ball(m, 2 * n); }},
        {"ball pressed on a block, Hertz: force",
         order,
         0.02,
         2,
         "cells in the radius",
         {2, 4, 8},
         [](const Material& m, int n) { return hertz(m, 6 * n); }},
    };
}

paper::Table clamped_cantilever_table(bool quick) {
    // The end's deflection by the force, times E a, of the body itself: what HybMSS-M and other forms, which agree to
    // 0.01 %, come to from 8, 12 and 16 cells across.
    constexpr std::pair<double, double> kLimits[] = {{0, 4024.05}, {0.3, 4004.2}, {0.45, 3970.9}};
    const bool elements = !quick && calculix::is_installed();
    paper::Table table{
        "clamped-cantilever",
        "A clamped cantilever on few cells",
        {"1 x 1 x 10, clamped, a shear force spread over its end; errors of stiffness against the converged one of the "
         "same clamped body (extrapolated from 8, 12 and 16 cells across), in percent. HybMSS has A = 1, HybMSS-M "
         "A = 0; finite elements on the same mesh."},
        {{"poisson_ratio", "nu"},
         {"across", "cells across", 0},
         {"nodes", "HybMSS", 2},
         {"means", "HybMSS-M", 2},
         {"c3d8i", "C3D8I", 2},
         {"c3d20", "C3D20", 2}},
        {},
        {"Without the clamp HybMSS-M bends exactly, whatever nu. What is left comes from where the clamp ends, at the "
         "section's edges: elements with 20 nodes miss it as well."}};
    for (const auto& [nu, limit] : kLimits) {
        for (const int n : quick ? std::vector{1, 2} : std::vector{1, 2, 4, 8}) {
            auto& row = table.rows.emplace_back();
            row = {fmt::format("{:g}", nu), static_cast<double>(n)};
            Problem of;
            of.poisson_ratio = nu;
            const auto error = [limit = limit](double compliance) { return 100 * (limit / compliance - 1); };
            for (const SpringForm form : {SpringForm::nodes, SpringForm::means}) {
                Body body = pushed_cantilever(unit_material(of, form), n, kSmall);
                row.emplace_back(error(compliance(body.loading().forces, body.displacements())));
            }
            for (const auto type : {calculix::ElementType::c3d8i, calculix::ElementType::c3d20}) {
                // C3D20 on 8 cells across takes a minute.
                const bool runs = elements && (n < 8 || type == calculix::ElementType::c3d8i);
                row.push_back(runs ? paper::Cell(error(element_compliance(nu, n, type))) : paper::Cell());
            }
        }
    }
    return table;
}

namespace {

/// alpha and beta of cells with so many free sides of their section: inside, at a face, at an edge of the bar.
struct TwistWeights {
    const char* name;
    double alpha[3], beta[3];
};

/// J of a bar of ny x nz cells of HybMSS-M, over h^4: all but its warp is given, and that makes the energy least,
///
///     sum over cells  G/2 [ (w_y - z)^2 + (w_z + y)^2 ] + 2/3 G [ (alpha + beta) p^2 + alpha/8 ],   h = 1,
///
/// with the mean slopes w_y, w_z of the warp and its pattern p = (w_--  - w_+- - w_-+ + w_++)/4 = P_11 (P_33 = -P_22 =
/// 1/4).
double torsion_constant(int ny, int nz, const TwistWeights& weights) {
    const Eigen::Index nodes = (ny + 1) * (nz + 1);
    Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(nodes, nodes);
    Eigen::VectorXd force = Eigen::VectorXd::Zero(nodes);
    const Eigen::Vector4d along_y(-0.5, 0.5, -0.5, 0.5), along_z(-0.5, -0.5, 0.5, 0.5),
        pattern(0.25, -0.25, -0.25, 0.25);
    double rigid = 0; // without warp
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            const int free_sides = std::min((j == 0) + (j == ny - 1) + (k == 0) + (k == nz - 1), 2);
            const double alpha = weights.alpha[free_sides], beta = weights.beta[free_sides];
            const double y = j + 0.5 - ny / 2.0, z = k + 0.5 - nz / 2.0;
            const Eigen::Vector4i corner = Eigen::Vector4i(0, 1, ny + 1, ny + 2).array() + (j + (ny + 1) * k);
            stiffness(corner, corner) += along_y * along_y.transpose() + along_z * along_z.transpose() +
                                         4.0 / 3 * (alpha + beta) * pattern * pattern.transpose();
            force(corner) += y * along_z - z * along_y;
            rigid += y * y + z * z + alpha / 6;
        }
    }
    stiffness(0, 0) += 1; // a warp that is the same everywhere
    return rigid - force.dot(stiffness.ldlt().solve(force));
}

/// Saint-Venant's of a rectangle, a >= b: a b^3 (1/3 - 64 b / (pi^5 a) sum tanh(k pi a / 2 b) / k^5) over odd k.
double exact_torsion_constant(double a, double b) {
    double series = 0;
    for (int k = 1; k < 200; k += 2) {
        series += std::tanh(k * kPi * a / (2 * b)) / std::pow(k, 5);
    }
    return a * std::pow(b, 3) * (1.0 / 3 - 64 * b / (std::pow(kPi, 5) * a) * series);
}

} // namespace

paper::Table twist_table() {
    constexpr double a = 0.37385, b = 4 - 3 * a;
    const TwistWeights all[] = {{"HybMSS-M's", {a, a, a}, {b, b, b}},
                                {"2 cells across at their limit", {0.323, 0.323, 0.323}, {3.031, 3.031, 3.031}},
                                {"4 cells across right", {0.155, 0.155, 0.155}, {3.535, 3.535, 3.535}},
                                {"right as h -> 0", {0, 0, 0}, {4, 4, 4}},
                                {"square bars right, plates not", {a, a, a}, {0.8, 0.8, 0.8}},
                                {"by free sides", {0, 0.11, a}, {4, 3.67, b}}};
    paper::Table table{
        "twist",
        "What weights of the twist patterns make of bars",
        {"alpha and beta of HybMSS-M's k_t: errors of a twisted plate of one cell, (3 alpha + beta)/4 - 1, and of the "
         "torsional stiffness of bars that warp freely, by their cells across, in percent. \"by free sides\": of cells "
         "inside, "
         "at a face and at an edge of the bar."},
        {{"weights", "weights"},
         {"alpha", "alpha"},
         {"beta", "beta"},
         {"plate", "plate", 1},
         {"1x1", "1 x 1", 1},
         {"2x2", "2 x 2", 2},
         {"4x4", "4 x 4", 2},
         {"8x8", "8 x 8", 2},
         {"16x16", "16 x 16", 2},
         {"1x4", "1 x 4", 1},
         {"2x6", "2 x 6", 2},
         {"3x5", "3 x 5", 2}},
        {},
        {"A bar of 2 x 2 cells does not warp: its stiffness goes by alpha alone. A plate of any thickness fixes beta "
         "by it. So one weight is left, and no value of it is right for 2 and for 4 cells across.",
         "Weights by the number of free sides are right for all but one cell across; but a cell's energy would hang on "
         "its neighbours, and with every cut on others."}};
    for (const TwistWeights& weights : all) {
        const auto text = [](const double(&value)[3]) {
            return value[0] == value[2] ? fmt::format("{:g}", value[0])
                                        : fmt::format("{:g}, {:g}, {:g}", value[0], value[1], value[2]);
        };
        auto& row = table.rows.emplace_back();
        row = {std::string(weights.name), text(weights.alpha), text(weights.beta),
               100 * ((3 * weights.alpha[2] + weights.beta[2]) / 4 - 1)};
        for (const auto& [ny, nz] : {std::pair(1, 1), {2, 2}, {4, 4}, {8, 8}, {16, 16}, {1, 4}, {2, 6}, {3, 5}}) {
            row.emplace_back(100 * (torsion_constant(ny, nz, weights) / exact_torsion_constant(nz, ny) - 1));
        }
    }
    return table;
}

} // namespace hybmss::textbook
