/// Rigid obstacles with mass, which bodies and gravity move: what they and the bodies have together is kept, and they
/// come to rest.

#include "dynamics/contact/obstacle_geometry.hpp"
#include "hybmss/equilibrium.hpp"
#include "hybmss/skin.hpp"
#include "hybmss/world.hpp"
#include "tests/dynamics/touching_body.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

using testing::kEdge;
using testing::TouchingBody;
using testing::Vector;

template <class T>
class FreeObstacles : public ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(FreeObstacles, Precisions);

const double kNode = 1000 * kEdge * kEdge * kEdge / 2; ///< kg, in the middle of a face

/// Along with their bodies' own they are kept.
struct Momenta {
    Point linear = {0, 0, 0}, angular = {0, 0, 0};

    template <class T>
    void add(const TouchingBody<T>& body) {
        const std::vector<T> u = body.displacements(), v = body.velocities();
        for (std::size_t n = 0; n < u.size() / 3; ++n) {
            Point x = body.lattice.rest_position(body.lattice.nodes()[n]), w;
            for (std::size_t a = 0; a < 3; ++a) {
                x[a] += static_cast<double>(u[3 * n + a]);
                w[a] = static_cast<double>(v[3 * n + a]);
            }
            add(body.dynamics.masses()[n], x, w);
        }
    }
    void add(double mass, const Point& x, const Point& w) {
        linear = plus(linear, mass, w);
        angular = plus(angular, mass, cross(x, w));
    }
    void add_rigid(double mass, const Point& inertia, const RigidPose& pose) {
        add(mass, pose.position, pose.velocity);
        Point own = from_space(pose.rotation, pose.angular_velocity);
        for (std::size_t a = 0; a < 3; ++a) {
            own[a] *= inertia[a];
        }
        angular = plus(angular, 1, to_space(pose.rotation, own));
    }
};

/// Beside the cube of 4^3 cells, on its way to it and turning.
std::vector<Obstacle> thrown(double mass) {
    const RigidPose pose = {
        .position = {4 * kEdge + 0.41, 0.3, 0.2}, .velocity = {-3, 0.4, 0}, .angular_velocity = {5, 1, 2}};
    std::vector<Obstacle> all;
    all.push_back({.shape = SphereShape{0.4}, .pose = pose, .friction = 0.5, .mass = mass});
    all.push_back({.shape = BoxShape{{0.8, 0.3, 0.5}}, .pose = pose, .friction = 0.5, .mass = mass});
    all.push_back({.shape = CapsuleShape{{0, 0.5, 0}, 0.3}, .pose = pose, .friction = 0.5, .mass = mass});
    std::vector<Point> corners;
    for (int c = 0; c < 8; ++c) {
        corners.push_back({(c & 1 ? 0.4 : -0.4), (c & 2 ? 0.15 : -0.15), (c & 4 ? 0.25 : -0.25)});
    }
    all.push_back({.shape = HullShape(corners), .pose = pose, .friction = 0.5, .mass = mass});
    const std::array<std::array<std::uint32_t, 3>, 12> faces = {{{0, 2, 1},
                                                                 {1, 2, 3},
                                                                 {4, 5, 6},
                                                                 {5, 7, 6},
                                                                 {0, 1, 4},
                                                                 {1, 5, 4},
                                                                 {2, 6, 3},
                                                                 {3, 6, 7},
                                                                 {0, 4, 2},
                                                                 {2, 4, 6},
                                                                 {1, 3, 5},
                                                                 {3, 7, 5}}};
    all.push_back({.shape = MeshShape(corners, faces, 16), .pose = pose, .friction = 0.5, .mass = mass});
    return all;
}

/// kg m^2 of those of thrown().
Point inertia_of_thrown(std::size_t which, double mass) {
    if (which == 0) {
        const double all = 0.4 * mass * 0.16;
        return {all, all, all};
    }
    if (which == 2) { // a rod and two half balls
        const double rod = mass * 0.5 / (0.5 + 0.4), ball = mass - rod;
        const double across = rod * (0.25 / 12 + 0.09 / 4) + ball * (0.4 * 0.09 + 0.25 / 4 + 3 * 0.5 * 0.3 / 8);
        return {across, rod * 0.09 / 2 + ball * 0.4 * 0.09, across};
    }
    return {mass / 12 * (0.09 + 0.25), mass / 12 * (0.64 + 0.25), mass / 12 * (0.64 + 0.09)};
}

