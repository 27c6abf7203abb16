/// Contact with rigid obstacles and Coulomb friction, against closed formulas and conservation laws.

#include "tests/dynamics/touching_body.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

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
class Contact : public ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Contact, Precisions);

TYPED_TEST(Contact, rest_depth_is_weight_over_stiffness) {
    const double stiffness = stiffness_of(0.01), gravity = 10;
    TouchingBody<TypeParam> body(Lattice::box(3, 2, 2, kEdge), {floor_at(0, 0, stiffness)});
    const StepParameters step{body.time_step, {0, -gravity, 0}, std::sqrt(stiffness)};
    body.dynamics.step(step, 1000);
    const ObstacleReading floor = body.dynamics.obstacle_readings().at(0);
    EXPECT_NEAR(floor.force[1], body.mass() * gravity, 1e-5 * body.mass() * gravity);
    EXPECT_NEAR(floor.force[0], 0, 1e-6 * floor.force[1]);
    EXPECT_EQ(floor.nodes, 12u);
    // The body itself gives way too, by a hundredth of what the floor does.
    EXPECT_NEAR(floor.depth, rest_depth(2, gravity, stiffness), 0.02 * rest_depth(2, gravity, stiffness));
    EXPECT_GE(floor.greatest_depth, floor.depth);
}

TYPED_TEST(Contact, sliding_block_stops_after_its_distance) {
    const double stiffness = stiffness_of(1), gravity = 10, friction = 0.3, speed = 5;
    TouchingBody<TypeParam> body(Lattice::box(4, 1, 2, kEdge),
                                 {floor_at(rest_depth(1, gravity, stiffness), friction, stiffness)});
    body.set_velocity({speed, 0, 0});
    const StepParameters step{body.time_step, {0, -gravity, 0}};
    const double distance = speed * speed / (2 * friction * gravity), time = speed / (friction * gravity);
    body.dynamics.step(step, std::lround(1.2 * time / body.time_step));
    EXPECT_NEAR(body.mean(body.displacements())[0], distance, 0.01 * distance);
    EXPECT_NEAR(body.mean(body.velocities())[0], 0, 0.02 * speed);
    const double energy = 0.5 * body.mass() * speed * speed;
    EXPECT_NEAR(body.dynamics.effect_energies().at(0).dissipated, energy, 0.01 * energy);
}

/// The loop of docs/motion.md: an engine's ball strikes a free body and gets in each frame what the body got of it.
TEST(ContactImpulse, keeps_the_momentum_of_a_body_and_an_engine) {
    const Vector start = {-0.3, 0, 0.2};
    RigidPose ball{.position = {4 * kEdge + 0.41, 0.3, 0.2}, .velocity = {-3, 0.4, 0}};
    TouchingBody<double> body(Lattice::box(4, 4, 4, kEdge),
                              {{.shape = SphereShape{0.4}, .pose = ball, .friction = 0.5}});
    body.set_velocity(start);
    const double ball_mass = 20;
    const long steps = 7;
    const auto momentum = [&] {
        Vector sum = body.mean(body.velocities());
        for (std::size_t a = 0; a < 3; ++a) {
            sum[a] = body.mass() * sum[a] + ball_mass * ball.velocity[a];
        }
        return sum;
    };
    const Vector before = momentum();
    Vector given = {0, 0, 0}, by_forces = {0, 0, 0};
    for (int frame = 0; frame < 100; ++frame) {
        body.dynamics.move_obstacles({&ball, 1});
        body.dynamics.step({body.time_step}, steps);
        const ObstacleReading reading = body.dynamics.obstacle_readings().at(0);
        const double length = static_cast<double>(steps) * body.time_step;
        for (std::size_t a = 0; a < 3; ++a) {
            ball.position[a] += length * ball.velocity[a];
            ball.velocity[a] -= (reading.impulse[a] - given[a]) / ball_mass;
            by_forces[a] += length * reading.force[a];
        }
        given = reading.impulse;
        const Vector now = momentum();
        for (std::size_t a = 0; a < 3; ++a) {
            ASSERT_NEAR(now[a], before[a], 1e-13 * ball_mass * 3) << frame;
        }
    }
    EXPECT_GT(given[0], -100);
    EXPECT_LT(given[0], -10); // it was struck
    EXPECT_GT(std::abs(given[1]), 0.1);
    EXPECT_GT(std::abs(by_forces[0] - given[0]), 0.01 * std::abs(given[0])); // a force is that of the last step alone
}

