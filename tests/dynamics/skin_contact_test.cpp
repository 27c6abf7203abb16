#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/skin.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace hybmss {
namespace {

using Vector3 = std::array<double, 3>;

/// A ball of cells, and a finer one of points about the same middle, between the nodes and partly beside the cells.
struct Ball {
    static constexpr double kCell = 0.02, kRadius = 0.1;
    Lattice lattice;
    TriangleMesh mesh;

    Ball() : lattice(cells()) {
        constexpr std::uint32_t kRings = 24, kAround = 40;
        for (std::uint32_t r = 0; r <= kRings; ++r) {
            for (std::uint32_t a = 0; a < kAround; ++a) {
                const double polar = M_PI * r / kRings, around = 2 * M_PI * a / kAround;
                mesh.vertices.push_back({0.12 + kRadius * std::sin(polar) * std::cos(around),
                                         0.12 + kRadius * std::sin(polar) * std::sin(around),
                                         0.12 - kRadius * std::cos(polar)});
                if (r > 0) {
                    const std::uint32_t here = r * kAround + a, next = r * kAround + (a + 1) % kAround;
                    mesh.triangles.push_back({here - kAround, next - kAround, here});
                    mesh.triangles.push_back({next - kAround, next, here});
                }
            }
        }
    }
    static Lattice cells() {
        std::vector<float> scales;
        for (int n = 0; n < 12 * 12 * 12; ++n) {
            const Vector3 x = {(n % 12 - 5.5) * kCell, (n / 12 % 12 - 5.5) * kCell, (n / 144 - 5.5) * kCell};
            scales.push_back(std::hypot(x[0], x[1], x[2]) < kRadius ? 1.0f : 0.0f);
        }
        return Lattice::from_cells(12, 12, 12, kCell, scales);
    }
};

const Material kSoft = {.young_modulus = 2e4, .poisson_ratio = 0.3, .density = 1000};

template <class T>
std::vector<T> values(const ExplicitDynamics<T>& body, void (ExplicitDynamics<T>::*get)(VectorField<T>) const) {
    std::vector<T> out(3 * body.node_count());
    (body.*get)(VectorField<T>::aos(out.data(), body.node_count()));
    return out;
}

/// Of weights times nodes.
Vector3 place(const SkinPoint& point, const std::vector<double>& u) {
    Vector3 x = point.rest_position;
    for (std::size_t c = 0; c < 8; ++c) {
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] += point.weights[c] * u[3 * point.nodes[c] + a];
        }
    }
    return x;
}

TEST(SkinContact, PointsLieOnTheSkinAndFollowAffineMotions) {
    const Ball ball;
    const std::vector<SkinPoint> points = skin_points(ball.lattice, ball.mesh, {1, 2, 3});
    const std::vector<std::uint32_t> nodes = ball.lattice.nodes();
    ASSERT_GT(points.size(), 800u);
    double farthest = 0;
    for (const SkinPoint& point : points) {
        const Vector3 x = {point.rest_position[0] - 1, point.rest_position[1] - 2, point.rest_position[2] - 3};
        farthest = std::max(farthest, std::hypot(x[0] - 0.12, x[1] - 0.12, x[2] - 0.12));
        Vector3 moved = {0, 0, 0};
        double sum = 0;
        for (std::size_t c = 0; c < 8; ++c) {
            const Vector3 node = ball.lattice.rest_position(nodes[point.nodes[c]]);
            sum += point.weights[c];
            for (std::size_t a = 0; a < 3; ++a) {
                moved[a] += point.weights[c] * node[a];
            }
        }
        EXPECT_NEAR(sum, 1, 1e-14);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(moved[a], x[a], 1e-14);
        }
    }
    EXPECT_NEAR(farthest, 0.1, 1e-12);
    // A box of twelve triangles: points a cell apart at most.
    const Lattice box = Lattice::box(4, 4, 4, 0.1);
    TriangleMesh large{{{0, 0, 0}, {0.4, 0, 0}, {0.4, 0.4, 0}}, {{0, 2, 1}}};
    EXPECT_GT(skin_points(box, large).size(), 14u);
    large.triangles[0][0] = 5;
    testing::expect_refusal([&] { skin_points(box, large); }, {"triangle"});
}

TEST(SkinContact, TouchesAtTheLowestPointAndNotBefore) {
    const Ball ball;
    const std::vector<SkinPoint> points = skin_points(ball.lattice, ball.mesh);
    for (const double above : {1e-6, -1e-6}) { // of the plane below the lowest point
        ExplicitDynamics<double> body(ball.lattice, kSoft);
        body.set_skin_obstacles(points, std::array{Obstacle{PlaneShape{{0, 0, 1}}, {{0, 0, 0.02 - above}}}});
        body.step({.time_step = 0.5 * body.critical_time_step()}, 1);
        const ObstacleReading reading = body.obstacle_readings().at(0);
        EXPECT_EQ(reading.nodes, above > 0 ? 0u : 1u);
        EXPECT_EQ(reading.force[2] > 0, above < 0);
        EXPECT_LT(reading.depth, 1e-6);
    }
}

