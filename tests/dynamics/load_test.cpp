/// Nodal loads in explicit steps.

#include "hybmss/explicit_dynamics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hybmss {
namespace {

const Material kMaterial{.young_modulus = 1e4, .poisson_ratio = 0.3, .density = 1000};

template <class Dynamics>
std::vector<double> velocities(const Dynamics& body) {
    std::vector<double> v(3 * body.node_count());
    body.get_velocities(VectorField<double>::aos(v.data(), body.node_count()));
    return v;
}

class NodalLoads : public testing::TestWithParam<std::string> {};

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

INSTANTIATE_TEST_SUITE_P(Layouts, NodalLoads, testing::ValuesIn(lattice_layouts()), [](const auto& layout) {
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

} // namespace
} // namespace hybmss
