/// Shapes of obstacles, layouts, threads, cuts and input of contact.

#include "dynamics/contact/obstacle_geometry.hpp"
#include "tests/dynamics/touching_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

namespace hybmss {
namespace {

using testing::floor_at;
using testing::kEdge;
using testing::kMaterial;
using testing::rest_depth;
using testing::stiffness_of;
using testing::TouchingBody;
using testing::Vector;

template <class T>
class ContactBodies : public ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(ContactBodies, Precisions);

TYPED_TEST(ContactBodies, every_shape_pushes_out) {
    const Lattice cell = Lattice::box(1, 1, 1, kEdge);
    const auto at = [](ObstacleShape shape, Vector position) {
        return Obstacle{.shape = shape, .pose = {.position = position}, .friction = 0.4};
    };
    const double h = kEdge;
    const std::vector<Obstacle> obstacles = {
        at(SphereShape{h / 2}, {0, 0, 0}),              // a node at its centre
        at(SphereShape{h}, {h / 2, -0.6 * h, h / 2}),   //
        at(BoxShape{{h, h, h}}, {0, 0, 0}),             // a node at its centre
        at(BoxShape{{h, h, h}}, {h / 2, h / 2, h / 2}), // all nodes on corners
        at(BoxShape{{2 * h, 2 * h, 2 * h}}, {0, 0, 0}), // nodes on edges, faces and a corner
        at(PlaneShape{{1, 1, 1}}, {h, h, h}),
        at(CapsuleShape{{3 * h, 0, 0}, h / 2}, {0, 0, 0}),        // two nodes on its axis
        at(CapsuleShape{{0, h, h}, h}, {h / 2, -0.9 * h, h / 2}), //
    };
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
        TouchingBody<TypeParam> body(cell, {obstacles[o]});
        const double start = body.energy();
        body.dynamics.step({0.2 * body.time_step}, 3000);
        for (const TypeParam value : body.displacements()) {
            ASSERT_TRUE(std::isfinite(value)) << o;
        }
        const bool on_the_surface = o == 3;
        EXPECT_EQ(start == 0, on_the_surface) << o;
        EXPECT_EQ(body.dynamics.obstacle_readings().at(0).nodes, 0u) << o;
        EXPECT_LT(body.energy(), 1.02 * start + 1e-12) << o;
    }
}

/// A turned box is a turned world.
TEST(ContactShapes, a_turned_box_pushes_as_a_turned_body_feels_it) {
    const Obstacle straight = {.shape = BoxShape{{1, 2, 3}}, .pose = {.position = {0.05, -0.97, 0}}};
    Obstacle turned = straight; // by a quarter about z: a box of 2 x 1 x 3 along the axes
    turned.shape = BoxShape{{2, 1, 3}};
    turned.pose.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    TouchingBody<double> a(Lattice::box(2, 2, 2, kEdge), {straight}), b(Lattice::box(2, 2, 2, kEdge), {turned});
    EXPECT_GT(a.dynamics.obstacle_readings().at(0).force[1], 0);
    a.dynamics.step({a.time_step}, 20);
    b.dynamics.step({b.time_step}, 20);
    const std::vector<double> u = a.displacements(), w = b.displacements();
    for (std::size_t i = 0; i < u.size(); ++i) {
        EXPECT_NEAR(u[i], w[i], 1e-14);
    }
}

/// Against the least distance from many points of the axis, its gradient, and the first step inside along a way.
TEST(ContactShapes, a_capsule_is_all_within_a_radius_of_its_axis) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> in(-1, 1);
    const auto point = [&](double size) { return Vector{size * in(random), size * in(random), size * in(random)}; };
    int entered = 0, at_an_end = 0;
    for (int i = 0; i < 2000; ++i) {
        const CapsuleShape capsule = {i % 50 == 0 ? Vector{0, 0, 0} : point(1.5), 0.2 + 0.3 * std::abs(in(random))};
        const Vector y = point(1.5);
        const auto along = [&](double part) { return length(plus(y, -part, capsule.axis)); };
        double least = std::numeric_limits<double>::infinity(), where = 0;
        for (int s = -500; s <= 500; ++s) {
            if (const double d = along(s / 1000.0); d < least) {
                least = d;
                where = s / 1000.0;
            }
        }
        at_an_end += std::abs(where) == 0.5;
        const SurfaceDistance surface = surface_at(capsule, y);
        EXPECT_EQ(surface.distance, distance_to(capsule, y));
        EXPECT_NEAR(surface.distance, least - capsule.radius, 1e-5);
        EXPECT_LE(surface.distance, least - capsule.radius + 1e-12);
        EXPECT_NEAR(length(surface.normal), 1, 1e-14);
        for (std::size_t a = 0; a < 3; ++a) {
            Vector more = y, less = y;
            more[a] += 1e-5;
            less[a] -= 1e-5;
            EXPECT_NEAR(surface.normal[a], (distance_to(capsule, more) - distance_to(capsule, less)) / 2e-5, 1e-5);
        }
        const Vector way = point(3);
        if (surface.distance < 0) {
            continue;
        }
        double first = 2;
        for (int s = 0; s <= 1000 && first > 1; ++s) {
            first = distance_to(capsule, plus(y, s / 1000.0, way)) < 0 ? s / 1000.0 : first;
        }
        const std::optional<Entry> found = entry(capsule, y, way);
        if (first <= 1) {
            ++entered;
            ASSERT_TRUE(found) << i;
            EXPECT_LE(found->part, first);
        }
        if (found) { // it may leave again before the next of the points above
            const Vector place = plus(y, found->part, way);
            EXPECT_NEAR(distance_to(capsule, place), 0, 1e-12);
            EXPECT_NEAR(length(plus(found->normal, -1, surface_at(capsule, place).normal)), 0, 1e-11);
            EXPECT_LT(dot(found->normal, way), 0);
            if (first <= 1) {
                EXPECT_GT(found->part, first - 0.0011);
            }
        }
    }
    EXPECT_GT(entered, 100);
    EXPECT_GT(at_an_end, 300);
    for (const Vector axis : {Vector{0, 1, 0}, Vector{2, 0, 0}, Vector{0, 0, 0}, Vector{1, -1, 1}}) {
        const SurfaceDistance middle = surface_at(CapsuleShape{axis, 0.5}, {0, 0, 0});
        EXPECT_EQ(middle.distance, -0.5);
        EXPECT_NEAR(length(middle.normal), 1, 1e-15);
        EXPECT_NEAR(dot(middle.normal, axis), 0, 1e-15);
    }
}

