#include "simulation/simulation_implementation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hybmss {
namespace {

// A check costs about three steps, so that checks take some 6 % of a run.
constexpr long kStepsBetweenChecks = 50;

} // namespace

Summary Simulation::run(const RunCallbacks& callbacks) {
    Implementation& body = *implementation_;
    const auto start = std::chrono::steady_clock::now();
    const auto elapsed = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    // Up to rounding, a duration of n steps takes n steps.
    const auto steps_until = [&](double t) {
        return static_cast<long>(std::min(std::ceil(t / body.time_step * (1 - 1e-12)), 1e17));
    };
    const auto write = [&] {
        if (callbacks.output) {
            callbacks.output();
        }
    };
    const Solver& solver = body.scene.solver;
    const long total = std::max(steps_until(solver.duration), body.steps);

    struct Good {
        std::vector<Vector3> displacements, velocities;
        long steps;
    };
    const auto present = [&] { return Good{displacements(), velocities(), body.steps}; };

    Summary summary;
    Good good = present();
    long outputs = 1, written = body.steps;
    write();
    while (body.steps < total) {
        const long next_output =
            body.scene.output.every
                ? std::max(steps_until(static_cast<double>(outputs) * *body.scene.output.every), body.steps + 1)
                : total;
        body.step(std::min({total, next_output, body.steps + kStepsBetweenChecks}) - body.steps);
        const Energies energies = body.energies();
        summary.failure = body.blow_up(energies);
        if (!summary.failure.empty()) {
            body.restore(good.displacements, good.velocities, good.steps);
            break;
        }
        good = present();
        const bool test = solver.tolerance && !body.moving();
        const Settlement settlement = test || callbacks.progress ? body.settlement(energies) : Settlement{};
        if (callbacks.progress) {
            callbacks.progress({body.steps, total, body.time(), elapsed(), energies, settlement});
        }
        if (body.steps >= next_output && body.scene.output.every) {
            write();
            written = body.steps;
            ++outputs;
        }
        if (test && settlement.settled) {
            break;
        }
    }
    if (written != body.steps) {
        write();
    }

    summary.energies = body.energies();
    summary.settlement = body.settlement(summary.energies);
    summary.converged = summary.settlement.settled && summary.failure.empty();
    if (solver.tolerance && !summary.converged && summary.failure.empty()) {
        summary.failure =
            text("not settled after duration = %.6g s: residual %.3g, kinetic ratio %.3g, tolerance %.3g%s",
                 solver.duration, summary.settlement.residual, summary.settlement.kinetic_ratio, *solver.tolerance,
                 body.moving() ? "; a motion has not ended" : "");
    }
    summary.volume = volume_change();
    summary.probes = body.read_probes();
    summary.steps = body.steps;
    summary.time = body.time();
    summary.time_step = body.time_step;
    summary.critical_time_step = body.critical_time_step;
    summary.plan = describe();
    summary.wall_seconds = elapsed();
    return summary;
}

} // namespace hybmss
