/// Leapfrog steps: their order, in whatever acts; that readings and calls leave no trace; and what they refuse.

#include "reference/semi_implicit_euler.hpp"
#include "tests/dynamics/touching_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

namespace hybmss {
namespace {

const Material kMaterial{.young_modulus = 1e5, .poisson_ratio = 0.4, .density = 1000};
const Lattice kBlock = Lattice::box(3, 4, 3, 0.1);

using Body = ExplicitDynamics<double>;

std::vector<double> read(const Body& body, void (Body::*get)(VectorField<double>) const) {
    std::vector<double> values(3 * body.node_count());
    (body.*get)(VectorField<double>::aos(values.data(), body.node_count()));
    return values;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
    double greatest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        greatest = std::max(greatest, std::abs(a[i] - b[i]));
    }
    return greatest;
}

/// A body that vibrates from a random state, so weakly that springs are nearly linear.
Body vibrating(const Material& material = kMaterial, const PlanOptions& options = {}) {
    Body body(kBlock, material, options);
    const std::vector<double> u = testing::random_field<double>(body.node_count(), 1e-4, 7);
    body.set_displacements(VectorField<const double>::aos(u.data(), body.node_count()));
    return body;
}

StepParameters leapfrog(double time_step, double mass_damping = 0, double gravity = 0) {
    return {time_step, {0, -gravity, 0}, mass_damping, Integrator::leapfrog};
}

/// By how steps of a time `span`, halved twice, differ in displacements and in velocities, the lesser.
double order(const std::function<void(Body& body, int part)>& motion, const Material& material = kMaterial,
             double parts = 24) {
    std::vector<double> u[3], v[3];
    for (int halving = 0; halving < 3; ++halving) {
        Body body = vibrating(material);
        motion(body, static_cast<int>(parts) << halving);
        u[halving] = read(body, &Body::get_displacements);
        v[halving] = read(body, &Body::get_velocities);
    }
    return std::min(std::log2(distance(u[0], u[1]) / distance(u[1], u[2])),
                    std::log2(distance(v[0], v[1]) / distance(v[1], v[2])));
}

/// s: some six of the body's fastest swings in the first of the orders' parts.
const double kSpan = 6 * Body(kBlock, kMaterial).critical_time_step();

TEST(Leapfrog, IsOfTheSecondOrder) {
    const auto free = [](Body& body, int parts) { body.step(leapfrog(kSpan / parts), parts); };
    EXPECT_NEAR(order(free), 2, 0.05);
    EXPECT_NEAR(order([](Body& body, int parts) { body.step(leapfrog(kSpan / parts, 200, 5), parts); }), 2, 0.05)
        << "mass damping and gravity";
    Material stiffening = kMaterial;
    stiffening.stiffening = {10, 100};
    EXPECT_NEAR(order(free, stiffening), 2, 0.05) << "stiffening springs";
    EXPECT_NEAR(order([](Body& body, int parts) {
                    body.step({kSpan / parts, {0, 0, 0}, 200, Integrator::symplectic_euler}, parts);
                }),
                1, 0.1);
}

TEST(Leapfrog, IsOfTheSecondOrderWhereWhatActsChangesBetweenSteps) {
    const std::array<NodalLoad, 1> pull = {NodalLoad{5, {1, 2, 3}}}, push = {NodalLoad{5, {-2, 0, 1}}};
    EXPECT_NEAR(order([&](Body& body, int parts) {
                    body.load(pull);
                    body.step(leapfrog(kSpan / parts, 50), parts / 2);
                    body.load(push);
                    body.step(leapfrog(kSpan / parts, 50), parts / 2);
                }),
                2, 0.05)
        << "loads";
    EXPECT_NEAR(order([](Body& body, int parts) {
                    body.step(leapfrog(kSpan / parts, 200, 50), parts / 2);
                    body.step(leapfrog(0.5 * kSpan / parts, 0, -20), parts / 2);
                }),
                2, 0.05)
        << "gravity, damping and the step";
    const std::array<PrescribedNode, 1> held = {PrescribedNode{.node = 7, .displacement = {1e-4, 0, 0}}};
    EXPECT_NEAR(order([&](Body& body, int parts) {
                    body.prescribe(held);
                    body.step(leapfrog(kSpan / parts), parts / 2);
                    body.prescribe({});
                    body.step(leapfrog(kSpan / parts), parts / 2);
                }),
                2, 0.05)
        << "a node let go";
    EXPECT_NEAR(order([](Body& body, int parts) {
                    Lattice lattice = kBlock;
                    body.step(leapfrog(kSpan / parts), parts / 2);
                    body.remove_cells(lattice, std::array<std::uint32_t, 2>{0, 5});
                    body.step(leapfrog(kSpan / parts), parts / 2);
                }),
                2, 0.05)
        << "a cut";
}

TEST(Leapfrog, IsOfTheSecondOrderWhereNodesAreLed) {
    EXPECT_NEAR(order([](Body& body, int parts) {
                    const double w = 2 / kSpan;
                    std::vector<PrescribedNode> nodes;
                    const auto at = [&](double t) {
                        nodes = {{3, 7, {1e-3 * std::sin(w * t), 0, 0}, {1e-3 * w * std::cos(w * t), 0, 0}}};
                        return std::span<const PrescribedNode>(nodes);
                    };
                    body.prescribe(at(0));
                    StepMotion motion;
                    motion.nodes = [&](long step) { return at(kSpan * static_cast<double>(step) / parts); };
                    body.step(leapfrog(kSpan / parts), parts, motion);
                }),
                2, 0.05);
}

/// Dashpots take the velocity half a step before: of the first order, and so is what docs say.
TEST(Leapfrog, DampsSpringsByTheFirstOrder) {
    EXPECT_NEAR(order(
                    [](Body& body, int parts) {
                        body.damp_springs(0.05 * kSpan);
                        body.step(leapfrog(kSpan / parts), parts);
                    },
                    kMaterial, 96),
                1, 0.1);
}

TEST(Leapfrog, FallsExactly) {
    const double t = 0.5, c = 3, g = 10;
    for (const double damping : {0.0, c}) {
        Body body(kBlock, kMaterial);
        body.step(leapfrog(t / 1000, damping, g), 1000);
        const double fall = damping > 0 ? g / c * -std::expm1(-c * t) : g * t;
        EXPECT_NEAR(read(body, &Body::get_velocities)[1], -fall, 1e-11) << damping;
        if (damping == 0) {
            EXPECT_NEAR(read(body, &Body::get_displacements)[1], -g * t * t / 2, 1e-11);
        }
    }
}

template <class T>
struct LeapfrogOf : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(LeapfrogOf, Precisions);

/// Of the body with all that acts but contact, after each step.
TYPED_TEST(LeapfrogOf, GoesAsTheReferenceDoes) {
    using T = TypeParam;
    for (const std::string layout : {"flat-rows", "active-rows", "packed-xyzw", "coloured-soa"}) {
        ExplicitDynamics<T> body(kBlock, kMaterial, {.layout = layout});
        const reference::Body model = reference::assemble(kBlock, kMaterial);
        reference::State state = reference::rest_state(model);
        const std::array<PrescribedNode, 1> held = {
            PrescribedNode{.node = 2, .axes = 5, .displacement = {1e-3, 0, 0}, .velocity = {0, 0, 0.1}}};
        body.prescribe(held);
        reference::prescribe(held, state);
        const StepParameters parameters = leapfrog(kSpan / 24, 100, 10);
        std::vector<T> u(3 * body.node_count()), v(u.size());
        double greatest = 0, error = 0, speed = 0, velocity_error = 0;
        for (int step = 0; step < 40; ++step) {
            body.step(parameters);
            reference::leapfrog_step(model, parameters, held, state);
            body.get_displacements(VectorField<T>::aos(u.data(), body.node_count()));
            body.get_velocities(VectorField<T>::aos(v.data(), body.node_count()));
            for (std::size_t i = 0; i < u.size(); ++i) {
                const double a = state.u[i / 3][static_cast<Eigen::Index>(i % 3)],
                             b = state.v[i / 3][static_cast<Eigen::Index>(i % 3)];
                greatest = std::max(greatest, std::abs(a));
                speed = std::max(speed, std::abs(b));
                error = std::max(error, std::abs(a - static_cast<double>(u[i])));
                velocity_error = std::max(velocity_error, std::abs(b - static_cast<double>(v[i])));
            }
        }
        // As `hybmss verify` holds fifty steps to.
        const double bound = 2000 * static_cast<double>(std::numeric_limits<T>::epsilon());
        EXPECT_LT(error, bound * greatest) << layout;
        EXPECT_LT(velocity_error, bound * speed) << layout;
        double kinetic = 0;
        for (std::size_t n = 0; n < body.node_count(); ++n) {
            kinetic += 0.5 * body.masses()[n] * state.v[n].squaredNorm();
        }
        EXPECT_NEAR(body.kinetic_energy(), kinetic, 2 * bound * kinetic) << layout;
    }
}

/// With everything that acts.
template <class T>
struct Busy {
    ExplicitDynamics<T> body;
    explicit Busy(const std::string& layout = "", int threads = 1)
        : body(kBlock, kMaterial, {.layout = layout, .threads = threads}) {
        body.damp_springs(1e-4);
        body.set_obstacles(surface_nodes(kBlock), std::array{testing::floor_at(1e-3, 0.4)});
        body.prescribe(std::array{PrescribedNode{.node = 40, .displacement = {0, 1e-3, 0}}});
        body.load(std::array{NodalLoad{30, {1, 2, 3}}});
    }
    StepParameters parameters() const { return leapfrog(0.4 * body.critical_time_step(), 3, 10); }
    std::uint64_t bits() const {
        std::uint64_t hash = testing::bits_of(body.exact_state());
        return testing::bits_of(body.effect_memory(), Digest(hash));
    }
};

TYPED_TEST(LeapfrogOf, NeitherCallsNorReadingsNorThreadsLeaveATrace) {
    for (const std::string layout : {"flat-rows", "active-rows", "packed-xyzw", "coloured-soa"}) {
        Busy<TypeParam> whole(layout), single(layout), threads(layout, 3);
        whole.body.step(whole.parameters(), 60);
        threads.body.step(threads.parameters(), 60);
        std::vector<TypeParam> v(3 * single.body.node_count());
        for (int step = 0; step < 60; ++step) {
            single.body.step(single.parameters());
            single.body.get_velocities(VectorField<TypeParam>::aos(v.data(), single.body.node_count()));
            single.body.kinetic_energy();
            single.body.obstacle_readings();
            single.body.effect_energies();
            single.body.step(single.parameters(), 0);
            single.body.prescribe(std::array{PrescribedNode{.node = 40, .displacement = {0, 1e-3, 0}}});
            single.body.load(std::array{NodalLoad{30, {1, 2, 3}}});
        }
        EXPECT_EQ(single.bits(), whole.bits()) << layout;
        EXPECT_EQ(threads.bits(), whole.bits()) << layout;
    }
}

TYPED_TEST(LeapfrogOf, GoesOnFromItsStateWithTheSameBits) {
    Busy<TypeParam> whole, first, second;
    whole.body.step(whole.parameters(), 60);
    first.body.step(first.parameters(), 23);
    second.body.set_exact_state(first.body.exact_state());
    second.body.set_effect_memory(first.body.effect_memory());
    second.body.step(second.parameters(), 37);
    EXPECT_EQ(second.bits(), whole.bits());
}

/// Free motion without a first half kick: the very steps of symplectic Euler.
TYPED_TEST(LeapfrogOf, TakesTheStepsOfSymplecticEuler) {
    ExplicitDynamics<TypeParam> leaping(kBlock, kMaterial), stepping(kBlock, kMaterial);
    const std::vector<TypeParam> u = testing::random_field<TypeParam>(leaping.node_count(), 1e-3, 7);
    leaping.set_displacements(VectorField<const TypeParam>::aos(u.data(), leaping.node_count()));
    StepParameters parameters = leapfrog(0.5 * leaping.critical_time_step());
    leaping.step(parameters);
    stepping.set_exact_state(leaping.exact_state());
    leaping.step(parameters, 50);
    parameters.integrator = Integrator::symplectic_euler;
    stepping.step(parameters, 50);
    EXPECT_EQ(leaping.exact_state(), stepping.exact_state());
    // And on by them, from velocities at whole steps.
    std::vector<TypeParam> v(u.size()), after(u.size());
    leaping.get_velocities(VectorField<TypeParam>::aos(v.data(), leaping.node_count()));
    stepping.set_velocities(VectorField<const TypeParam>::aos(v.data(), leaping.node_count()));
    leaping.step(parameters);
    stepping.step(parameters);
    leaping.get_displacements(VectorField<TypeParam>::aos(v.data(), leaping.node_count()));
    stepping.get_displacements(VectorField<TypeParam>::aos(after.data(), leaping.node_count()));
    for (std::size_t i = 0; i < v.size(); ++i) {
        EXPECT_NEAR(v[i], after[i], 8e-3 * static_cast<double>(std::numeric_limits<TypeParam>::epsilon())) << i;
    }
}

/// What lies on a floor lies still from the first step on, and bounces as high as by symplectic Euler.
TEST(LeapfrogContact, RestsAndBounces) {
    const double stiffness = testing::stiffness_of(0.01), gravity = 10;
    const auto block = [&](double height) {
        return testing::TouchingBody<double>(Lattice::box(2, 2, 2, testing::kEdge),
                                             {testing::floor_at(height, 0.3, stiffness)});
    };
    testing::TouchingBody<double> lying = block(0);
    lying.dynamics.step(leapfrog(lying.time_step, std::sqrt(stiffness), gravity), 4000);
    const std::vector<double> settled = lying.displacements();
    for (int step = 0; step < 20; ++step) {
        lying.set_velocity({0, 0, 0}); // begins with half a kick
        lying.dynamics.step(leapfrog(lying.time_step, 0, gravity));
        EXPECT_LT(distance(lying.displacements(), settled), 1e-9 * testing::kEdge) << step;
        for (const double v : lying.velocities()) {
            EXPECT_LT(std::abs(v), 1e-5 * gravity * lying.time_step) << step;
        }
    }
    double left[2];
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::leapfrog}) {
        testing::TouchingBody<double> ball = block(-0.05);
        StepParameters step = leapfrog(0.2 * ball.time_step, 0, gravity);
        step.integrator = integrator;
        const double start = 0.05 * gravity * ball.mass();
        double imbalance = 0;
        for (int look = 0; look < 200; ++look) {
            ball.dynamics.step(step, 20);
            double energy = ball.energy() + ball.dynamics.effect_energies().at(0).dissipated;
            energy += ball.mass() * (gravity * ball.mean(ball.displacements())[1] + 0.05 * gravity);
            imbalance = std::max(imbalance, std::abs(energy - start) / start);
        }
        EXPECT_LT(imbalance, 0.02) << static_cast<int>(integrator);
        left[static_cast<int>(integrator)] = ball.dynamics.effect_energies().at(0).dissipated / start;
    }
    EXPECT_NEAR(left[1], left[0], 0.02);
}

TEST(Leapfrog, SaysWhatItRefuses) {
    Body body(kBlock, kMaterial);
    const auto refusal = [](const std::function<void()>& call) -> std::string {
        try {
            call();
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(refusal([&] { body.step(leapfrog(1e-3, 1e5)); }),
              "mass_damping = 100000 is not allowed: it must be at most 50000 for a leapfrog step of 0.001 s");
    EXPECT_NE(refusal([&] {
                  body.set_effect_memory(std::array{1.0, 2.0});
              }).find("leapfrog steps 5 more"),
              std::string::npos);
    EXPECT_NE(refusal([&] {
                  body.set_effect_memory(std::array{-1.0, 0.0, 0.0, 0.0, 0.0});
              }).find("time_step"),
              std::string::npos);
    EXPECT_TRUE(body.effect_memory().empty());
}

} // namespace
} // namespace hybmss