/// Of body and obstacle to rounding, by both integrators, however many steps a call takes.
TYPED_TEST(FreeObstacles, keep_momentum_and_angular_momentum) {
    const double rounding = sizeof(TypeParam) == 4 ? 2e-5 : 1e-11;
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        for (const double mass : {20.0, 0.1 * kNode}) {
            const std::vector<Obstacle> all = thrown(mass);
            for (std::size_t o = 0; o < all.size(); ++o) {
                SCOPED_TRACE(std::to_string(o) + " of " + std::to_string(mass) + " kg");
                TouchingBody<TypeParam> body(Lattice::box(4, 4, 4, kEdge), {all[o]});
                body.set_velocity({-0.3, 0, 0.2});
                const auto momenta = [&] {
                    Momenta sum;
                    sum.add(body);
                    sum.add_rigid(mass, inertia_of_thrown(o, mass), body.dynamics.obstacle_poses().at(0));
                    return sum;
                };
                const Momenta before = momenta();
                for (const long count : {1L, 7L, 200L, 300L}) {
                    body.dynamics.step({.time_step = body.time_step, .integrator = integrator}, count);
                }
                const Momenta now = momenta();
                EXPECT_GT(length(body.dynamics.obstacle_readings().at(0).impulse), 0.01 * mass);
                EXPECT_LT(length(plus(now.linear, -1, before.linear)), rounding * length(before.linear));
                EXPECT_LT(length(plus(now.angular, -1, before.angular)), rounding * 20);
            }
        }
    }
}

/// Exactly the parabola by leapfrog, the sum of steps by symplectic Euler; the spin stays, about no principal axis too.
TYPED_TEST(FreeObstacles, that_touch_nothing_fall_and_turn_freely) {
    Obstacle box = thrown(3)[1];
    box.pose.position = {0, 50, 0};
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        TouchingBody<TypeParam> body(Lattice::box(2, 2, 2, kEdge), {box}), alone(Lattice::box(2, 2, 2, kEdge), {});
        const StepParameters step{.time_step = body.time_step, .acceleration = {1, -10, 0}, .integrator = integrator};
        Momenta before, after;
        before.add_rigid(3, inertia_of_thrown(1, 3), {.angular_velocity = box.pose.angular_velocity});
        body.dynamics.step(step, 300);
        alone.dynamics.step(step, 300);
        const double t = 300 * body.time_step, extra = integrator == Integrator::leapfrog ? 0 : body.time_step;
        const RigidPose now = body.dynamics.obstacle_poses().at(0);
        for (std::size_t a = 0; a < 3; ++a) {
            const double g = step.acceleration[a], v = box.pose.velocity[a];
            EXPECT_NEAR(now.velocity[a], v + g * t, 1e-11);
            EXPECT_NEAR(now.position[a], box.pose.position[a] + v * t + g * t * (t + extra) / 2, 1e-11);
        }
        after.add_rigid(3, inertia_of_thrown(1, 3),
                        {.rotation = now.rotation, .angular_velocity = now.angular_velocity});
        EXPECT_LT(length(plus(after.angular, -1, before.angular)), 1e-12);
        EXPECT_NE(now.angular_velocity, box.pose.angular_velocity);
        EXPECT_EQ(body.displacements(), alone.displacements()); // what touches nothing changes no bit
    }
}

/// A box that turns about no principal axis keeps its energy to the second order of the step.
TEST(FreeObstacle, turns_to_the_second_order) {
    double before = 0;
    for (const int halving : {1, 2, 4}) {
        Obstacle box = thrown(3)[1];
        box.pose.position = {0, 50, 0};
        box.pose.angular_velocity = {50, 10, 20};
        TouchingBody<double> body(Lattice::box(1, 1, 1, kEdge), {box});
        const auto kinetic = [&] { return body.dynamics.obstacle_readings().at(0).kinetic; };
        const double start = kinetic();
        body.dynamics.step({.time_step = 1e-3 / halving}, 100L * halving);
        const double error = std::abs(kinetic() / start - 1);
        if (halving > 1) {
            EXPECT_GT(before / error, 3.5) << error;
        }
        before = error;
    }
}

template <class T>
std::vector<PrescribedNode> held_below(const TouchingBody<T>& body) {
    std::vector<PrescribedNode> held;
    for (std::uint32_t n = 0; n < body.dynamics.node_count(); ++n) {
        if (body.lattice.rest_position(body.lattice.nodes()[n])[1] == 0) {
            held.push_back({n, 7, {}, {}});
        }
    }
    return held;
}

