#include "bench/yardstick.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "reference/semi_implicit_euler.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace hybmss {
namespace {

using Eigen::Vector3d;

Vector3d eigen(const bench::Vector3& v) {
    return {v.x, v.y, v.z};
}

Lattice masked_lattice() {
    Lattice lattice = Lattice::box(4, 3, 5, 0.5);
    lattice.set_cell_scale(1, 1, 2, 0.0f);
    lattice.set_cell_scale(0, 2, 4, 2.5f);
    return lattice;
}

Material material(VolumeEnergy energy) {
    Material m;
    m.poisson_ratio = energy == VolumeEnergy::mean_stretch ? 0.0 : 0.45;
    m.volume_energy = energy;
    return m;
}

std::vector<Vector3d> random_displacements(std::size_t nodes) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-0.05, 0.05);
    std::vector<Vector3d> u(nodes);
    std::generate(u.begin(), u.end(), [&] { return Vector3d(uniform(random), uniform(random), uniform(random)); });
    return u;
}

class YardstickTest : public testing::TestWithParam<VolumeEnergy> {
protected:
    YardstickTest() {
        for (std::size_t n = 0; n < u_.size(); ++n) {
            bench::Vector3& x = yardstick_.nodes[n].position;
            x = {x.x + u_[n].x(), x.y + u_[n].y(), x.z + u_[n].z()};
        }
    }

    const Network network_ = Network::from_lattice(masked_lattice(), material(GetParam()));
    const reference::Body body_ = reference::assemble(masked_lattice(), material(GetParam()));
    const std::vector<Vector3d> u_ = random_displacements(body_.rest.size());
    bench::Yardstick yardstick_ = bench::make_yardstick(network_);
};

// The yardstick works with positions, so a strain of 0.1 costs it a digit or two of double's sixteen.
constexpr double kTolerance = 1e-13;

TEST_P(YardstickTest, ForcesAreTheReferences) {
    bench::compute_forces(yardstick_);
    const std::vector<Vector3d> expected = reference::forces(body_, u_);
    const std::vector<double> scales = reference::force_scale(body_, u_);
    const double scale = *std::max_element(scales.begin(), scales.end());
    for (std::size_t n = 0; n < expected.size(); ++n) {
        EXPECT_LE((eigen(yardstick_.nodes[n].force) - expected[n]).norm(), kTolerance * scale) << "node " << n;
    }
}

TEST_P(YardstickTest, HessianProductsAreTheReferences) {
    std::vector<Vector3d> p = random_displacements(u_.size());
    std::reverse(p.begin(), p.end());
    std::vector<bench::Vector3> direction, product;
    for (const Vector3d& v : p) {
        direction.push_back({v.x(), v.y(), v.z()});
    }
    bench::hessian_product(yardstick_, direction, product);
    const std::vector<Vector3d> expected = reference::hessian_product(body_, u_, p);
    const std::vector<double> scales = reference::hessian_product_scale(body_, u_, p);
    const double scale = *std::max_element(scales.begin(), scales.end());
    for (std::size_t n = 0; n < expected.size(); ++n) {
        EXPECT_LE((eigen(product[n]) - expected[n]).norm(), kTolerance * scale) << "node " << n;
    }
}

TEST_P(YardstickTest, StepsAreTheReferences) {
    StepParameters parameters;
    parameters.time_step = 1e-3;
    parameters.mass_damping = 0.5;
    reference::State state = reference::rest_state(body_);
    state.u = u_;
    for (int s = 0; s < 20; ++s) {
        bench::step(yardstick_, parameters.time_step, parameters.mass_damping);
        reference::semi_implicit_euler_step(body_, parameters, {}, state);
    }
    for (std::size_t n = 0; n < u_.size(); ++n) {
        const Vector3d u = eigen(yardstick_.nodes[n].position) - body_.rest[n];
        EXPECT_LE((u - state.u[n]).norm(), 100 * kTolerance * 0.05) << "node " << n;
        EXPECT_LE((eigen(yardstick_.nodes[n].velocity) - state.v[n]).norm(), 100 * kTolerance) << "node " << n;
    }
}

INSTANTIATE_TEST_SUITE_P(VolumeEnergies, YardstickTest,
                         testing::Values(VolumeEnergy::quadratic, VolumeEnergy::mean_stretch, VolumeEnergy::none));

} // namespace
} // namespace hybmss
