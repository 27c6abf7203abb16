/// Steps just below and just above the critical one.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hybmss::stability {
namespace {

constexpr int kCells = 3;

Lattice cube() {
    return Lattice::box(kCells, kCells, kCells, kCellSize);
}

/// 2 / omega of the fastest vibration at rest: all eigenvalues of M^-1/2 K M^-1/2 of this very body.
double true_critical_step(const Material& material) {
    const reference::Body body = reference::assemble(cube(), material);
    Eigen::MatrixXd hessian = reference::hessian(body, Vectors(body.rest.size(), Vector3d::Zero()));
    for (Eigen::Index row = 0; row < hessian.rows(); ++row) {
        for (Eigen::Index column = 0; column < hessian.cols(); ++column) {
            hessian(row, column) /= std::sqrt(body.mass[static_cast<std::size_t>(row / 3)] *
                                              body.mass[static_cast<std::size_t>(column / 3)]);
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(hessian, Eigen::EigenvaluesOnly);
    return 2 / std::sqrt(solver.eigenvalues().maxCoeff());
}

/// Tiny vibrations, which stay in the range where the equations are linear. At 0.99 of the critical step semi-implicit
/// Euler keeps (1 - (omega dt/2)^2) E and some cross term: the energy of the fastest wave may swing by 1/(1 - 0.99^2).
Outcome below(const Material& material, bool of_bound) {
    BodyMotion<double> motion(cube(), material);
    const double critical = true_critical_step(material), bound = motion.critical_time_step();
    require(bound <= critical * (1 + 1e-12),
            fmt::format("the bound {:.6g} s is above the critical step {:.6g} s", bound, critical));
    motion.set_displacements(random_vectors(motion.node_count(), 1e-6 * kCellSize, 41));
    StepParameters parameters;
    parameters.time_step = 0.99 * (of_bound ? bound : critical);
    constexpr long kSteps = 50'000, kSamples = 500;
    EnergyRecord record;
    const double start = motion.energy();
    for (long sample = 0; sample < kSamples; ++sample) {
        motion.step(parameters, kSteps / kSamples + sample % 2); // not always the same phase
        record.add(motion.energy());
    }
    const double swing = record.swing() / start, drift = std::abs(record.drift()) / start;
    require(swing < 1 / (1 - 0.99 * 0.99), fmt::format("the energy swung by {:.1e} of itself", swing));
    // The samples' mean over many waves still swings by a part of that.
    require(drift < 0.5, fmt::format("the energy drifted by {:.1e} of itself", drift));
    Outcome outcome =
        right(fmt::format("bounded: the energy swings by {:.2f} of itself; the bound is {:.4f} of the critical step",
                          swing, bound / critical));
    outcome.energy_drift = drift;
    outcome.iterations = kSteps;
    return outcome;
}

/// Above it the fastest wave grows by e^theta a step, cosh theta = (omega dt)^2/2 - 1. The API takes the step, as its
/// caller may know better; the growth must be the one that theory says.
Outcome above(const Material& material) {
    BodyMotion<double> motion(cube(), material);
    const double factor = 1.05, theta = std::acosh(2 * factor * factor - 1);
    motion.set_displacements(random_vectors(motion.node_count(), 1e-15 * kCellSize, 42));
    StepParameters parameters;
    parameters.time_step = factor * true_critical_step(material);
    constexpr long kSteps = 12;
    motion.step(parameters, 2 * kSteps); // the fastest wave overtakes the others
    const double before = motion.kinetic_energy();
    motion.step(parameters, kSteps);
    const double rate = std::log(motion.kinetic_energy() / before) / 2 / kSteps;
    require(std::abs(rate / theta - 1) < 0.05,
            fmt::format("it grows by {:.3f} a step, not {:.3f}", std::exp(rate), std::exp(theta)));
    Outcome outcome = right(fmt::format("grows by {:.3f} a step, theory says {:.3f}", std::exp(rate), std::exp(theta)));
    outcome.iterations = 3 * kSteps;
    return outcome;
}

Scene free_scene(SpringForm springs, double time_step) {
    Scene scene;
    scene.body = {{kCells, kCells, kCells}, kCellSize};
    scene.material = case_material(springs, 0.4);
    scene.gravity.acceleration = {0, -1, 0};
    scene.fixes = {{FaceRegion{1, false}}};
    scene.solver.time_step = time_step;
    scene.solver.duration = 2000 * time_step;
    return scene;
}

/// A scene of 0.99 of the bound runs; one of 1.05 is refused.
Outcome scene(SpringForm springs, double factor) {
    SimulationOptions options;
    options.plan.threads = 1;
    Scene probe = free_scene(springs, 1e-6);
    const double bound = Simulation(probe, options).critical_time_step();
    Simulation simulation(free_scene(springs, factor * bound), options);
    const Summary summary = simulation.run();
    require(summary.failure.empty(), summary.failure);
    Outcome outcome = right("runs to its end");
    outcome.min_cell_volume_ratio = summary.volume.min_cell_volume_ratio;
    outcome.iterations = summary.steps;
    return outcome;
}

} // namespace

void append_time_step_cases(std::vector<HardCase>& cases, SpringForm springs) {
    for (const double nu : {0.0, 0.25, 0.49}) {
        for (const double ratio : {0.0, 1.0}) {
            const Material material = case_material(springs, nu, ratio);
            const std::string of = fmt::format("nu = {:g}, A = {:g}", nu, ratio);
            cases.push_back({"time step: 0.99 of the bound, " + of, "the energy stays bounded", Wanted::answer, true,
                             [material] { return below(material, true); }});
            cases.push_back({"time step: 0.99 of the critical step, " + of, "the energy stays bounded", Wanted::answer,
                             true, [material] { return below(material, false); }});
            cases.push_back({"time step: 1.05 of the critical step, " + of, "grows at the rate of theory",
                             Wanted::answer, true, [material] { return above(material); }});
        }
    }
    cases.push_back({"time step: a scene at 0.99 of the bound", "runs", Wanted::answer, true,
                     [=] { return scene(springs, 0.99); }});
    cases.push_back({"time step: a scene at 1.05 of the bound", "is refused", Wanted::error, true,
                     [=] { return scene(springs, 1.05); }});
}

} // namespace hybmss::stability