/// On a block held below, from a tenth of a node's mass to a hundred: at rest, borne by its weight, not rolling.
TYPED_TEST(FreeObstacles, come_to_rest_on_a_block_and_bear_their_weight) {
    const double middle = 2.5 * kEdge; // between four nodes
    for (const double friction : {0.0, 0.5}) {
        for (const double part : {0.1, 1.0, 100.0}) {
            SCOPED_TRACE(part);
            Obstacle ball{.shape = SphereShape{0.3}, .pose = {.position = {middle, 4 * kEdge + 0.3005, middle}}};
            ball.friction = friction;
            ball.mass = part * kNode;
            TouchingBody<TypeParam> body(Lattice::box(5, 4, 5, kEdge), {ball});
            body.dynamics.prescribe(held_below(body));
            const StepParameters step{body.time_step, {0, -10, 0}, 20};
            body.dynamics.step(step, 12000);
            const RigidPose was = body.dynamics.obstacle_poses().at(0);
            body.dynamics.step(step, 100);
            const RigidPose now = body.dynamics.obstacle_poses().at(0);
            const double small = sizeof(TypeParam) == 4 ? 1e-4 : 1e-6;
            EXPECT_LT(length(now.velocity), small);
            EXPECT_LT(length(now.angular_velocity) * 0.3, small);
            EXPECT_LT(length(plus(now.position, -1, was.position)), 0.01 * small);
            EXPECT_NEAR(now.position[0], middle, 1e-4); // as symmetric as it began
            const ObstacleReading reading = body.dynamics.obstacle_readings().at(0);
            EXPECT_GT(reading.nodes, 0u);
            EXPECT_NEAR(reading.force[1], -10 * ball.mass, 1e-3 * 10 * ball.mass);
        }
    }
}

/// A rod that slides on a held block along itself, in a row of pits, is slowed by friction, and sticks in the end.
TEST(FreeObstacle, is_slowed_by_friction) {
    const double radius = 0.5, side = kEdge / 2, up = std::sqrt(radius * radius - side * side), cosine = up / radius;
    Obstacle rod{.shape = CapsuleShape{{0.5, 0, 0}, radius}, .pose = {.position = {0.5, 2 * kEdge + up, 3.5 * kEdge}}};
    rod.friction = 0.3;
    rod.mass = 5;
    TouchingBody<double> body(Lattice::box(16, 2, 7, kEdge), {rod});
    std::vector<PrescribedNode> held;
    for (std::uint32_t n = 0; n < body.dynamics.node_count(); ++n) {
        held.push_back({n, 7, {}, {}});
    }
    body.dynamics.prescribe(held);
    const StepParameters step{body.time_step, {0, -10, 0}};
    body.dynamics.step(step, 3000); // it lies
    const double weight = 50, x = body.dynamics.obstacle_poses().at(0).position[0];
    EXPECT_NEAR(body.dynamics.obstacle_readings().at(0).force[1], -weight, 1e-3 * weight);
    EXPECT_NEAR(x, 0.5, 1e-6);
    const StepParameters tilted{body.time_step, {5, -10, 0}}; // steeper than the friction angle
    const long steps = static_cast<long>(0.2 / body.time_step);
    body.dynamics.step(tilted, steps);
    const double before = body.dynamics.obstacle_poses().at(0).velocity[0];
    body.dynamics.step(tilted, steps);
    const double gain = body.dynamics.obstacle_poses().at(0).velocity[0] - before;
    EXPECT_NEAR(gain / (static_cast<double>(steps) * body.time_step), 5 - 3 / cosine, 0.2);
    body.dynamics.step(step, 8000);
    EXPECT_LT(length(body.dynamics.obstacle_poses().at(0).velocity), 1e-6);
}

/// Everything that is read of a motion, to compare.
template <class T>
std::vector<double> steps_with(const Obstacle& obstacle, int threads, long calls, long count) {
    PlanOptions options;
    options.threads = threads;
    TouchingBody<T> body(Lattice::box(8, 8, 8, kEdge), {obstacle}, options);
    body.set_velocity({0.6, 0, 0.2});
    for (long c = 0; c < calls; ++c) {
        body.dynamics.step({body.time_step, {0, -10, 0}, 1}, count);
    }
    EXPECT_GT(body.dynamics.obstacle_readings().at(0).greatest_depth, 1e-5);
    const std::vector<T> u = body.displacements();
    std::vector<double> all(u.begin(), u.end());
    const RigidPose pose = body.dynamics.obstacle_poses().at(0);
    all.insert(all.end(), pose.rotation.begin(), pose.rotation.end());
    for (const Point* part : {&pose.position, &pose.velocity, &pose.angular_velocity}) {
        all.insert(all.end(), part->begin(), part->end());
    }
    return all;
}

