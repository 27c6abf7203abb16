// Loads; what is prescribed, led through a call of many steps; what is refused of both; and whether a motion is still
// finite.

#include "hybmss/explicit_dynamics.hpp"
#include "tests/moving_body.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {
namespace {

const Material kMaterial{.young_modulus = 1e4, .poisson_ratio = 0.3, .density = 1000};

template <class Dynamics>
std::vector<double> velocities(const Dynamics& body) {
    std::vector<double> v(3 * body.node_count());
    body.get_velocities(VectorField<double>::aos(v.data(), body.node_count()));
    return v;
}

class NodalLoads : public ::testing::TestWithParam<std::string> {};

/// A load that is m g on every node is gravity.
TEST_P(NodalLoads, weight_on_every_node_is_gravity) {
    const Lattice lattice = Lattice::box(3, 4, 5, 0.1);
    ExplicitDynamics<double> loaded(lattice, kMaterial, {.layout = GetParam()});
    ExplicitDynamics<double> falling(lattice, kMaterial, {.layout = GetParam()});
    std::vector<NodalLoad> loads;
    for (std::uint32_t n = 0; n < loaded.node_count(); ++n) {
        // In two parts, which add up.
        const double weight = loaded.masses()[n];
        loads.push_back({n, {0, -4 * weight, 0}});
        loads.push_back({n, {weight, -6 * weight, 0}});
    }
    loaded.load(loads);
    const std::array<PrescribedNode, 1> held = {PrescribedNode{.node = 7}};
    loaded.prescribe(held);
    falling.prescribe(held);
    const double dt = 0.5 * loaded.critical_time_step();
    loaded.step({.time_step = dt, .mass_damping = 0.7}, 50);
    falling.step({.time_step = dt, .acceleration = {1, -10, 0}, .mass_damping = 0.7}, 50);
    const std::vector<double> a = velocities(loaded), b = velocities(falling);
    for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_NEAR(a[i], b[i], 1e-12) << i;
    }
    EXPECT_EQ(a[3 * 7 + 1], 0.0);
    EXPECT_GT(std::abs(a[1]), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Layouts, NodalLoads, ::testing::ValuesIn(lattice_layouts()), [](const auto& layout) {
    std::string name = layout.param;
    std::erase(name, '-');
    return name;
});

TEST(NodalLoads, bad_ones_are_refused) {
    ExplicitDynamics<float> body(Lattice::box(1, 1, 1, 1.0), kMaterial);
    const std::array<NodalLoad, 1> no_node = {NodalLoad{8, {0, 0, 0}}};
    EXPECT_THROW(body.load(no_node), std::invalid_argument);
    const std::array<NodalLoad, 1> infinite = {NodalLoad{0, {0, std::numeric_limits<double>::infinity(), 0}}};
    EXPECT_THROW(body.load(infinite), std::invalid_argument);
}

using testing::refusal;

const Lattice& block() {
    static const Lattice lattice = Lattice::box(6, 5, 9, 0.1);
    return lattice;
}

/// The lower face, which goes up and turns some of its axes free, and one node that is held alone.
std::vector<PrescribedNode> plate(const Lattice& lattice, double time) {
    std::vector<PrescribedNode> nodes;
    for (std::uint32_t n = 0; n < 7 * 6; ++n) {
        const double way = 0.02 * std::sin(3 * time + 0.1 * n);
        nodes.push_back(
            {n, static_cast<std::uint8_t>(n % 3 == 0 ? 7 : 4), {way, 0.5 * way, 2 * way}, {0.1, way, 0.06}});
    }
    nodes.push_back({static_cast<std::uint32_t>(lattice.grid_node_count() - 1), 2, {0, 0.01 * time, 0}, {0, 0.01, 0}});
    return nodes;
}

std::vector<RigidPose> ball(double time) {
    RigidPose pose;
    pose.position = {0.3, 0.25, 1.05 - 0.3 * time};
    pose.velocity = {0, 0, -0.3};
    return {pose};
}

template <class T>
std::vector<T> motion(const std::string& layout, int threads, bool led) {
    PlanOptions options;
    options.layout = layout;
    options.threads = threads;
    ExplicitDynamics<T> body(block(), Material{.young_modulus = 1e5, .poisson_ratio = 0.4, .density = 1000}, options);
    body.damp_springs(1e-4);
    body.set_obstacles(surface_nodes(block()), std::vector<Obstacle>{{SphereShape{0.2}, ball(0).front(), 0.4, 0}});
    body.prescribe(plate(block(), 0));
    const NodalLoad load{100, {1, 2, 3}};
    body.load({&load, 1});
    const StepParameters parameters{0.3 * body.critical_time_step(), {0, -9.81, 0}, 0.5};
    const auto time = [&](long step) { return static_cast<double>(step) * parameters.time_step; };
    long done = 0;
    for (const long count : {1L, 40L, 7L}) {
        if (led) {
            std::vector<PrescribedNode> nodes;
            std::vector<RigidPose> poses;
            StepMotion lead;
            lead.nodes = [&](long step) {
                return std::span<const PrescribedNode>(nodes = plate(block(), time(done + step)));
            };
            lead.obstacles = [&](long step) { return std::span<const RigidPose>(poses = ball(time(done + step))); };
            body.step(parameters, count, lead);
        } else {
            for (long step = 1; step <= count; ++step) {
                body.step(parameters);
                body.prescribe(plate(block(), time(done + step)));
                body.move_obstacles(ball(time(done + step)));
            }
        }
        done += count;
    }
    body.step(parameters, 5); // what was led stays where it came to
    std::vector<T> state = body.exact_state();
    for (const EffectEnergy& energy : body.effect_energies()) {
        state.push_back(static_cast<T>(energy.stored));
        state.push_back(static_cast<T>(energy.dissipated));
    }
    return state;
}

template <class T>
struct LedMotionOf : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(LedMotionOf, Precisions);

TYPED_TEST(LedMotionOf, GoesAsSingleStepsDo) {
    for (const char* layout : {"flat-rows", "active-rows", "packed-xyzw", "coloured-soa"}) {
        const auto single = testing::bits_of(motion<TypeParam>(layout, 1, false));
        for (const int threads : {1, 2, 3}) {
            EXPECT_EQ(testing::bits_of(motion<TypeParam>(layout, threads, true)), single)
                << layout << ", " << threads << " threads";
        }
    }
}

TEST(LedMotion, RefusesOtherNodesThanThosePrescribed) {
    ExplicitDynamics<double> body(block(), Material{});
    const StepParameters parameters{0.1 * body.critical_time_step()};
    const std::vector<PrescribedNode> held = {{3, 5}, {4, 7}};
    body.prescribe(held);
    const auto led_by = [&](std::vector<PrescribedNode> nodes) {
        StepMotion lead;
        lead.nodes = [&](long) { return std::span<const PrescribedNode>(nodes); };
        return refusal([&] { body.step(parameters, 3, lead); });
    };
    EXPECT_EQ(led_by(held), "");
    const char* const other =
        "the motion gives other nodes or axes than prescribe(): they must be the same, in the same "
        "order";
    EXPECT_EQ(led_by({{3, 5}}), other);
    EXPECT_EQ(led_by({{4, 7}, {3, 5}}), other);
    EXPECT_EQ(led_by({{3, 4}, {4, 7}}), other);
    EXPECT_EQ(led_by({{3, 5}, {4, 7}, {5, 1}}), other);
    EXPECT_EQ(led_by({{3, 5, {0, 0, HUGE_VAL}}, {4, 7}}),
              "prescribed displacement of node 3 = inf is not allowed: it must be finite");
    StepMotion poses;
    poses.obstacles = [](long) {
        static const RigidPose pose;
        return std::span<const RigidPose>(&pose, 1);
    };
    EXPECT_EQ(refusal([&] { body.step(parameters, 3, poses); }), "1 poses given: the body has no obstacles");
}

TEST(LedMotion, StaysWhereItWasWhenItThrows) {
    for (const int threads : {1, 2}) {
        PlanOptions options;
        options.threads = threads;
        ExplicitDynamics<double> body(Lattice::box(20, 20, 20, 0.1), Material{}, options);
        body.prescribe(std::vector<PrescribedNode>{{0, 1}});
        std::vector<PrescribedNode> node = {{0, 1}};
        StepMotion lead;
        lead.nodes = [&](long step) {
            if (step == 3) {
                throw std::runtime_error("no way");
            }
            node[0].displacement[0] = 0.001 * static_cast<double>(step);
            return std::span<const PrescribedNode>(node);
        };
        EXPECT_THROW(body.step({0.1 * body.critical_time_step()}, 10, lead), std::runtime_error);
        std::vector<double> u(3 * body.node_count());
        body.get_displacements(VectorField<double>::aos(u.data(), body.node_count()));
        EXPECT_NEAR(u[0], 0.002, 1e-15);
    }
}

TEST(Prescribed, EachAxisOfANodeOnce) {
    ExplicitDynamics<float> body(block(), Material{});
    const auto refused = [&](const std::vector<PrescribedNode>& nodes) {
        return refusal([&] { body.prescribe(nodes); });
    };
    EXPECT_EQ(refused({{7, 1}, {2, 7}, {7, 6}}), "") << "its axes may come apart, and nodes in any order";
    EXPECT_EQ(refused({{7, 1}, {2, 7}, {7, 3}}),
              "prescribed node 7: given twice along x; each axis of a node may be given once");
    EXPECT_EQ(refused({{7, 4}, {7, 4}}),
              "prescribed node 7: given twice along z; each axis of a node may be given once");
}

TEST(Prescribed, FiniteInTheBodysPrecision) {
    ExplicitDynamics<float> body(block(), Material{});
    const std::string why = refusal([&] { body.prescribe(std::vector<PrescribedNode>{{1, 1, {1e39, 0, 0}}}); });
    EXPECT_NE(why.find("prescribed displacement of node 1 = 9999999"), std::string::npos) << why;
    EXPECT_NE(why.find("is not allowed: it must be finite in the body's precision"), std::string::npos) << why;
    EXPECT_NE(refusal([&] { body.prescribe(std::vector<PrescribedNode>{{1, 1, {}, {-1e39, 0, 0}}}); }), "");
    const auto stepped = [&](const StepParameters& parameters) { return refusal([&] { body.step(parameters); }); };
    EXPECT_EQ(stepped({1e-4, {0, 0, 1e300}}),
              "acceleration = 1e+300 is not allowed: it must be finite in the body's precision");
    EXPECT_EQ(stepped({1e-50}),
              "time_step = 1e-50 is not allowed: it must be finite and above 0 in the body's precision");
    EXPECT_EQ(stepped({1e39}),
              "time_step = 1e+39 is not allowed: it must be finite and above 0 in the body's precision");
    EXPECT_EQ(refusal([&] {
                  body.load(std::vector<NodalLoad>{{2, {0, 1e60, 0}}});
              }),
              "load on node 2: the force along y is not finite in the body's precision");
    // Finite as given, and not in units of cells.
    ExplicitDynamics<float> fine(Lattice::box(1, 1, 1, 1e-3), Material{});
    std::vector<float> u(3 * fine.node_count(), 0.0f);
    u[4] = 3e38f;
    const std::string units = refusal([&] { fine.set_displacements(VectorField<const float>::aos(u.data(), 8)); });
    EXPECT_NE(units.find("displacement of node 1 = 3"), std::string::npos) << units;
    EXPECT_NE(units.find("it must be finite in units of cells too"), std::string::npos) << units;
    EXPECT_EQ(refusal([&] { fine.set_velocities({u.data(), nullptr, u.data(), 3, 8}); }), "vector field: y is null");
    EXPECT_TRUE(fine.finite());
    EXPECT_TRUE(body.finite());
}

// 64 steps without a look are the most; a look at the end of a call names the steps taken by then.
TEST(Finite, ToldWithTheStepsTaken) {
    for (const char* layout : {"flat-rows", "active-rows", "packed-xyzw", "coloured-soa"}) {
        PlanOptions options;
        options.layout = layout;
        ExplicitDynamics<float> body(block(), Material{}, options);
        body.prescribe(std::vector<PrescribedNode>{{0, 1, {0.01, 0, 0}}});
        EXPECT_EQ(body.not_finite_at(), 0);
        body.step({0.5 * body.critical_time_step()}, 1000);
        EXPECT_TRUE(body.finite()) << layout;
        body.step({20 * body.critical_time_step()}, 1000);
        EXPECT_FALSE(body.finite()) << layout;
        EXPECT_EQ(body.not_finite_at(), 2000) << layout;
        body.step({20 * body.critical_time_step()}, 100);
        EXPECT_EQ(body.not_finite_at(), 2000) << "the first time";
        const std::vector<float> zero(6 * body.node_count(), 0.0f);
        body.set_exact_state(zero);
        EXPECT_TRUE(body.finite()) << "set anew";
        body.step({0.5 * body.critical_time_step()}); // with a look, as the state is new
        body.step({1e6 * body.critical_time_step()}, 20);
        EXPECT_FALSE(body.finite()) << "too soon for another look";
        EXPECT_EQ(body.not_finite_at(), 2121) << layout;
    }
}

TEST(Finite, FoundByItselfWhereStepsAreCalledForOneByOne) {
    ExplicitDynamics<float> body(block(), Material{});
    body.prescribe(std::vector<PrescribedNode>{{0, 1, {0.01, 0, 0}}});
    const StepParameters far_too_long{20 * body.critical_time_step()};
    for (int step = 0; step < 700; ++step) {
        body.step(far_too_long);
    }
    const long found = body.not_finite_at();
    EXPECT_EQ(found % 64, 0) << found;
    EXPECT_LT(found, 640);
    EXPECT_GT(found, 0);
}

} // namespace
} // namespace hybmss
