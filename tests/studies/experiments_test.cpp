/// The paper's experiments end at the equilibria that a Newton solver found for the same lattices.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"

#include <cmath>

namespace hybmss {
namespace {

struct Figures {
    const char* scene;
    double volume_change; ///< percent
    double force;         ///< N
};

class Compression : public testing::TestWithParam<Figures> {};

TEST_P(Compression, ends_settled_at_the_equilibrium) {
    Simulation simulation(load_scene(test::example(GetParam().scene)));
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_LE(summary.settlement.residual, 1e-5);
    EXPECT_NEAR(100 * summary.volume.relative_volume_change, GetParam().volume_change, 0.002);
    // The plate pushes down.
    EXPECT_NEAR(summary.probes.at(0).force[1], -GetParam().force, 1e-4 * GetParam().force);
    EXPECT_NEAR(summary.probes.at(0).force[0], 0, 1e-6 * GetParam().force);
    EXPECT_GT(summary.volume.min_cell_volume_ratio, 0.7);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Compression,
                         testing::Values(Figures{"compression_nu025", 13.519, 46526.7},
                                         Figures{"compression_nu0499", 0.108, 79497.9},
                                         Figures{"compression_nu0", 19.849, 37285.7}),
                         [](const auto& scene) { return std::string(scene.param.scene); });

Summary run_example(const std::string& name) {
    Simulation simulation(load_scene(test::example(name)));
    Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << name << ": " << summary.failure;
    return summary;
}

TEST(Experiments, shear_force) {
    const Summary summary = run_example("shear");
    EXPECT_NEAR(summary.probes.at(0).force[0], 14108.3, 0.001 * 14108.3);
    EXPECT_NEAR(summary.probes.at(0).mean_displacement[0], 1.0, 1e-12);
}

TEST(Experiments, torsion_torque) {
    EXPECT_NEAR(run_example("torsion_1").probes.at(0).torque[1], 1290.9, 0.001 * 1290.9);
    EXPECT_NEAR(run_example("torsion_45").probes.at(0).torque[1], 59442.0, 0.001 * 59442.0);
}

/// The work of the plate is the energy of the body: F = dW / d(displacement).
TEST(Experiments, tension_force_is_the_derivative_of_the_energy) {
    const auto pulled = [](double by) {
        Scene scene = load_scene(test::example("tension"));
        scene.moves.at(0).motion = std::array<double, 3>{0, 0, by};
        Simulation simulation(std::move(scene));
        return simulation.run();
    };
    const double step = 0.004;
    const Summary middle = pulled(0.48), low = pulled(0.48 - step), high = pulled(0.48 + step);
    EXPECT_TRUE(middle.converged);
    const double derivative = (high.energies.springs - low.energies.springs) / (2 * step);
    EXPECT_NEAR(middle.probes.at(0).force[2], derivative, 1e-4 * derivative);
    EXPECT_GT(derivative, 300);
}

TEST(Experiments, beam_support_carries_the_weight) {
    const Summary summary = run_example("beam");
    const double weight = 1000 * 0.4 * 0.4 * 2.4 * 10;
    EXPECT_NEAR(summary.probes.at(0).force[1], weight, 1e-3 * weight);
    // The weight acts at half the length, less what the bent beam draws it in.
    EXPECT_NEAR(summary.probes.at(0).torque[0], -1.2 * weight, 0.02 * 1.2 * weight);
    // Euler and Bernoulli: rho g A L^4 / (8 E I) = 0.311 m; four cells across are somewhat stiffer.
    EXPECT_NEAR(summary.probes.at(1).mean_displacement[1], -0.288, 0.002);
    // On a free face nothing exerts a force.
    EXPECT_EQ(summary.probes.at(1).force[1], 0.0);
}

TEST(Experiments, compression_in_float_is_as_good) {
    SimulationOptions options;
    options.precision = Precision::float32;
    Simulation simulation(load_scene(test::example("compression_nu025")), options);
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(100 * summary.volume.relative_volume_change, 13.519, 0.02);
    EXPECT_NEAR(summary.probes.at(0).force[1], -46526.7, 0.005 * 46526.7);
}

} // namespace
} // namespace hybmss
