#include "hybmss/network.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "reference/semi_implicit_euler.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hybmss::testing {
namespace {

using namespace reference;

void take_steps(const Body& body, const StepParameters& parameters, int count, State& state,
                std::span<const PrescribedNode> prescribed = {}) {
    for (int n = 0; n < count; ++n) {
        semi_implicit_euler_step(body, parameters, prescribed, state);
    }
}

TEST(SemiImplicitEuler, FreeFall) {
    const Body body = assemble(Lattice::box(2, 1, 3, 0.5), {1e4, 0.4});
    const StepParameters parameters{1e-3, {1, -10, 0.5}, 0};
    State state = rest_state(body);
    const int n = 200;
    take_steps(body, parameters, n, state);
    // v = n dt g, u = n (n + 1) / 2 dt^2 g, in every node alike: no internal force arises.
    const Vector3d g(1, -10, 0.5);
    for (std::size_t node = 0; node < body.rest.size(); ++node) {
        EXPECT_LE((state.v[node] - n * 1e-3 * g).norm(), 1e-11);
        EXPECT_LE((state.u[node] - n * (n + 1) / 2 * 1e-6 * g).norm(), 1e-11);
    }
}

TEST(SemiImplicitEuler, FreeBodiesKeepTheirMomenta) {
    unsigned seed = 41;
    for (VolumeEnergy energy : kVolumeEnergies) {
        SCOPED_TRACE("seed " + std::to_string(++seed));
        Random random(seed);
        const Body body = assemble(random_lattice(3, 2, 2, 0.5, random), {1e4, 0.1, 1000, 1, energy});
        State state{random_displacement(body.rest.size(), 0.05, random),
                    random_displacement(body.rest.size(), 1, random)};
        const auto momenta = [&] {
            Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
            for (std::size_t n = 0; n < body.rest.size(); ++n) {
                const Vector3d p = body.mass[n] * state.v[n];
                sum.head<3>() += p;
                sum.tail<3>() += (body.rest[n] + state.u[n]).cross(p);
            }
            return sum;
        };
        const auto before = momenta();
        const double kinetic_before = kinetic_energy(body, state);
        take_steps(body, {1e-4, {0, 0, 0}, 0}, 2000, state);
        EXPECT_LE((momenta() - before).norm(), 1e-11 * before.norm());
        EXPECT_GT(std::abs(kinetic_energy(body, state) - kinetic_before), 1e-3 * kinetic_before); // it did move
    }
}

TEST(SemiImplicitEuler, MassDampingDecay) {
    const Body body = assemble(Lattice::box(1, 1, 1, 0.5), {1e4, 0.3});
    State state = rest_state(body);
    const Vector3d v0(3, -1, 2);
    state.v.assign(state.v.size(), v0);
    const double dt = 1e-2, c = 2;
    take_steps(body, {dt, {0, 0, 0}, c}, 100, state);
    for (const Vector3d& v : state.v) {
        EXPECT_LE((v - v0 / std::pow(1 + dt * c, 100)).norm(), 1e-12);
    }
}

TEST(SemiImplicitEuler, TwoNodesOnASpringOscillate) {
    const double k = 50, m1 = 2, m2 = 3, amplitude = 0.1;
    Network network;
    network.rest_positions = {{0, 0, 0}, {0, 1, 0}};
    network.masses = {m1, m2};
    network.springs = {{0, 1, k, {0, 1, 0}}};
    validate(network);
    const Body body = assemble(network);
    const double omega = std::sqrt(k * (1 / m1 + 1 / m2)), period = 2 * std::numbers::pi / omega;
    const auto measured_period = [&](double dt) {
        State state = rest_state(body);
        state.u[1] = {0, amplitude, 0};
        const int periods = 100;
        double previous = amplitude, first = -1, last = -1;
        int downward = 0;
        const int most_steps =
            static_cast<int>(2 * periods * period / dt); // an end for a spring that does not oscillate
        for (int n = 1; downward <= periods && n < most_steps; ++n) {
            take_steps(body, {dt, {0, 0, 0}, 0}, 1, state);
            const double elongation = state.u[1].y() - state.u[0].y();
            if (previous > 0 && elongation <= 0) {
                const double crossing = (n - 1 + previous / (previous - elongation)) * dt;
                (downward == 0 ? first : last) = crossing;
                ++downward;
            }
            previous = elongation;
        }
        return (last - first) / periods;
    };
    const double coarse = 0.1 / omega, fine = 0.05 / omega;
    // The discrete oscillator's own frequency: sin(omega' dt / 2) = omega dt / 2.
    EXPECT_NEAR(measured_period(coarse), std::numbers::pi * coarse / std::asin(omega * coarse / 2), 1e-6 * period);
    // Its period is off by (omega dt)^2 / 24, so half the step leaves a quarter of the error.
    const double error = 1 - measured_period(coarse) / period, smaller = 1 - measured_period(fine) / period;
    EXPECT_NEAR(error, 0.01 / 24, 0.02 * 0.01 / 24);
    EXPECT_NEAR(error / smaller, 4, 0.1);
}

TEST(SemiImplicitEuler, PrescribedAxesAreSetAndTheOthersStayFree) {
    const Body body = assemble(Lattice::box(1, 2, 1, 0.5), {1e4, 0.3});
    const PrescribedNode nodes[] = {{0, 7, {0.1, 0.2, 0.3}, {1, 2, 3}}, {3, 2, {9, -0.1, 9}, {9, 0.5, 9}}};
    State state = rest_state(body), free = rest_state(body);
    const StepParameters parameters{1e-3, {0, -10, 0}, 0};
    State start = state;
    prescribe(nodes, start);
    EXPECT_EQ(start.u[0], Vector3d(0.1, 0.2, 0.3));
    EXPECT_EQ(start.v[0], Vector3d(1, 2, 3));
    EXPECT_EQ(start.u[3], Vector3d(0, -0.1, 0));
    EXPECT_EQ(start.v[3], Vector3d(0, 0.5, 0));
    // One step from rest: the forces are those of the rest state, and only the named axes differ from the free step.
    semi_implicit_euler_step(body, parameters, nodes, state);
    semi_implicit_euler_step(body, parameters, {}, free);
    EXPECT_EQ(state.u[0], Vector3d(0.1, 0.2, 0.3));
    EXPECT_EQ(state.u[3], Vector3d(free.u[3].x(), -0.1, free.u[3].z()));
    EXPECT_EQ(state.v[3], Vector3d(free.v[3].x(), 0.5, free.v[3].z()));
    EXPECT_EQ(state.u[5], free.u[5]);
}

TEST(SemiImplicitEuler, OneStepOfADeformedBody) {
    const unsigned seed = 43;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Body body = assemble(random_lattice(2, 2, 2, 0.5, random), {1e4, 0.45});
    const State before{random_displacement(body.rest.size(), 0.05, random),
                       random_displacement(body.rest.size(), 1, random)};
    const std::vector<Vector3d> f = forces(body, before.u);
    const Vector3d g(0, -10, 1);
    const double dt = 1e-3, c = 0.7;
    State after = before;
    take_steps(body, {dt, {0, -10, 1}, c}, 1, after);
    for (std::size_t n = 0; n < f.size(); ++n) {
        const Vector3d v = after.v[n];
        // m (v' - v) / dt = f + m g - c m v',  u' = u + dt v'
        const Vector3d rate = body.mass[n] * (v - before.v[n]) / dt, force = f[n] + body.mass[n] * (g - c * v);
        EXPECT_LE((rate - force).norm(), 1e-11 * (rate.norm() + force.norm()));
        EXPECT_LE((after.u[n] - before.u[n] - dt * v).norm(), 1e-15);
    }
}

} // namespace
} // namespace hybmss::testing