TEST(SkinContact, CarriesTheWeightWhereTheSkinIs) {
    const Ball ball;
    const std::vector<SkinPoint> points = skin_points(ball.lattice, ball.mesh);
    ExplicitDynamics<double> body(ball.lattice, kSoft);
    body.set_skin_obstacles(
        points, std::array{Obstacle{.shape = PlaneShape{{0, 0, 1}}, .pose = {{0.1, 0.1, 0.02}}, .friction = 0.5}});
    const StepParameters step{
        .time_step = 0.8 * body.critical_time_step(), .acceleration = {0, 0, -3}, .mass_damping = 8};
    body.step(step, 3000);
    const double weight = 3 * std::accumulate(body.masses().begin(), body.masses().end(), 0.0);
    const ObstacleReading reading = body.obstacle_readings().at(0);
    EXPECT_NEAR(reading.force[2], weight, 1e-3 * weight);
    EXPECT_NEAR(reading.force[0], 0, 1e-3 * weight);
    // Forces on the nodes are the same, and their torque.
    const std::vector<double> forces = values(body, &ExplicitDynamics<double>::get_contact_forces);
    Vector3 sum = {0, 0, 0};
    for (std::size_t n = 0; n < forces.size(); ++n) {
        sum[n % 3] += forces[n];
    }
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(sum[a], reading.force[a], 1e-11 * weight);
    }
    const std::vector<double> u = values(body, &ExplicitDynamics<double>::get_displacements);
    const std::vector<std::uint32_t> nodes = ball.lattice.nodes();
    Vector3 torque = {0, 0, 0};
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        Vector3 x = ball.lattice.rest_position(nodes[n]);
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] += u[3 * n + a] - std::array{0.1, 0.1, 0.02}[a];
        }
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
            torque[a] += x[b] * forces[3 * n + c] - x[c] * forces[3 * n + b];
        }
    }
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(torque[a], reading.torque[a], 1e-11 * weight);
    }
    EXPECT_GT(std::abs(torque[0]), 0.01 * weight);
    // No point of the skin is far below the plane; nodes are, by the half of a cell that the skin lies inside them.
    double lowest = 1;
    for (const SkinPoint& point : points) {
        lowest = std::min(lowest, place(point, u)[2]);
    }
    EXPECT_GT(lowest, 0.02 - 0.05 * Ball::kCell);
    EXPECT_NEAR(reading.depth, 0.02 - lowest, 1e-12);
}

TEST(SkinContact, GivesTheBodyTheMomentumOfItsImpulses) {
    const Ball ball;
    ExplicitDynamics<double> body(ball.lattice, kSoft);
    std::vector<double> v(3 * body.node_count());
    for (std::size_t n = 0; n < body.node_count(); ++n) {
        v[3 * n] = 0.5;
        v[3 * n + 2] = -1;
    }
    body.set_velocities(VectorField<const double>::aos(v.data(), body.node_count()));
    body.set_skin_obstacles(skin_points(ball.lattice, ball.mesh),
                            std::array{Obstacle{PlaneShape{{0, 0, 1}}, {{0, 0, 0.019}}, 0.3},
                                       Obstacle{SphereShape{0.05}, {{0.25, 0.12, 0.1}}}});
    body.step({.time_step = 0.7 * body.critical_time_step()}, 300);
    const auto momentum = [&] {
        Vector3 p = {0, 0, 0};
        const std::vector<double> now = values(body, &ExplicitDynamics<double>::get_velocities);
        for (std::size_t n = 0; n < now.size(); ++n) {
            p[n % 3] += body.masses()[n / 3] * now[n];
        }
        return p;
    };
    const double mass = std::accumulate(body.masses().begin(), body.masses().end(), 0.0);
    Vector3 gained = {0, 0, 0};
    for (const ObstacleReading& reading : body.obstacle_readings()) {
        EXPECT_GT(std::hypot(reading.impulse[0], reading.impulse[2]), 0.01 * mass);
        EXPECT_GT(reading.dissipated, 0);
        for (std::size_t a = 0; a < 3; ++a) {
            gained[a] += reading.impulse[a];
        }
    }
    const Vector3 now = momentum();
    EXPECT_NEAR(now[0], 0.5 * mass + gained[0], 1e-11 * mass);
    EXPECT_NEAR(now[1], gained[1], 1e-11 * mass);
    EXPECT_NEAR(now[2], -mass + gained[2], 1e-11 * mass);
}