TEST(ContactShapes, a_capsule_without_length_is_a_ball_and_its_axis_turns_with_its_pose) {
    const auto moved = [](const Obstacle& obstacle) {
        TouchingBody<double> body(Lattice::box(3, 3, 3, kEdge), {obstacle});
        body.set_velocity({0.2, -2, 0.1});
        body.dynamics.step({body.time_step, {0, -10, 0}}, 300);
        EXPECT_LT(body.dynamics.obstacle_readings().at(0).impulse[1] * -1, 0);
        return body.displacements();
    };
    const auto expect_near = [](const std::vector<double>& a, const std::vector<double>& b) {
        for (std::size_t i = 0; i < a.size(); ++i) {
            ASSERT_NEAR(a[i], b[i], 1e-12) << i;
        }
    };
    Obstacle ball = {.shape = SphereShape{0.3}, .pose = {.position = {0.2, -0.29, 0.1}}, .friction = 0.4};
    Obstacle rod = ball;
    rod.shape = CapsuleShape{{0, 0, 0}, 0.3};
    expect_near(moved(rod), moved(ball));
    rod.shape = CapsuleShape{{0.3, 0, 0.4}, 0.3};
    Obstacle turned = rod; // by a quarter about z
    turned.shape = CapsuleShape{{0, -0.3, 0.4}, 0.3};
    turned.pose.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    const std::vector<double> straight = moved(rod);
    expect_near(moved(turned), straight);
    EXPECT_GT(std::abs(straight[0] - moved(ball)[0]), 1e-3);
}

