// Equilibria and implicit steps against rigid obstacles: the potential against finite differences, weights, plates, and
// the same equilibrium by steps in time.

#include "hybmss/equilibrium.hpp"
#include "plan/tuning/planned_body.hpp"
#include "solvers/newton/contact_potential.hpp"
#include "tests/moving_body.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

using testing::expect_refusal;

constexpr double kCellSize = 0.1;
const Material kMaterial{1e5, 0.3, 1000, 1};

RigidPose at(const Point& position, const Point& turned_by = {0, 0, 0}) {
    return {.position = position, .rotation = turned({1, 0, 0, 0, 1, 0, 0, 0, 1}, turned_by)};
}

Obstacle plane(const Point& position, const Point& normal) {
    return {.shape = PlaneShape{normal}, .pose = at(position)};
}

EquilibriumOptions to(double tolerance, PreconditionerKind kind = PreconditionerKind::automatic) {
    EquilibriumOptions options;
    options.tolerance = tolerance;
    options.preconditioner = kind;
    return options;
}

const std::vector<Point> kOctahedron = {{0.3, 0, 0},  {-0.3, 0, 0}, {0, 0.3, 0},
                                        {0, -0.3, 0}, {0, 0, 0.3},  {0, 0, -0.3}};
const std::vector<std::array<std::uint32_t, 3>> kItsTriangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

/// Displacements, and what else a solve leaves.
struct Solved {
    EquilibriumResult result;
    std::vector<double> u;
    std::vector<ObstacleReading> readings;
};
Solved solved(const Lattice& lattice, std::span<const Obstacle> obstacles, const Loading& loading,
              const EquilibriumOptions& options = {}, int threads = 1) {
    PlanOptions plan;
    plan.threads = threads;
    EquilibriumSolver<double> solver(lattice, kMaterial, plan);
    solver.set_obstacles(surface_nodes(lattice), obstacles);
    Solved out;
    out.u.assign(3 * solver.node_count(), 0.0);
    out.result = solver.solve(loading, VectorField<double>::aos(out.u.data(), solver.node_count()), options);
    out.readings = solver.obstacle_readings(VectorField<const double>::aos(out.u.data(), solver.node_count()));
    return out;
}