TEST(SkinContact, KeepsAccountOfEnergy) {
    const Ball ball;
    ExplicitDynamics<double> body(ball.lattice, kSoft);
    std::vector<double> v(3 * body.node_count());
    for (std::size_t n = 0; n < body.node_count(); ++n) {
        v[3 * n + 1] = 0.3;
        v[3 * n + 2] = -1;
    }
    body.set_velocities(VectorField<const double>::aos(v.data(), body.node_count()));
    body.set_skin_obstacles(skin_points(ball.lattice, ball.mesh),
                            std::array{Obstacle{PlaneShape{{0, 0, 1}}, {{0, 0, 0.015}}, 0.3}});
    const auto total = [&] {
        double sum = body.potential_energy().total() + body.kinetic_energy();
        for (const EffectEnergy& effect : body.effect_energies()) {
            sum += effect.stored + effect.dissipated;
        }
        return sum;
    };
    const double before = total();
    body.step({.time_step = 0.05 * body.critical_time_step()}, 4000);
    EXPECT_GT(body.obstacle_readings()[0].dissipated, 0.01 * before);
    EXPECT_NEAR(total(), before, 3e-3 * before);
}

template <class T>
std::vector<T> after_a_fall(int threads, bool once) {
    const Ball ball;
    PlanOptions options;
    options.threads = threads;
    ExplicitDynamics<T> body(ball.lattice, kSoft, options);
    body.set_skin_obstacles(skin_points(ball.lattice, ball.mesh),
                            std::array{Obstacle{PlaneShape{{0, 0.1, 1}}, {{0.12, 0.12, 0.018}}, 0.4}});
    const StepParameters step{.time_step = 0.8 * body.critical_time_step(), .acceleration = {0, 0, -10}};
    for (int n = 0; n < (once ? 1 : 40); ++n) {
        body.step(step, once ? 400 : 10);
    }
    return values(body, &ExplicitDynamics<T>::get_displacements);
}

TEST(SkinContact, GivesTheSameBitsForAnyThreadsAndCalls) {
    const std::vector<float> one = after_a_fall<float>(1, true);
    EXPECT_EQ(one, after_a_fall<float>(2, true));
    EXPECT_EQ(one, after_a_fall<float>(8, false));
    EXPECT_EQ(after_a_fall<double>(1, true), after_a_fall<double>(8, true));
}

TEST(SkinContact, HoldsWhatIsPrescribedAndLetsGoOfRemovedCells) {
    Lattice lattice = Lattice::box(4, 4, 4, 0.1);
    ExplicitDynamics<double> body(lattice, kSoft);
    std::vector<PrescribedNode> held;
    for (std::uint32_t n = 0; n < body.node_count(); ++n) {
        held.push_back({n});
    }
    body.prescribe(held);
    body.set_skin_obstacles(skin_points(lattice, boundary_mesh(lattice)),
                            std::array{Obstacle{PlaneShape{{0, 0, 1}}, {{0, 0, 0.01}}}});
    body.step({.time_step = 0.5 * body.critical_time_step()}, 3);
    const std::size_t whole = body.obstacle_readings()[0].nodes;
    EXPECT_EQ(whole, 25u);
    const std::vector<double> u = values(body, &ExplicitDynamics<double>::get_displacements);
    EXPECT_EQ(*std::max_element(u.begin(), u.end()), 0);
    // Where an obstacle has gone, nothing of it is left.
    const auto led_to = [&](double z) {
        body.move_obstacles(std::array{RigidPose{{0, 0, z}}});
        body.step({.time_step = 0.5 * body.critical_time_step()}, 1);
        return body.obstacle_readings()[0];
    };
    const ObstacleReading gone = led_to(-1), back = led_to(0.01);
    EXPECT_EQ(gone.nodes, 0u);
    EXPECT_EQ(gone.force[2], 0);
    EXPECT_EQ(back.nodes, 25u);
    std::vector<std::uint32_t> bottom;
    for (std::uint32_t c = 0; c < 16; ++c) {
        bottom.push_back(c);
    }
    body.remove_cells(lattice, bottom);
    body.step({.time_step = 0.5 * body.critical_time_step()}, 1);
    EXPECT_EQ(body.obstacle_readings()[0].nodes, 0u);
}

TEST(SkinContact, RefusesWhatDoesNotFit) {
    const Lattice lattice = Lattice::box(2, 2, 2, 0.1);
    ExplicitDynamics<float> body(lattice, kSoft);
    std::vector<SkinPoint> points = skin_points(lattice, boundary_mesh(lattice));
    const std::array obstacles = {Obstacle{}};
    points[3].weights[0] += 0.5;
    testing::expect_refusal([&] { body.set_skin_obstacles(points, obstacles); }, {"skin point 3", "1.5"});
    points[2].nodes[1] = 27;
    testing::expect_refusal([&] { body.set_skin_obstacles(points, obstacles); }, {"surface node 27"});
    EXPECT_TRUE(body.obstacle_readings().empty());
    points.clear();
    body.set_skin_obstacles(points, obstacles);
    body.step({.time_step = body.critical_time_step()}, 1);
    EXPECT_EQ(body.obstacle_readings().size(), 1u);
    body.set_obstacles({}, {});
    EXPECT_TRUE(body.obstacle_readings().empty());
}

} // namespace
} // namespace hybmss
