/// The ramp of moved nodes: rigid, smooth, and with velocities and accelerations that are its derivatives.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/run/boundary_conditions.hpp"
#include "tests/program.hpp"

#include <cmath>
#include <numbers>

namespace hybmss {
namespace {

Move turn(int axis, double degrees, double over) {
    Move move;
    move.motion = Rotation{axis, degrees};
    move.over = over;
    return move;
}

TEST(Ramp, starts_and_ends_at_rest) {
    for (double t : {-1.0, 0.0, 2.0, 5.0}) {
        const Ramp s = ramp(t, 2);
        EXPECT_EQ(s.value, t < 1 ? 0.0 : 1.0);
        EXPECT_EQ(s.rate, 0.0);
        EXPECT_EQ(s.acceleration, 0.0);
    }
    EXPECT_EQ(ramp(0, 0).value, 1.0);
    EXPECT_DOUBLE_EQ(ramp(1, 2).value, 0.5);
}

TEST(Motion, velocity_and_acceleration_are_derivatives) {
    const Vector3 rest = {0.3, -1.2, 2.0}, center = {1, 0.5, -0.5};
    Move translation;
    translation.motion = Vector3{1, -2, 0.5};
    translation.over = 3;
    const double dt = 1e-4;
    for (const Move& move : {translation, turn(0, 70, 3), turn(1, -200, 3), turn(2, 30, 3)}) {
        for (double t : {0.2, 1.1, 2.7}) {
            const Kinematics k = moved(move, rest, center, t);
            const Kinematics before = moved(move, rest, center, t - dt), after = moved(move, rest, center, t + dt);
            for (std::size_t a = 0; a < 3; ++a) {
                // Central differences err by dt^2 / 6 times the third derivative, here below 200.
                EXPECT_NEAR(k.velocity[a], (after.displacement[a] - before.displacement[a]) / (2 * dt), 1e-6);
                EXPECT_NEAR(k.acceleration[a], (after.velocity[a] - before.velocity[a]) / (2 * dt), 1e-6);
            }
        }
    }
}

TEST(Motion, rotation_is_right_handed_and_keeps_distances) {
    const Vector3 center = {1, 2, 3};
    // A quarter turn about y leads +z to +x.
    const Kinematics k = moved(turn(1, 90, 1), {1, 7, 4}, center, 1);
    EXPECT_NEAR(k.displacement[0], 1, 1e-15);
    EXPECT_NEAR(k.displacement[1], 0, 1e-15);
    EXPECT_NEAR(k.displacement[2], -1, 1e-15);

    const Vector3 p = {0.2, 0.7, -1}, q = {3, -2, 5};
    for (int axis : {0, 1, 2}) {
        const Vector3 u = moved(turn(axis, 123, 2), p, center, 0.8).displacement;
        const Vector3 v = moved(turn(axis, 123, 2), q, center, 0.8).displacement;
        double rest = 0, now = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            rest += (p[a] - q[a]) * (p[a] - q[a]);
            now += (p[a] + u[a] - q[a] - v[a]) * (p[a] + u[a] - q[a] - v[a]);
        }
        EXPECT_NEAR(now, rest, 1e-14 * rest);
    }
}

TEST(Motion, tiny_rotation_keeps_all_digits) {
    const double degrees = 1e-9, angle = degrees * std::numbers::pi / 180;
    const Kinematics k = moved(turn(2, degrees, 0), {1, 0, 0}, {0, 0, 0}, 0);
    EXPECT_NEAR(k.displacement[1], angle, 1e-15 * angle);
    EXPECT_NEAR(k.displacement[0], -angle * angle / 2, 1e-15 * angle * angle);
}

/// A body whose every node is led moves as a rigid body: no elastic energy at any time, and it arrives.
TEST(Motion, whole_body_moves_rigidly) {
    for (const char* motion : {"translate = [3, -2, 1]", "rotate = {axis = \"x\", degrees = 75}"}) {
        std::string text = test::small_scene("where = \"y-max\"", "where = {box = [[0, 0, 0], [9, 9, 9]]}");
        text.replace(text.find("[[fix]]\nwhere = \"y-min\"\n"), 24, "\n\n");
        text.replace(text.find("translate = [0, -0.1, 0]"), 24, motion);
        Simulation simulation(parse_scene(text, "rigid.toml"));
        while (simulation.time() < 1.5) {
            simulation.step();
            const Energies energies = simulation.energies();
            // Rounding of displacements of a few metres: (1e-15)^2 of the stiffness, with room.
            EXPECT_LT(std::abs(energies.springs) + std::abs(energies.volume), 1e-20 * 1e4) << motion;
        }
        EXPECT_LT(std::abs(simulation.volume_change().relative_volume_change), 1e-14);
        EXPECT_GT(simulation.probes().at(0).max_displacement, 1);
        EXPECT_EQ(simulation.energies().kinetic, 0.0);
    }
}

} // namespace
} // namespace hybmss