/// A node that touches two obstacles would be moved by the second one after the first has pushed it.
TYPED_TEST(Contact, impulses_are_the_forces_of_all_steps_and_dissipation_is_the_effects) {
    TouchingBody<TypeParam> body(
        Lattice::box(3, 2, 2, kEdge),
        {floor_at(0, 0.4), {.shape = SphereShape{0.3}, .pose = {.position = {0.63, 0.41, 0.1}}}});
    body.set_velocity({1, -1, 0});
    double impulse = 0, torque_impulse = 0;
    for (int step = 0; step < 60; ++step) {
        body.dynamics.step({body.time_step, {0, -10, 0}});
        const ObstacleReading floor = body.dynamics.obstacle_readings().at(0);
        impulse += body.time_step * floor.force[1];
        torque_impulse += body.time_step * floor.torque[0];
    }
    const std::vector<ObstacleReading> readings = body.dynamics.obstacle_readings();
    const double rounding = std::is_same_v<TypeParam, float> ? 1e-4 : 1e-11; // of the depth that forces are read at
    EXPECT_GT(impulse, 1);
    EXPECT_NEAR(readings[0].impulse[1], impulse, rounding * impulse);
    EXPECT_NEAR(readings[0].angular_impulse[0], torque_impulse, 1e-3 * std::abs(torque_impulse)); // arms of two moments
    const EffectEnergy effect = body.dynamics.effect_energies().at(0);
    EXPECT_NEAR(readings[0].energy + readings[1].energy, effect.stored, 1e-12 * effect.stored);
    EXPECT_NEAR(readings[0].dissipated + readings[1].dissipated, effect.dissipated, 1e-12 * effect.dissipated);
    EXPECT_GT(readings[0].dissipated, 0);
    EXPECT_LT(readings[1].impulse[0], -0.1);
}

/// On a plane inclined by the angle whose tangent is `slope`: gravity is turned instead.
StepParameters incline(double time_step, double slope, double damping) {
    const double cosine = 1 / std::sqrt(1 + slope * slope);
    return {time_step, {10 * slope * cosine, -10 * cosine, 0}, damping};
}

TYPED_TEST(Contact, sticks_below_the_friction_angle) {
    TouchingBody<TypeParam> body(Lattice::box(4, 1, 4, kEdge), {floor_at(0, 0.5)});
    // From touching, not from rest: the first bounces may slip, then it must hold.
    body.dynamics.step(incline(body.time_step, 0.45, 40), 1000);
    const double before = body.mean(body.displacements())[0];
    const double lost = body.dynamics.effect_energies().at(0).dissipated;
    body.dynamics.step(incline(body.time_step, 0.45, 40), 4000);
    EXPECT_NEAR(body.mean(body.displacements())[0], before, sizeof(TypeParam) == 4 ? 1e-6 : 1e-12);
    EXPECT_NEAR(body.dynamics.effect_energies().at(0).dissipated, lost,
                sizeof(TypeParam) == 4 ? 1e-5 * lost : 1e-9 * lost);
    EXPECT_NEAR(body.dynamics.obstacle_readings().at(0).force[0], -body.mass() * incline(1, 0.45, 0).acceleration[0],
                1e-4 * body.mass() * 10);
}

TYPED_TEST(Contact, slides_above_the_friction_angle) {
    const double slope = 0.8, friction = 0.5, stiffness = stiffness_of(1);
    const double cosine = 1 / std::sqrt(1 + slope * slope), acceleration = 10 * cosine * (slope - friction);
    TouchingBody<TypeParam> body(Lattice::box(6, 1, 2, kEdge),
                                 {floor_at(rest_depth(1, 10 * cosine, stiffness), friction, stiffness)});
    const long steps = 400;
    body.dynamics.step(incline(body.time_step, slope, 0), steps);
    const double time = body.time_step * static_cast<double>(steps);
    EXPECT_NEAR(body.mean(body.velocities())[0], acceleration * time, 0.02 * acceleration * time);
}

/// An impact takes the motion of the layer of nodes that touches: half of one of four cells.
TYPED_TEST(Contact, an_impact_books_its_energy_and_turns_momentum) {
    for (const double speed : {0.5, 10.0}) { // the material's wave speed is some 35 m/s
        TouchingBody<TypeParam> body(Lattice::box(3, 4, 3, kEdge), {floor_at(-0.01)});
        body.set_velocity({0, -speed, 0});
        const double energy = body.energy();
        double impulse = 0;
        const StepParameters step{0.2 * body.time_step};
        long steps = 0;
        do {
            impulse += step.time_step * body.dynamics.obstacle_readings().at(0).force[1];
            body.dynamics.step(step);
            ASSERT_LT(++steps, 20000);
        } while (!(body.mean(body.displacements())[1] > 0) || body.dynamics.obstacle_readings().at(0).nodes > 0);
        const Vector after = body.mean(body.velocities());
        EXPECT_NEAR(body.mass() * (after[1] + speed), impulse, 1e-4 * impulse);
        const double lost = body.dynamics.effect_energies().at(0).dissipated;
        EXPECT_NEAR(body.energy() + lost, energy, 0.01 * energy) << speed;
        EXPECT_GT(lost, 0);
        EXPECT_LT(lost, 0.14 * energy) << speed;
        EXPECT_GT(after[1], 0.5 * speed);
        EXPECT_LE(after[1], speed);
        EXPECT_EQ(body.dynamics.obstacle_readings().at(0).nodes, 0u);
        EXPECT_LT(body.dynamics.obstacle_readings().at(0).greatest_depth, kEdge);
    }
}