/// Derivatives of the potential by differences, where nodes touch several obstacles of each shape, turned ones too.
TEST(ContactPotential, forces_and_second_derivatives_are_those_of_the_potential) {
    const Lattice lattice = Lattice::box(5, 4, 6, kCellSize);
    const PlannedBody<double> planned = plan_body<double>(lattice, kMaterial, {}, Operation::forces);
    const Body<double>& body = *planned.body;
    const std::vector<Obstacle> obstacles = {
        {.shape = PlaneShape{{1, 2, 0.5}}, .pose = at({0.05, 0.05, 0.05}, {0.3, -0.4, 0.2})},
        {.shape = SphereShape{0.25}, .pose = at({0.5, 0.2, 0.3})},
        {.shape = BoxShape{{0.3, 0.4, 0.2}}, .pose = at({0.3, 0.45, 0.6}, {0.1, 0.5, -0.3})},
        {.shape = CapsuleShape{{0.1, 0.3, 0.2}, 0.12}, .pose = at({0, 0.3, 0.5}, {-0.2, 0.3, 0.7})},
        {.shape = CapsuleShape{{0, 0, 0}, 0.2}, .pose = at({0.5, 0.4, 0})},
        {.shape = HullShape(kOctahedron), .pose = at({0.25, 0, 0.3}, {0.2, 0.1, -0.4})},
        {.shape = MeshShape(kOctahedron, kItsTriangles, 12), .pose = at({0.1, 0.3, 0.1}, {-0.1, 0.4, 0.3})},
        {.shape = HeightShape({3, 4}, {0.25, 0.2},
                              std::array{0.1, 0.12, 0.05, 0.02, 0.2, 0.1, 0.1, 0.03, 0.1, 0.1, 0.05, 0.0}),
         .pose = at({0.02, -0.03, 0}, {0.1, 0.05, -0.1})}};
    ContactPotential<double> contact(body, surface_nodes(lattice), obstacles);
    const std::size_t n = body.node_count();
    const std::vector<double> u = testing::random_field<double>(n, 0.2 * kCellSize, 3),
                              p = testing::random_field<double>(n, kCellSize, 4);
    State<double> state = body.make_state(false), near = body.make_state(false);
    body.write(VectorField<const double>::aos(u.data(), n), 1 / body.length_unit(), state.displacement);
    const double eps = 1e-6;
    const auto moved = [&](double step) {
        std::vector<double> there = u;
        for (std::size_t i = 0; i < there.size(); ++i) {
            there[i] += step * p[i];
        }
        body.write(VectorField<const double>::aos(there.data(), n), 1 / body.length_unit(), near.displacement);
        return contact.value(near);
    };
    const auto gradient_of = [&](const State<double>& of) {
        NodeField<double> gradient;
        Body<double>::clear_like(state.displacement, gradient);
        contact.add_gradient(of, gradient);
        std::vector<double> values(3 * n);
        body.read(gradient, 1, VectorField<double>::aos(values.data(), n));
        return values;
    };
    const std::vector<double> gradient = gradient_of(state);
    const double change = (moved(eps) - moved(-eps)) / (2 * eps);
    EXPECT_NEAR(std::inner_product(gradient.begin(), gradient.end(), p.begin(), 0.0), change, 1e-6 * std::abs(change));
    moved(eps);
    const std::vector<double> more = gradient_of(near);
    moved(-eps);
    const std::vector<double> less = gradient_of(near);
    const std::vector<TouchedNode> touched = contact.second_derivatives(state);
    EXPECT_GT(touched.size(), 40u);
    std::vector<double> product(3 * n, 0.0);
    double largest = 0, turning = 0;
    for (const TouchedNode& node : touched) {
        constexpr std::size_t kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                product[3 * node.node + i] += node.whole[kEntry[i][j]] * p[3 * node.node + j] / body.length_unit();
                turning = std::max(turning, std::abs(node.whole[kEntry[i][j]] - node.along[kEntry[i][j]]));
            }
            largest = std::max(largest, std::abs(product[3 * node.node + i]));
        }
    }
    EXPECT_GT(turning, 0.1 * touched[0].along[0]); // so that it is tested
    for (std::size_t i = 0; i < 3 * n; ++i) {
        EXPECT_NEAR(product[i], (more[i] - less[i]) / (2 * eps), 1e-6 * largest) << i;
    }
    const std::vector<ObstacleReading> readings = contact.readings(state);
    double energy = 0;
    Point force = {0, 0, 0};
    for (const ObstacleReading& reading : readings) {
        EXPECT_GT(reading.nodes, 0u);
        energy += reading.energy;
        force = plus(force, 1, reading.force);
    }
    EXPECT_NEAR(energy, contact.value(state), 1e-12 * energy);
    for (std::size_t i = 0; i < 3 * n; ++i) {
        force[i % 3] += gradient[i];
    }
    EXPECT_LT(length(force), 1e-12 * largest);
}

/// It is held by nothing else, and slides without a force.
TEST(StaticContact, a_plane_bears_a_block_by_its_weight) {
    const Lattice lattice = Lattice::box(5, 4, 6, kCellSize);
    const Obstacle ground = plane({0, -0.03, 0}, {0, 1, 0}); // it falls by 3 cm first
    Loading loading{.supports = {}, .forces = {}, .acceleration = {0, -10, 0}};
    const double weight = 0.5 * 0.4 * 0.6 * 1000 * 10;
    for (const PreconditionerKind kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
        const Solved s = solved(lattice, std::array{ground}, loading, to(1e-8, kind));
        ASSERT_EQ(s.result.status, EquilibriumStatus::converged) << s.result.message;
        EXPECT_NEAR(s.readings[0].force[1], weight, 1e-6 * weight);
        EXPECT_NEAR(s.readings[0].force[0], 0, 1e-9 * weight);
        EXPECT_EQ(s.readings[0].nodes, 42u);
        EXPECT_LT(s.readings[0].depth, 1e-3);
        EXPECT_LT(s.result.newton_iterations, 80);
    }
    // A tilted one bears nothing along itself: the body slides away.
    const Solved lost = solved(lattice, std::array{plane({0, -0.03, 0}, {0.2, 1, 0})}, loading);
    EXPECT_EQ(lost.result.status, EquilibriumStatus::unbounded) << lost.result.message;
}