TYPED_TEST(FreeObstacles, have_the_same_bits_for_any_number_of_threads_and_calls) {
    for (Obstacle obstacle : thrown(2)) {
        obstacle.pose.position[0] += 4 * kEdge;
        const std::vector<double> one = steps_with<TypeParam>(obstacle, 1, 1, 240);
        EXPECT_EQ(one, steps_with<TypeParam>(obstacle, 2, 1, 240));
        EXPECT_EQ(one, steps_with<TypeParam>(obstacle, 8, 1, 240));
        EXPECT_EQ(one, steps_with<TypeParam>(obstacle, 1, 240, 1));
        EXPECT_EQ(one, steps_with<TypeParam>(obstacle, 2, 40, 6));
    }
}

/// One that is far heavier moves a body as one that is led does; those that are led do not notice others.
TYPED_TEST(FreeObstacles, that_are_heavy_move_bodies_as_those_that_are_led) {
    const Obstacle led = {.shape = SphereShape{0.4},
                          .pose = {.position = {4 * kEdge + 0.41, 0.3, 0.2}, .velocity = {-3, 0.4, 0}},
                          .friction = 0.5};
    Obstacle heavy = led, far = thrown(1)[1];
    heavy.mass = 1e15;
    far.pose.position = {0, 99, 0};
    far.pose.velocity = {0, 0, 0};
    TouchingBody<TypeParam> one(Lattice::box(4, 4, 4, kEdge), {led}), other(Lattice::box(4, 4, 4, kEdge), {heavy}),
        both(Lattice::box(4, 4, 4, kEdge), {far, led});
    for (auto* body : {&one, &other, &both}) {
        body->dynamics.step({body->time_step}, 200);
    }
    EXPECT_EQ(one.displacements(), both.displacements());
    const std::vector<TypeParam> u = one.displacements(), v = other.displacements();
    double most = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        most = std::max(most, std::abs(static_cast<double>(u[i] - v[i])));
    }
    EXPECT_LT(most, sizeof(TypeParam) == 4 ? 1e-5 : 1e-8);
}

/// What a checkpoint keeps: where it is, how it moves, what friction goes by.
TYPED_TEST(FreeObstacles, go_on_from_memory_with_the_same_bits) {
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        for (const Obstacle& obstacle : thrown(2)) {
            TouchingBody<TypeParam> whole(Lattice::box(4, 4, 4, kEdge), {obstacle}),
                first(Lattice::box(4, 4, 4, kEdge), {obstacle}), rest(Lattice::box(4, 4, 4, kEdge), {obstacle});
            const StepParameters step{
                .time_step = whole.time_step, .acceleration = {0, -3, 0}, .integrator = integrator};
            whole.dynamics.step(step, 200);
            first.dynamics.step(step, 120);
            rest.dynamics.set_exact_state(first.dynamics.exact_state());
            rest.dynamics.set_effect_memory(first.dynamics.effect_memory());
            rest.dynamics.step(step, 80);
            EXPECT_EQ(rest.displacements(), whole.displacements());
            EXPECT_EQ(rest.dynamics.obstacle_poses()[0].rotation, whole.dynamics.obstacle_poses()[0].rotation);
            EXPECT_EQ(rest.dynamics.obstacle_poses()[0].position, whole.dynamics.obstacle_poses()[0].position);
            EXPECT_EQ(rest.dynamics.obstacle_readings()[0].work_of_gravity,
                      whole.dynamics.obstacle_readings()[0].work_of_gravity);
        }
    }
}

