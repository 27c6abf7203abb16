#pragma once

/// \file
/// The loop of a run in time: steps, looks at the state, results at their times, the end.

#include "hybmss/simulation/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

namespace hybmss {

/// Runs `moved`, one body or a world of them, to the scene's duration or until it has settled. Returns why it stopped
/// early, with the last good state restored, or "". Sets `interrupted` where a callback ended it.
///
/// What moves has time_step, steps, outputs, written and continued; time(), steps_between_checks(), changing(),
/// step(count) and blow_up(energies), which return a failure or ""; energies(), total(energies), settlement(energies);
/// present() and restore(state).
template <class Moved>
std::string run_in_time(Moved& moved, const Scene& scene, const RunCallbacks& callbacks,
                        const std::function<double()>& elapsed, bool& interrupted) {
    // Up to rounding, a duration of n steps takes n steps.
    const auto steps_until = [&](double t) {
        return static_cast<long>(std::min(std::ceil(t / moved.time_step * (1 - 1e-12)), 1e17));
    };
    const Solver& solver = scene.solver;
    const long total = std::max(steps_until(solver.duration), moved.steps);
    const long between_checks = moved.steps_between_checks();

    const auto write = [&] {
        if (callbacks.output) {
            callbacks.output();
        }
    };
    std::string failure;
    auto good = moved.present();
    if (!std::exchange(moved.continued, false)) {
        write();
        moved.outputs = 1;
        moved.written = moved.steps;
    }
    constexpr double kSoon = 1; // s
    const long first = moved.steps;
    bool told = !callbacks.estimate;
    const auto tell = [&, begin = elapsed()] {
        if (const double seconds = elapsed() - begin; !told && seconds >= kSoon) {
            callbacks.estimate(seconds / static_cast<double>(moved.steps - first) * static_cast<double>(total - first));
            told = true;
        }
    };
    while (moved.steps < total) {
        const long next_output =
            scene.output.every
                ? std::max(steps_until(static_cast<double>(moved.outputs) * *scene.output.every), moved.steps + 1)
                : total;
        const long check = std::min({total, next_output, moved.steps + between_checks});
        if (!told && moved.steps == first) {
            failure = moved.step(1);
            if (failure.empty()) {
                tell();
            }
        }
        if (failure.empty()) {
            failure = moved.step(check - moved.steps);
        }
        if (!failure.empty()) {
            break;
        }
        tell();
        const auto energies = moved.energies();
        failure = moved.blow_up(energies);
        if (!failure.empty()) {
            moved.restore(good);
            break;
        }
        good = moved.present();
        const bool test = solver.tolerance && !moved.changing();
        const Settlement settlement = test || callbacks.progress ? moved.settlement(energies) : Settlement{};
        if (callbacks.progress) {
            callbacks.progress(
                {moved.steps, total, moved.time(), elapsed(), moved.total(energies), settlement, {}, {}});
        }
        if (moved.steps >= next_output && scene.output.every) {
            write();
            moved.written = moved.steps;
            ++moved.outputs;
        }
        if (test && settlement.settled) {
            break;
        }
        // Only here, where nothing of this check is left to do: what goes on from a checkpoint begins with a step.
        if (callbacks.checkpoint && !callbacks.checkpoint()) {
            interrupted = true;
            return "";
        }
    }
    if (moved.written != moved.steps) {
        write();
        moved.written = moved.steps;
    }
    return failure;
}

} // namespace hybmss