/// A bar lies across two rollers: each bears half of its weight. They turn, and carry it along as fast as they go
/// round.
TYPED_TEST(ContactBodies, rollers_bear_a_bar_and_carry_it_along) {
    const double radius = 0.25, turns = 2, gravity = 10, friction = 0.5;
    std::vector<Obstacle> rollers;
    for (const double x : {0.5 * kEdge, 7.5 * kEdge}) {
        rollers.push_back({.shape = CapsuleShape{{0, 0, 2}, radius},
                           .pose = {.position = {x, -radius, kEdge / 2}},
                           .friction = friction});
    }
    TouchingBody<TypeParam> body(Lattice::box(8, 1, 1, kEdge), rollers);
    const StepParameters step{body.time_step, {0, -gravity, 0}, 0};
    body.dynamics.step({body.time_step, {0, -gravity, 0}, 60}, 4000);
    const double weight = body.mass() * gravity;
    const std::vector<ObstacleReading> rest = body.dynamics.obstacle_readings();
    EXPECT_NEAR(rest[0].force[1], weight / 2, 1e-3 * weight);
    EXPECT_NEAR(rest[1].force[1], weight / 2, 1e-3 * weight);
    std::vector<RigidPose> poses = {rollers[0].pose, rollers[1].pose};
    for (RigidPose& pose : poses) {
        pose.angular_velocity = {0, 0, -turns};
    }
    body.dynamics.move_obstacles(poses);
    const double speed = turns * radius, slip = speed / (friction * gravity);
    body.dynamics.step(step, std::lround(2 * slip / step.time_step));
    EXPECT_NEAR(body.mean(body.velocities())[0], speed, 0.1 * speed);
    double impulse = 0;
    for (const ObstacleReading& reading : body.dynamics.obstacle_readings()) {
        impulse += reading.impulse[0];
    }
    EXPECT_NEAR(impulse, body.mass() * body.mean(body.velocities())[0], 1e-4 * body.mass() * speed);
}

/// A ball on a turning plate is carried along: its centre goes round with the plate's surface.
TEST(ContactShapes, a_turning_plate_carries_what_sticks) {
    Obstacle plate = floor_at(0, 2);
    plate.pose.position = {0, rest_depth(1, 10, stiffness_of(1)), 0};
    plate.pose.angular_velocity = {0, 0.5, 0};
    TouchingBody<double> body(Lattice::box(2, 1, 2, kEdge), {plate});
    const StepParameters step{body.time_step, {0, -10, 0}, 0};
    // Already turning with it.
    std::vector<double> v;
    for (const SurfaceNode& node : surface_nodes(body.lattice)) {
        v.insert(v.end(), {0.5 * node.rest_position[2], 0, -0.5 * node.rest_position[0]});
    }
    ASSERT_EQ(v.size(), 3 * body.dynamics.node_count());
    body.dynamics.set_velocities(VectorField<const double>::aos(v.data(), body.dynamics.node_count()));
    const long steps = std::lround(1 / body.time_step);
    body.dynamics.step(step, steps);
    const double angle = 0.5 * body.time_step * static_cast<double>(steps);
    const Vector u = body.mean(body.displacements());
    const double c = kEdge; // the centre's x and z at rest
    EXPECT_NEAR(c + u[0], c * (std::cos(angle) + std::sin(angle)), 0.01 * c);
    EXPECT_NEAR(c + u[2], c * (std::cos(angle) - std::sin(angle)), 0.01 * c);
}

std::vector<Obstacle> a_mixed_scene() {
    return {
        floor_at(-0.01, 0.5),
        {.shape = SphereShape{0.6}, .pose = {.position = {0.4, 2.7, 0.9}, .velocity = {0, -3, 0.1}}, .friction = 0.2},
        {.shape = BoxShape{{1, 1, 1}},
         .pose = {.position = {2.6, 1, 1}, .velocity = {-1, 0, 0}, .angular_velocity = {0.3, 0.2, 1}},
         .friction = 0.3}};
}
const StepParameters kFall{0, {0, -10, 0}, 0.1};

template <class T>
std::uint64_t bits(const TouchingBody<T>& body) {
    std::uint64_t hash = testing::bits_of(body.displacements());
    hash = testing::bits_of(body.velocities(), Digest(hash));
    const EffectEnergy contact = body.dynamics.effect_energies().at(0);
    std::vector<double> told = {contact.stored, contact.dissipated};
    for (const ObstacleReading& reading : body.dynamics.obstacle_readings()) {
        told.insert(told.end(), reading.impulse.begin(), reading.impulse.end());
        told.insert(told.end(), reading.angular_impulse.begin(), reading.angular_impulse.end());
    }
    return testing::bits_of(told, Digest(hash));
}