/// What a blow takes from the ball goes to the body and to what contact dissipates.
TEST(FreeObstacle, loses_what_the_body_and_contact_take) {
    for (const double friction : {0.0, 0.5}) {
        Obstacle ball = thrown(20)[0];
        ball.friction = friction;
        TouchingBody<double> body(Lattice::box(4, 4, 4, kEdge), {ball});
        body.time_step *= 0.1; // the body's own energy swings by a part of a step
        const auto all = [&] {
            const ObstacleReading reading = body.dynamics.obstacle_readings().at(0);
            return body.energy() + reading.kinetic - reading.work_of_gravity;
        };
        const double before = all();
        body.dynamics.step({.time_step = body.time_step, .acceleration = {0, 0, 0}}, 4000);
        double dissipated = 0;
        for (const EffectEnergy& effect : body.dynamics.effect_energies()) {
            dissipated += effect.dissipated;
        }
        EXPECT_GT(length(body.dynamics.obstacle_readings().at(0).impulse), 10);
        EXPECT_GT(dissipated, 0);
        EXPECT_NEAR(all() + dissipated, before, 2e-3 * before);
    }
}

/// Two cubes and a ball between them: one motion, all momentum.
TEST(FreeObstacle, of_a_world_is_one_for_all_its_bodies) {
    const Lattice cube = Lattice::box(4, 4, 4, kEdge);
    Obstacle ball{.shape = SphereShape{0.3}, .pose = {.position = {0.85, 0.25, 0.2}, .velocity = {3, 0.5, 0}}};
    ball.friction = 0.4;
    ball.mass = 30;
    std::vector<std::vector<double>> seen;
    for (const int threads : {1, 2, 8}) {
        World<double> world(threads);
        for (const double x : {0.0, 1.2}) {
            ExplicitDynamics<double> body(cube, testing::kMaterial);
            body.set_obstacles(surface_nodes(cube, {x, 0, 0}), std::array{ball});
            world.add(std::move(body), cube, {x, 0, 0});
        }
        world.set_shared_obstacles(std::array{SharedObstacle{0, 0, 7}, SharedObstacle{1, 0, 7}});
        const double dt = 0.4 * world.critical_time_step();
        world.step({.time_step = dt}, 1000);
        for (int i = 0; i < 1000; ++i) {
            world.step({.time_step = dt});
        }
        Momenta sum;
        std::vector<double> all;
        for (const std::size_t b : {0u, 1u}) {
            const ExplicitDynamics<double>& body = world.body(b);
            EXPECT_GT(length(body.obstacle_readings().at(0).impulse), 1);
            std::vector<double> u(3 * body.node_count()), v(u.size());
            body.get_displacements(VectorField<double>::aos(u.data(), body.node_count()));
            body.get_velocities(VectorField<double>::aos(v.data(), body.node_count()));
            for (std::size_t n = 0; n < body.node_count(); ++n) {
                Point x = cube.rest_position(cube.nodes()[n]);
                x[0] += b == 0 ? 0 : 1.2;
                sum.add(body.masses()[n], {x[0] + u[3 * n], x[1] + u[3 * n + 1], x[2] + u[3 * n + 2]},
                        {v[3 * n], v[3 * n + 1], v[3 * n + 2]});
            }
            all.insert(all.end(), u.begin(), u.end());
        }
        const RigidPose pose = world.body(0).obstacle_poses().at(0);
        EXPECT_EQ(pose.position, world.body(1).obstacle_poses().at(0).position);
        EXPECT_EQ(pose.angular_velocity, world.body(1).obstacle_poses().at(0).angular_velocity);
        const double inertia = 0.4 * 30 * 0.09;
        sum.add_rigid(30, {inertia, inertia, inertia}, pose);
        EXPECT_LT(length(plus(sum.linear, -1, {90, 15, 0})), 1e-10);
        EXPECT_LT(length(plus(sum.angular, -1, cross(ball.pose.position, {90, 15, 0}))), 1e-9);
        all.insert(all.end(), pose.position.begin(), pose.position.end());
        seen.push_back(all);
        EXPECT_EQ(seen[0], seen.back());
    }
}

/// A body of a world whose obstacle nobody shares moves it as alone, to the bit.
TEST(FreeObstacle, of_one_body_in_a_world_moves_as_alone) {
    const Obstacle ball = thrown(2)[0];
    TouchingBody<double> alone(Lattice::box(4, 4, 4, kEdge), {ball}), lent(Lattice::box(4, 4, 4, kEdge), {ball}),
        shared(Lattice::box(4, 4, 4, kEdge), {ball});
    alone.dynamics.step({alone.time_step}, 300);
    for (TouchingBody<double>* body : {&lent, &shared}) {
        World<double> world(1);
        world.add(&body->dynamics, body->lattice);
        if (body == &shared) { // with itself alone: the same steps, by the world
            world.set_shared_obstacles(std::array{SharedObstacle{0, 0, 0}});
        }
        world.step({alone.time_step}, 200);
        body->dynamics.step({alone.time_step}, 100); // its owner may do so
        EXPECT_EQ(alone.displacements(), body->displacements());
        EXPECT_EQ(alone.dynamics.obstacle_poses()[0].position, body->dynamics.obstacle_poses()[0].position);
    }
}

