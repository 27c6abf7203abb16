/// What must stay over very many steps: energy and angular momentum.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hybmss::stability {
namespace {

/// A free cube that spins and, set going at once, vibrates. Semi-implicit Euler keeps angular momentum but for
/// rounding: forces are central and add no torque, and u moves along v.
template <class T>
Outcome spin(SpringForm springs, long steps, double tolerance) {
    constexpr long kSamples = 1000;
    BodyMotion<T> motion(Lattice::box(2, 2, 2, kCellSize), case_material(springs, 0.4));
    const Vector3d center = Vector3d::Constant(kCellSize), turn(0.3, 0.5, -0.2); // 1/s
    Vectors v;
    for (const Vector3d& x : motion.rest()) {
        v.push_back(turn.cross(x - center));
    }
    motion.set_velocities(v);
    StepParameters parameters;
    parameters.time_step = 0.5 * motion.critical_time_step();
    const Vector3d start = motion.angular_momentum();
    const double start_energy = motion.energy();
    EnergyRecord record;
    double lost = 0;
    for (long sample = 0; sample < kSamples; ++sample) {
        motion.step(parameters, steps / kSamples);
        record.add(motion.energy());
        const double distance = (motion.angular_momentum() - start).norm() / start.norm();
        lost = std::isnan(distance) ? distance : std::max(lost, distance);
    }
    require(lost < tolerance, fmt::format("angular momentum is off by {:.1e}", lost));
    const double drift = std::abs(record.drift()) / start_energy;
    require(drift < std::max(tolerance, 1e-3), fmt::format("the energy drifted by {:.1e}", drift));
    const double turns = static_cast<double>(steps) * parameters.time_step * turn.norm() / 6.2832;
    Outcome outcome = right(fmt::format("angular momentum right to {:.1e} after some {:.0f} turns", lost, turns));
    outcome.energy_drift = drift;
    outcome.iterations = steps;
    outcome.min_cell_volume_ratio = motion.volume_change().min_cell_volume_ratio;
    return outcome;
}

/// The paper's beam, 0.4 x 0.4 x 2.4 m clamped at one end, let go under gravity, without damping.
Outcome beam(SpringForm springs, Precision precision, long steps) {
    constexpr long kSamples = 1000;
    Scene scene;
    scene.body = {{4, 4, 24}, 0.1};
    scene.material.young_modulus = 1e7;
    scene.material.springs = springs;
    scene.fixes = {{FaceRegion{2, false}}};
    scene.gravity.acceleration = {0, -10, 0};
    scene.solver.duration = 1e6;
    SimulationOptions options;
    options.precision = precision;
    options.plan.threads = 1;
    Simulation simulation(scene, options);
    EnergyRecord record;
    double greatest_elastic = 0, least_ratio = 1;
    for (long sample = 0; sample < kSamples; ++sample) {
        simulation.step(steps / kSamples);
        const Energies e = simulation.energies();
        greatest_elastic = std::max(greatest_elastic, e.springs + e.volume);
        least_ratio = std::min(least_ratio, simulation.volume_change().min_cell_volume_ratio);
        record.add(e.springs + e.volume + e.kinetic + e.external);
    }
    const double drift = std::abs(record.drift()) / greatest_elastic, swing = record.swing() / greatest_elastic;
    require(drift < 1e-3, fmt::format("the energy drifted by {:.1e} of the greatest elastic energy", drift));
    require(swing < 2e-2, fmt::format("the energy swung by {:.1e} of the greatest elastic energy", swing));
    Outcome outcome = right(
        fmt::format("the energy swings by {:.1e} and drifts by {:.1e} of the greatest elastic energy", swing, drift));
    outcome.energy_drift = drift;
    outcome.min_cell_volume_ratio = least_ratio;
    outcome.iterations = steps;
    return outcome;
}

} // namespace

void append_long_run_cases(std::vector<HardCase>& cases, SpringForm springs) {
    cases.push_back({"long: free spinning cube, 20,000 steps, double", "angular momentum stays", Wanted::answer, true,
                     [=] { return spin<double>(springs, 20'000, 1e-11); }});
    cases.push_back({"long: free spinning cube, 1,000,000 steps, double", "angular momentum stays", Wanted::answer,
                     false, [=] { return spin<double>(springs, 1'000'000, 1e-10); }});
    cases.push_back({"long: free spinning cube, 1,000,000 steps, float", "angular momentum stays to a hundredth",
                     Wanted::answer, false, [=] { return spin<float>(springs, 1'000'000, 1e-2); }});
    cases.push_back({"long: the paper's beam, 300,000 steps, double", "the energy stays", Wanted::answer, false,
                     [=] { return beam(springs, Precision::float64, 300'000); }});
    cases.push_back({"long: the paper's beam, 300,000 steps, float", "the energy stays", Wanted::answer, false,
                     [=] { return beam(springs, Precision::float32, 300'000); }});
}

} // namespace hybmss::stability