TYPED_TEST(ContactBodies, threads_calls_and_restarts_do_not_change_a_bit) {
    const Lattice lattice = Lattice::box(16, 16, 16, kEdge);
    StepParameters step = kFall;
    const auto make = [&](int threads) {
        PlanOptions options;
        options.threads = threads;
        TouchingBody<TypeParam> body(lattice, a_mixed_scene(), options);
        step.time_step = body.time_step;
        return body;
    };
    TouchingBody<TypeParam> one = make(1), four = make(4), parts = make(4);
    one.dynamics.step(step, 200);
    four.dynamics.step(step, 200);
    EXPECT_GT(one.dynamics.effect_energies().at(0).dissipated, 0);
    for (const ObstacleReading& reading : one.dynamics.obstacle_readings()) {
        EXPECT_GT(reading.greatest_depth, 0);
    }
    EXPECT_EQ(bits(one), bits(four));
    // Setting the state makes every node be looked at: no block may have waited too long.
    for (int i = 0; i < 100; ++i) {
        parts.dynamics.step(step);
        const std::vector<TypeParam> v = parts.velocities();
        parts.dynamics.set_velocities(VectorField<const TypeParam>::aos(v.data(), v.size() / 3));
    }
    TouchingBody<TypeParam> restarted = make(1);
    const std::vector<TypeParam> u = parts.displacements(), v = parts.velocities();
    restarted.dynamics.set_displacements(VectorField<const TypeParam>::aos(u.data(), u.size() / 3));
    restarted.dynamics.set_velocities(VectorField<const TypeParam>::aos(v.data(), v.size() / 3));
    restarted.dynamics.set_effect_memory(parts.dynamics.effect_memory());
    restarted.dynamics.step(step, 100);
    EXPECT_EQ(bits(one), bits(restarted));
}

/// Every layout and the network give the same motion.
TEST(ContactLayouts, all_bounce_alike) {
    const Lattice lattice = Lattice::box(3, 3, 3, kEdge);
    std::vector<Obstacle> obstacles = {
        floor_at(-0.01, 0.5), {.shape = SphereShape{0.2}, .pose = {.position = {0.5, -0.1, 0.2}}, .friction = 0.3}};
    for (Obstacle& obstacle : obstacles) {
        obstacle.stiffness = stiffness_of(1);
        obstacle.friction_delay = 0.02;
    }
    TouchingBody<double> first(lattice, obstacles);
    const StepParameters step{first.time_step, {1, -10, 0}};
    first.dynamics.step(step, 150);
    const std::vector<double> expected = first.displacements();
    const auto expect_same = [&](const std::vector<double>& u, const std::string& layout) {
        for (std::size_t i = 0; i < u.size(); ++i) {
            ASSERT_NEAR(u[i], expected[i], 1e-9) << layout;
        }
    };
    for (const std::string& layout : lattice_layouts()) {
        TouchingBody<double> body(lattice, obstacles, {.layout = layout});
        body.dynamics.step(step, 150);
        expect_same(body.displacements(), layout);
    }
    const Network network = Network::from_lattice(lattice, kMaterial);
    ExplicitDynamics<double> body(network);
    body.set_obstacles(surface_nodes(network), obstacles);
    body.step(step, 150);
    std::vector<double> u(3 * body.node_count());
    body.get_displacements(VectorField<double>::aos(u.data(), body.node_count()));
    expect_same(u, "network");
}