/// Two smooth plates press a block that nothing else holds; its faces are plane, and the force that of faces so held.
/// The plane's own equilibrium on what is a plane there; its weight on a mesh's edge and on waves.
TEST(StaticContact, hulls_meshes_and_height_fields_bear_a_block) {
    const Lattice lattice = Lattice::box(5, 4, 6, kCellSize);
    const Loading loading{.supports = {}, .forces = {}, .acceleration = {0, -10, 0}};
    const double weight = 0.5 * 0.4 * 0.6 * 1000 * 10;
    std::vector<Point> box;
    for (int c = 0; c < 8; ++c) {
        box.push_back({c & 1 ? 2.0 : -2.0, c & 2 ? 0.0 : -3.0, c & 4 ? 2.0 : -2.0});
    }
    const std::vector<std::array<std::uint32_t, 3>> its = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                                           {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                                           {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    const Solved flat = solved(lattice, std::array{plane({0, -0.01, 0}, {0, 1, 0})}, loading, to(1e-9));
    ASSERT_EQ(flat.result.status, EquilibriumStatus::converged) << flat.result.message;
    for (const ObstacleShape& shape : {ObstacleShape(HullShape(box)), ObstacleShape(MeshShape(box, its, 40)),
                                       ObstacleShape(HeightShape({2, 2}, {4, 4}, std::vector<double>(4, 0.0)))}) {
        const Obstacle ground = {.shape = shape, .pose = at({0.1, -0.01, 0.2})};
        const Solved s = solved(lattice, std::array{ground}, loading, to(1e-9));
        ASSERT_EQ(s.result.status, EquilibriumStatus::converged) << s.result.message;
        EXPECT_NEAR(s.readings[0].force[1], weight, 1e-7 * weight);
        for (std::size_t i = 1; i < s.u.size(); i += 3) {
            ASSERT_NEAR(s.u[i], flat.u[i], 1e-9) << i; // along the plane nothing holds it
        }
    }
    std::vector<double> waves;
    for (int k = 0; k < 12; ++k) {
        for (int i = 0; i < 12; ++i) { // a bowl, so that it stays
            waves.push_back(0.03 * (i - 5) * (i - 5) + 0.02 * (k - 6) * (k - 6) + 0.004 * std::sin(3.0 * i * k));
        }
    }
    const Obstacle bowl = {.shape = HeightShape({12, 12}, {0.15, 0.15}, waves), .pose = at({-0.5, -0.2, -0.6})};
    const Solved s = solved(lattice, std::array{bowl}, loading, to(1e-6));
    ASSERT_EQ(s.result.status, EquilibriumStatus::converged) << s.result.message;
    EXPECT_NEAR(s.readings[0].force[1], weight, 1e-4 * weight);
    EXPECT_NEAR(s.readings[0].force[0], 0, 1e-4 * weight);
}

TEST(StaticContact, plates_press_as_held_faces_do) {
    const Lattice lattice = Lattice::box(6, 8, 6, kCellSize);
    EquilibriumSolver<double> solver(lattice, kMaterial);
    const std::array<Obstacle, 2> plates = {plane({0, 0, 0}, {0, 1, 0}), plane({0, 0.8, 0}, {0, -1, 0})};
    solver.set_obstacles(surface_nodes(lattice), plates);
    const std::size_t n = solver.node_count();
    std::vector<double> u(3 * n, 0.0);
    const EquilibriumResult result = solver.follow(
        [](double fraction) {
            Loading loading;
            loading.obstacles = {at({0, 0, 0}), at({0, 0.8 - 0.16 * fraction, 0})};
            return loading;
        },
        VectorField<double>::aos(u.data(), n), to(1e-10));
    ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    const std::vector<ObstacleReading> readings = solver.obstacle_readings(VectorField<const double>::aos(u.data(), n));
    const double force = readings[0].force[1];
    EXPECT_NEAR(readings[1].force[1], -force, 1e-8 * force);
    EXPECT_EQ(readings[0].nodes, 49u);
    EXPECT_EQ(solver.effect_energies().at(0).name, "contact");
    EXPECT_NEAR(solver.effect_energies().at(0).stored, readings[0].energy + readings[1].energy, 1e-12);

    // The same block with its faces where the plates have them.
    EquilibriumSolver<double> held(lattice, kMaterial);
    Loading loading;
    double uneven = 0;
    for (std::uint32_t node = 0; node < n; ++node) {
        const double y = lattice.rest_position(node)[1], v = u[3 * node + 1];
        if (y == 0 || y > 0.799) {
            const bool corner = node == 0 || node == 6;
            loading.supports.push_back({node,
                                        static_cast<std::uint8_t>(2 | (node == 0 ? 5
                                                                       : corner  ? 4
                                                                                 : 0)),
                                        {0, v, 0}});
            uneven = std::max(uneven, std::abs(v - u[3 * (y == 0 ? 0 : n - 1) + 1]));
        }
    }
    EXPECT_LT(uneven, 1e-9); // all areas by their masses
    std::vector<double> w(3 * n, 0.0), forces(3 * n);
    ASSERT_EQ(held.solve(loading, VectorField<double>::aos(w.data(), n), to(1e-10)).status,
              EquilibriumStatus::converged);
    held.get_forces(VectorField<const double>::aos(w.data(), n), VectorField<double>::aos(forces.data(), n));
    double support = 0;
    for (std::uint32_t node = 0; node < n; ++node) {
        support -= lattice.rest_position(node)[1] == 0 ? forces[3 * node + 1] : 0;
    }
    EXPECT_NEAR(force, support, 1e-7 * support);
    EXPECT_GT(force, 0.15 * 1e5 * 0.36);
}

/// The same place by damped explicit steps, by backward Euler and by one solve: a block across a ball and a box.
TEST(StaticContact, steps_in_time_come_to_rest_at_the_same_equilibrium) {
    const Lattice lattice = Lattice::box(8, 3, 4, kCellSize);
    const std::array<Obstacle, 2> obstacles = {
        Obstacle{.shape = SphereShape{0.3}, .pose = at({0.15, -0.301, 0.2})},
        Obstacle{.shape = BoxShape{{0.2, 0.2, 0.6}}, .pose = at({0.75, -0.101, 0.2})}};
    Loading loading{.supports = {}, .forces = {}, .acceleration = {0, -10, 0}};
    for (std::uint32_t node = 0; node < lattice.nodes().size(); ++node) { // it may roll off otherwise
        if (lattice.rest_position(node)[1] > 0.299) {
            loading.supports.push_back({node, 5});
        }
    }
    const Solved s = solved(lattice, obstacles, loading, to(1e-9));
    ASSERT_EQ(s.result.status, EquilibriumStatus::converged) << s.result.message;
    const double weight = 0.8 * 0.3 * 0.4 * 1000 * 10;
    EXPECT_NEAR(s.readings[0].force[1] + s.readings[1].force[1], weight, 1e-6 * weight);
    EXPECT_GT(std::min(s.readings[0].force[1], s.readings[1].force[1]), 0.2 * weight);

    ExplicitDynamics<double> in_time(lattice, kMaterial);
    in_time.set_obstacles(surface_nodes(lattice), obstacles);
    in_time.prescribe(loading.supports);
    in_time.step({.time_step = 0.5 * in_time.critical_time_step(), .acceleration = {0, -10, 0}, .mass_damping = 12},
                 20000);
    const std::size_t n = in_time.node_count();
    std::vector<double> u(3 * n);
    in_time.get_displacements(VectorField<double>::aos(u.data(), n));
    EquilibriumSolver<double> implicit(lattice, kMaterial);
    implicit.set_obstacles(surface_nodes(lattice), obstacles);
    std::vector<double> w(3 * n, 0.0), v(3 * n, 0.0);
    for (int step = 0; step < 300; ++step) {
        const EquilibriumResult taken = implicit.step(loading, 0.02, 12, VectorField<double>::aos(w.data(), n),
                                                      VectorField<double>::aos(v.data(), n));
        ASSERT_EQ(taken.status, EquilibriumStatus::converged) << step << ": " << taken.message;
    }
    double lowest = 0;
    for (std::size_t i = 0; i < 3 * n; ++i) {
        EXPECT_NEAR(u[i], s.u[i], 1e-6) << i;
        EXPECT_NEAR(w[i], s.u[i], 1e-6) << i;
        lowest = std::min(lowest, s.u[i]);
    }
    EXPECT_LT(lowest, -0.005);
    EXPECT_NEAR(implicit.obstacle_readings(VectorField<const double>::aos(w.data(), n))[0].force[1],
                s.readings[0].force[1], 1e-4 * weight);
}

/// Coarse levels know what touches. (Where they do not, 16^3 cells take some 120 iterations in place of 40.)
TEST(StaticContact, multigrid_knows_what_touches) {
    long iterations[2] = {};
    for (const int size : {8, 16}) {
        const Lattice lattice = Lattice::box(size, size, size, 0.8 / size);
        const Obstacle ball = {.shape = SphereShape{1}, .pose = at({0.4, -1, 0.4})};
        const Obstacle lid = plane({0, 0.79, 0}, {0, -1, 0});
        Loading loading;
        for (std::uint32_t node = 0; node < lattice.nodes().size(); ++node) {
            if (lattice.rest_position(node)[1] > 0.799) {
                loading.supports.push_back({node, 5});
            }
        }
        const Solved s = solved(lattice, std::array{ball, lid}, loading, to(1e-6, PreconditionerKind::multigrid));
        ASSERT_EQ(s.result.status, EquilibriumStatus::converged) << s.result.message;
        EXPECT_GT(s.readings[0].force[1], 1);
        EXPECT_NEAR(s.readings[0].force[1], -s.readings[1].force[1], 1e-4 * s.readings[0].force[1]);
        iterations[size / 16] = s.result.cg_iterations;
    }
    EXPECT_LT(iterations[1], 75);
}

/// A ball pressed into a held block by a fifth of its height at once: what a step would press on is told the next one.
/// (Without that it takes 7 load steps.)
TEST(StaticContact, touches_are_foreseen) {
    const Lattice lattice = Lattice::box(12, 12, 12, 0.01);
    const Obstacle ball = {.shape = SphereShape{0.05}, .pose = at({0.06, 0.146, 0.06})};
    Loading loading{.supports = {}, .forces = {}, .acceleration = {0, -9.81, 0}};
    for (std::uint32_t node = 0; node < lattice.nodes().size(); ++node) {
        if (lattice.rest_position(node)[1] == 0) {
            loading.supports.push_back({node, 7});
        }
    }
    EquilibriumSolver<double> solver(lattice, {1e4, 0.45, 1000, 1});
    solver.set_obstacles(surface_nodes(lattice), std::array{ball});
    std::vector<double> u(3 * solver.node_count(), 0.0);
    const EquilibriumResult result =
        solver.solve(loading, VectorField<double>::aos(u.data(), solver.node_count()), to(1e-8));
    ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_EQ(result.load_steps, 1);
    EXPECT_LT(result.newton_iterations, 30);
    EXPECT_EQ(solver.obstacle_readings(VectorField<const double>::aos(u.data(), solver.node_count()))[0].nodes, 29u);
}

TEST(StaticContact, has_the_same_bits_with_any_number_of_threads) {
    const Lattice lattice = Lattice::box(12, 12, 12, kCellSize);
    const Obstacle ground = plane({0, 0, 0}, {0, 1, 0});
    const Loading loading{.supports = {{0, 5}, {12, 4}}, .forces = {}, .acceleration = {0, -10, 0}};
    const Solved one = solved(lattice, std::array{ground}, loading, {}, 1),
                 two = solved(lattice, std::array{ground}, loading, {}, 2);
    ASSERT_EQ(one.result.status, EquilibriumStatus::converged) << one.result.message;
    EXPECT_EQ(one.u, two.u);
}

TEST(StaticContact, what_has_no_potential_is_refused) {
    const Lattice lattice = Lattice::box(3, 3, 3, kCellSize);
    EquilibriumSolver<double> solver(lattice, kMaterial);
    Obstacle rough = plane({0, 0, 0}, {0, 1, 0});
    rough.friction = 0.5;
    const std::vector<SurfaceNode> surface = surface_nodes(lattice);
    expect_refusal([&] { solver.set_obstacles(surface, std::array{rough}); }, {"obstacle 0", "friction = 0.5"});
    rough.friction = 0;
    rough.shape = SphereShape{-1};
    expect_refusal([&] { solver.set_obstacles(surface, std::array{rough}); }, {"obstacle 0", "radius"});
    std::vector<SurfaceNode> twice = surface;
    twice.push_back(surface[3]);
    expect_refusal([&] { solver.set_obstacles(twice, std::array{plane({0, 0, 0}, {0, 1, 0})}); }, {"given twice"});
    Loading loading;
    loading.obstacles = {at({0, 0, 0})};
    std::vector<double> u(3 * solver.node_count(), 0.0);
    expect_refusal([&] { solver.solve(loading, VectorField<double>::aos(u.data(), solver.node_count())); },
                   {"1 poses", "no obstacles"});
}

} // namespace
} // namespace hybmss