/// Half the wave speed crushes the body, but a plane is never passed.
TYPED_TEST(Contact, a_fast_body_never_passes_a_plane) {
    TouchingBody<TypeParam> body(Lattice::box(3, 6, 3, kEdge), {floor_at(-0.05)});
    body.set_velocity({0, -17, 0});
    for (int i = 0; i < 400; ++i) {
        body.dynamics.step({1.4 * body.time_step}, 5);
        ASSERT_GT(body.mean(body.displacements())[1] + 3 * kEdge, 0) << i;
    }
    EXPECT_LT(body.dynamics.obstacle_readings().at(0).greatest_depth, kEdge);
    EXPECT_GT(body.mean(body.velocities())[1], 0);
}

/// Many cells a step, through what is much thinner than that: the way is looked at, not only its end.
TYPED_TEST(Contact, nothing_passes_a_thin_obstacle_between_two_steps) {
    const auto below = [](ObstacleShape shape, const Vector& velocity) {
        return Obstacle{.shape = shape, .pose = {.position = {0.2, -2.03, 0.2}, .velocity = velocity}};
    };
    const double speed = 500; // five cells a step
    const BoxShape plate{{3, kEdge, 3}};
    const SphereShape ball{1.5 * kEdge};
    const CapsuleShape rod{{3, 0, 0}, kEdge};
    for (const bool body_flies : {true, false}) {
        for (const ObstacleShape& shape : {ObstacleShape(plate), ObstacleShape(ball), ObstacleShape(rod)}) {
            SCOPED_TRACE(std::to_string(shape.index()) + (body_flies ? " hit" : " hits"));
            TouchingBody<TypeParam> body(Lattice::box(3, 3, 3, kEdge), {below(shape, {0, body_flies ? 0 : speed, 0})});
            ASSERT_GT(speed * body.time_step, 3 * kEdge);
            if (body_flies) {
                body.set_velocity({0, -speed, 0});
            }
            const long steps = std::lround(2.5 / speed / body.time_step);
            body.dynamics.step({body.time_step}, steps);
            EXPECT_GT(body.dynamics.obstacle_readings().at(0).greatest_depth, 0);
            if (shape.index() == 2) { // the plate: no node of the surface has come out below
                const std::vector<TypeParam> u = body.displacements();
                const double middle = -2.03 + (body_flies ? 0 : speed * static_cast<double>(steps) * body.time_step);
                for (const SurfaceNode& n : surface_nodes(body.lattice)) {
                    ASSERT_GT(n.rest_position[1] + static_cast<double>(u[3 * n.node + 1]), middle) << n.node;
                }
            }
        }
    }
}

/// A body far from the floor gains speed far beyond its material's waves, and must not pass the floor unseen: it moves
/// as one whose state is set anew before every step, so that every step looks.
TYPED_TEST(Contact, a_body_that_gains_speed_on_its_way_is_seen) {
    using T = TypeParam;
    const Lattice shape = Lattice::box(3, 2, 3, kEdge);
    const double gap = 3;
    enum class Cause { gravity, load, led, jump };
    // Slow, in some 200 steps, and within 30.
    for (const auto& [cause, acceleration] : {std::pair{Cause::gravity, 2e3},
                                              {Cause::gravity, 1e5},
                                              {Cause::load, 2e3},
                                              {Cause::load, 1e5},
                                              {Cause::led, 2e3},
                                              {Cause::led, 1e5},
                                              {Cause::jump, 2e3}}) {
        SCOPED_TRACE(std::to_string(static_cast<int>(cause)) + " at " + std::to_string(acceleration));
        TouchingBody<T> body(shape, {floor_at(-gap)}), watched(shape, {floor_at(-gap)});
        StepParameters step{0.2 * body.time_step};
        if (cause == Cause::gravity) {
            step.acceleration = {0, -acceleration, 0};
        }
        int touched = 0; // steps; few, as such a fall crushes the body
        const double duration = 1.2 * std::sqrt(2 * gap / acceleration);
        for (long i = 1; touched < 4 && static_cast<double>(i) * step.time_step < duration; ++i) {
            const double time = static_cast<double>(i) * step.time_step;
            for (TouchingBody<T>* each : {&body, &watched}) {
                std::vector<NodalLoad> loads;
                std::vector<PrescribedNode> led;
                for (std::uint32_t n = 0; n < each->dynamics.node_count(); ++n) {
                    loads.push_back({n, {0, -acceleration * each->dynamics.masses()[n], 0}});
                    if (each->lattice.rest_position(n)[1] > 1.5 * kEdge) {
                        led.push_back({n, 7, {0, -0.5 * acceleration * time * time, 0}, {0, -acceleration * time, 0}});
                        if (cause == Cause::jump) {
                            led.back().displacement[1] = i < 18 ? 0 : -gap - 1.5 * kEdge;
                            led.back().velocity[1] = 0;
                        }
                    }
                }
                if (cause == Cause::load && i == 1) {
                    each->dynamics.load(loads);
                }
                if (cause == Cause::led || cause == Cause::jump) {
                    each->dynamics.prescribe(led);
                }
                if (each == &watched) {
                    const std::vector<T> v = each->velocities();
                    each->dynamics.set_velocities(VectorField<const T>::aos(v.data(), v.size() / 3));
                }
                each->dynamics.step(step);
            }
            ASSERT_EQ(body.displacements(), watched.displacements()) << i;
            touched += body.dynamics.obstacle_readings().at(0).nodes > 0;
        }
        EXPECT_EQ(touched, 4);
    }
}