// What a cut lays bare touches as the surface of a body built without the cells; what has lost all cells does not.
TEST(ContactLayouts, a_cut_body_touches_with_its_new_surface) {
    for (const char* layout : {"flat-rows", "active-rows"}) {
        PlanOptions options;
        options.layout = layout;
        // Deep in a floor, so that the middle touches too.
        TouchingBody<double> body(Lattice::box(4, 4, 4, kEdge), {floor_at(0.3, 0.5)}, options);
        const std::vector<std::uint32_t> grid_nodes = body.lattice.nodes();
        for (const std::vector<std::uint32_t>& bite :
             {std::vector<std::uint32_t>{5, 21, 20, 22}, {0, 1, 2, 3, 16, 17, 18, 19, 32, 33}}) {
            EXPECT_EQ(body.dynamics.remove_cells(body.lattice, bite), bite.size());
        }
        TouchingBody<double> anew(body.lattice, {floor_at(0.3, 0.5)}, options);
        const auto forces = [](const TouchingBody<double>& of) {
            std::vector<double> f(3 * of.dynamics.node_count());
            of.dynamics.get_effect_forces(VectorField<double>::aos(f.data(), of.dynamics.node_count()));
            return f;
        };
        const std::vector<double> cut = forces(body), expected = forces(anew);
        const std::vector<std::uint32_t> left = body.lattice.nodes();
        std::size_t next = 0;
        for (std::size_t n = 0; n < grid_nodes.size(); ++n) {
            const bool is_left = next < left.size() && left[next] == grid_nodes[n];
            for (std::size_t a = 0; a < 3; ++a) {
                EXPECT_EQ(cut[3 * n + a], is_left ? expected[3 * next + a] : 0) << layout << ", node " << n;
            }
            next += is_left;
        }
        EXPECT_EQ(next, left.size());
        const ObstacleReading reading = body.dynamics.obstacle_readings().at(0),
                              wanted = anew.dynamics.obstacle_readings().at(0);
        EXPECT_EQ(reading.nodes, wanted.nodes);
        EXPECT_GT(wanted.nodes, 40u);
        body.dynamics.step({body.time_step}, 20);
        EXPECT_TRUE(std::isfinite(body.energy()));
    }
}

/// What is held in an obstacle is pressed by it, does not give way, and nothing is lost.
TEST(ContactHeld, held_nodes_are_pressed_and_stay) {
    const double depth = 0.01, stiffness = stiffness_of(1);
    TouchingBody<double> body(Lattice::box(2, 2, 2, kEdge), {floor_at(depth, 0.5, stiffness)});
    std::vector<PrescribedNode> held;
    double mass = 0;
    for (const SurfaceNode& node : surface_nodes(body.lattice)) {
        if (node.rest_position[1] == 0) {
            held.push_back({node.node, 7, {0, 0, 0}, {0, 0, 0}});
            mass += body.dynamics.masses()[node.node];
        }
    }
    ASSERT_EQ(held.size(), 9u);
    body.dynamics.prescribe(held);
    body.dynamics.step({body.time_step, {3, -10, 0}, 20}, 2000);
    EXPECT_NEAR(body.dynamics.obstacle_readings().at(0).force[1], mass * stiffness * depth, 1e-9);
    EXPECT_EQ(body.dynamics.obstacle_readings().at(0).force[0], 0);
    EXPECT_NEAR(body.dynamics.effect_energies().at(0).dissipated, 0, 1e-12);
    // One axis alone: the other two are free, and friction holds those.
    for (PrescribedNode& node : held) {
        node.axes = 2;
    }
    body.dynamics.prescribe(held);
    body.dynamics.step({body.time_step, {3, -10, 0}, 20}, 2000);
    EXPECT_NEAR(body.dynamics.obstacle_readings().at(0).force[0], -3 * body.mass(), 1e-3 * body.mass());
}

/// A block of nodes is not looked at in every step; one that is led wakes it.
TEST(ContactHeld, a_plate_that_jumps_is_seen_at_once) {
    TouchingBody<double> body(Lattice::box(1, 1, 1, kEdge), {floor_at(-0.2 * kEdge, 0, stiffness_of(1))});
    std::vector<PrescribedNode> held;
    for (std::uint32_t node = 0; node < 8; ++node) {
        held.push_back({node, 7, {0, 0, 0}, {0, 0, 0}});
    }
    body.dynamics.prescribe(held);
    StepMotion jump;
    jump.nodes = [&](long step) {
        for (PrescribedNode& node : held) {
            node.displacement[1] = step == 5 ? -0.5 * kEdge : 0;
        }
        return std::span<const PrescribedNode>(held);
    };
    body.dynamics.step({0.01 * body.dynamics.critical_time_step()}, 8, jump);
    EXPECT_NEAR(body.dynamics.obstacle_readings().at(0).greatest_depth, 0.3 * kEdge, 1e-12);
}

TEST(ContactInput, surface_nodes_are_those_outside) {
    EXPECT_EQ(surface_nodes(Lattice::box(3, 3, 3, 1.0)).size(), 64u - 8u);
    Lattice hollow = Lattice::box(3, 3, 3, 1.0);
    hollow.set_cell_scale(1, 1, 1, 0);
    EXPECT_EQ(surface_nodes(hollow, {1, 2, 3}).size(), 64u);
    EXPECT_EQ(surface_nodes(hollow, {1, 2, 3}).front().rest_position, (Vector{1, 2, 3}));
    EXPECT_EQ(surface_nodes(Network::from_lattice(hollow, kMaterial)).size(), 64u);
}