TEST(FreeObstacle, is_refused_in_one_line) {
    const Lattice cube = Lattice::box(2, 2, 2, kEdge);
    ExplicitDynamics<double> body(cube, testing::kMaterial);
    const auto refusal = [&](const Obstacle& obstacle) {
        return testing::refusal([&] { body.set_obstacles(surface_nodes(cube), std::array{obstacle}); });
    };
    EXPECT_NE(refusal({.shape = PlaneShape{}, .mass = 1}).find("a plane and a height field have no end"),
              std::string::npos);
    EXPECT_NE(refusal({.shape = SphereShape{}, .mass = -1}).find("mass = -1"), std::string::npos);
    EXPECT_NE(refusal({.shape = SphereShape{}, .mass = 1, .inertia = {1, 0, 1}}).find("inertia = 0"),
              std::string::npos);
    EXPECT_NE(refusal({.shape = CapsuleShape{{1, 1, 0}, 0.1}, .mass = 1}).find("along one of the obstacle's axes"),
              std::string::npos);
    const std::vector<Point> corner = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    EXPECT_NE(refusal({.shape = HullShape(corner), .mass = 1}).find("centre of mass is at (0.25, 0.25, 0.25)"),
              std::string::npos);
    std::vector<Point> turned_box;
    for (int c = 0; c < 8; ++c) {
        turned_box.push_back(to_space(turned({1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.5}),
                                      {c & 1 ? 0.4 : -0.4, c & 2 ? 0.1 : -0.1, c & 4 ? 0.2 : -0.2}));
    }
    EXPECT_NE(refusal({.shape = HullShape(turned_box), .mass = 1}).find("not the principal ones"), std::string::npos);
    EXPECT_EQ(refusal({.shape = HullShape(corner), .mass = 1, .inertia = {1, 1, 1}}), "");
    const Obstacle ball = {.shape = SphereShape{0.2}, .pose = {.position = {0, 9, 0}}, .mass = 1};
    EXPECT_NE(testing::refusal([&] {
                  body.set_skin_obstacles(skin_points(cube, smooth_boundary_mesh(cube)), std::array{ball});
              }).find("a skin touches obstacles that are led"),
              std::string::npos);
    EXPECT_NE(testing::refusal([&] {
                  EquilibriumSolver<double> solver(cube, testing::kMaterial);
                  solver.set_obstacles(surface_nodes(cube), std::array{ball});
              }).find("free obstacles move in explicit steps alone"),
              std::string::npos);

    World<double> world(1);
    body.set_obstacles(surface_nodes(cube), std::array{ball});
    world.add(std::move(body), cube);
    ExplicitDynamics<double> other(cube, testing::kMaterial);
    Obstacle heavier = ball;
    heavier.mass = 2;
    other.set_obstacles(surface_nodes(cube), std::array{heavier, ball});
    world.add(std::move(other), cube, {1, 0, 0});
    const auto shared = [&](std::vector<SharedObstacle> all) {
        return testing::refusal([&] { world.set_shared_obstacles(all); });
    };
    EXPECT_NE(shared({{0, 1, 0}, {1, 0, 0}}).find("obstacle 1 of body 0 is not there or not free"), std::string::npos);
    EXPECT_NE(shared({{0, 0, 0}, {1, 0, 0}}).find("the same shape, mass and inertia"), std::string::npos);
    EXPECT_NE(shared({{0, 0, 0}, {0, 0, 1}}).find("named twice"), std::string::npos);
    EXPECT_EQ(shared({{0, 0, 0}, {1, 1, 0}}), "");
    EXPECT_NE(testing::refusal([&] {
                  world.step({.time_step = 1e-5, .integrator = Integrator::leapfrog});
              }).find("not by leapfrog"),
              std::string::npos);
    world.body(1).set_obstacles(surface_nodes(cube), std::array{ball});
    EXPECT_NE(testing::refusal([&] { world.step({.time_step = 1e-5}); }).find("obstacle 1 of body 1 is not there"),
              std::string::npos);
}

} // namespace
} // namespace hybmss