/// A plate that moves up at V gives the energy V times its impulse.
TYPED_TEST(Contact, a_moving_plate_does_its_work) {
    const double speed = 2;
    Obstacle plate = {.shape = BoxShape{{3, 0.5, 3}},
                      .pose = {.position = {0.2, -0.26, 0.1}, .velocity = {0, speed, 0}}};
    TouchingBody<TypeParam> body(Lattice::box(3, 2, 3, kEdge), {plate});
    body.dynamics.step({0.2 * body.time_step}, 3000);
    EXPECT_EQ(body.dynamics.obstacle_readings().at(0).nodes, 0u);
    const double momentum = body.mass() * body.mean(body.velocities())[1];
    EXPECT_GT(momentum, 1.5 * body.mass() * speed);
    EXPECT_NEAR(body.energy() + body.dynamics.effect_energies().at(0).dissipated, speed * momentum,
                0.01 * speed * momentum);
}

/// An elastic cube slides as a rigid one, on every mesh, and stays where that would: its nodes must not flutter. It is
/// let settle first, for one that is let go unloaded sticks until the shear wave is back, and gains some speed by that.
TYPED_TEST(Contact, an_elastic_cube_slides_as_a_rigid_one) {
    const double friction = 0.5, sticking = std::tan(25 * M_PI / 180), sliding = std::tan(30 * M_PI / 180);
    for (const int cells : {4, 8}) {
        SCOPED_TRACE(cells);
        TouchingBody<TypeParam> body(Lattice::box(cells, cells, cells, 0.1 / cells), {floor_at(0, friction)});
        const double step = 1.4 * body.time_step; // a scene's own
        const auto go_on = [&](double slope, double damping, double seconds) {
            body.dynamics.step(incline(step, slope, damping), std::lround(seconds / step));
            return body.mean(body.displacements())[0];
        };
        go_on(sticking, 100, 0.1);
        const double settled = go_on(sticking, 0, 0.1), stuck = go_on(sticking, 0, 0.5);
        EXPECT_NEAR(stuck, settled, sizeof(TypeParam) == 4 ? 2e-6 : 1e-6);
        const double seconds = 1, acceleration = 10 * std::cos(std::atan(sliding)) * (sliding - friction);
        const double way = go_on(sliding, 0, seconds) - stuck, rigid = acceleration * seconds * seconds / 2;
        EXPECT_NEAR(way, rigid, 0.01 * rigid);
    }
}

// Friction begins with the first step in the obstacle.
TYPED_TEST(Contact, the_step_into_an_obstacle_drags_already) {
    const double stiffness = stiffness_of(0.01), friction = 0.5;
    for (const double sideways : {0.1, 10.0}) { // holds, and slips
        TouchingBody<TypeParam> body(Lattice::box(1, 1, 1, kEdge), {floor_at(-0.01, friction, stiffness)});
        const double step = 1e-4;
        body.set_velocity({sideways, -10, 0});
        ObstacleReading floor;
        while (floor.depth == 0) {
            body.dynamics.step({step});
            floor = body.dynamics.obstacle_readings().at(0);
        }
        const double pressed = 0.5 * body.mass() * stiffness * floor.depth;
        const double dragged = 0.5 * body.mass() * stiffness * sideways * step;
        EXPECT_NEAR(floor.force[1], pressed, 1e-4 * pressed);
        EXPECT_NEAR(-floor.force[0], std::min(dragged, friction * pressed), 1e-3 * pressed) << sideways;
    }
}

} // namespace
} // namespace hybmss