TEST(ContactInput, costs_nothing_without_obstacles_and_leaves_the_step_as_it_is) {
    const Lattice lattice = Lattice::box(4, 4, 4, kEdge);
    ExplicitDynamics<double> body(lattice, kMaterial);
    const std::size_t bytes = body.describe().bytes;
    const double own = body.critical_time_step();
    body.set_obstacles(surface_nodes(lattice), std::vector{floor_at(0, 0.5), floor_at(1, 0, 300 / (own * own))});
    EXPECT_GT(body.describe().bytes, bytes);
    EXPECT_EQ(body.critical_time_step(), own);
    body.set_obstacles({}, {});
    EXPECT_EQ(body.describe().bytes, bytes);
    EXPECT_EQ(body.critical_time_step(), own);
    EXPECT_TRUE(body.effect_energies().empty());
}

TEST(ContactInput, bad_ones_are_refused) {
    ExplicitDynamics<float> body(Lattice::box(1, 1, 1, 1.0), kMaterial);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<SurfaceNode> surface = surface_nodes(Lattice::box(1, 1, 1, 1.0));
    const auto refuse = [&](const Obstacle& obstacle) {
        EXPECT_THROW(body.set_obstacles(surface, std::array{obstacle}), std::invalid_argument);
    };
    refuse({.shape = PlaneShape{{0, 0, 0}}});
    refuse({.shape = PlaneShape{{0, nan, 0}}});
    refuse({.shape = SphereShape{0}});
    refuse({.shape = BoxShape{{1, -1, 1}}});
    refuse({.shape = CapsuleShape{.radius = -1}});
    refuse({.shape = CapsuleShape{.axis = {0, nan, 0}}});
    refuse({.shape = PlaneShape{}, .friction = -0.1});
    refuse({.shape = PlaneShape{}, .stiffness = nan});
    refuse({.shape = PlaneShape{}, .friction_delay = -1});
    refuse({.shape = PlaneShape{}, .pose = {.position = {nan, 0, 0}}});
    refuse({.shape = PlaneShape{}, .pose = {.rotation = {2, 0, 0, 0, 1, 0, 0, 0, 1}}});
    refuse({.shape = PlaneShape{}, .pose = {.rotation = {1, 0, 2e-5, 0, 1, 0, 0, 0, 1}}});
    const std::array one = {Obstacle{}};
    EXPECT_THROW(body.set_obstacles(std::array{SurfaceNode{.node = 8}}, one), std::invalid_argument);
    EXPECT_THROW(body.set_obstacles(std::array{SurfaceNode{}, SurfaceNode{}}, one), std::invalid_argument);
    EXPECT_THROW(body.move_obstacles(std::array{RigidPose{}}), std::invalid_argument);
    body.set_obstacles(surface, one);
    EXPECT_THROW(body.move_obstacles({}), std::invalid_argument);
    EXPECT_THROW(body.set_effect_memory({}), std::invalid_argument);
}

/// An engine in float turns a quaternion into a matrix: its rows are orthonormal to some 1e-7.
TEST(ContactInput, rotations_of_engines_in_float_are_the_rotations_nearby) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    const std::vector<SurfaceNode> surface = surface_nodes(Lattice::box(1, 1, 1, 1.0));
    for (int i = 0; i < 100; ++i) {
        float q[4];
        float square = 0;
        for (float& component : q) {
            component = normal(random);
            square += component * component;
        }
        for (float& component : q) {
            component /= std::sqrt(square);
        }
        const auto [w, x, y, z] = q;
        const float matrix[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                                 2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                                 2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
        Obstacle box{.shape = BoxShape{}};
        std::copy_n(matrix, 9, box.pose.rotation.begin());
        ExplicitDynamics<float> body(Lattice::box(1, 1, 1, 1.0), kMaterial);
        EXPECT_NO_THROW(body.set_obstacles(surface, std::array{box})) << i;
        EXPECT_NO_THROW(body.move_obstacles(std::array{box.pose})) << i;
    }
}

} // namespace
} // namespace hybmss
