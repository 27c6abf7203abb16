#include "app/effect_costs.hpp"

#include "simulation/run/memory.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hybmss {
namespace {

constexpr int kRounds = 11;
constexpr double kSliceSeconds = 0.005;

/// A scene that can be stepped for as long as timing takes: begun anew where it diverges, as it may beyond its duration
/// or without one of its effects.
struct Timed {
    Timed(Scene scene, const SimulationOptions& given) : options(given), simulation(std::move(scene), given) {}
    SimulationOptions options;
    Simulation simulation;
};

double seconds_of(Timed& timed, long steps) {
    const long before = timed.simulation.steps();
    const auto start = std::chrono::steady_clock::now();
    const auto seconds = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    try {
        timed.simulation.step(steps);
        return seconds();
    } catch (const std::runtime_error&) {
        const auto taken = static_cast<double>(timed.simulation.steps() - before);
        const double a_step = seconds() / std::max(taken, 1.0);
        timed.simulation = Simulation(timed.simulation.scene(), timed.options);
        return a_step * static_cast<double>(steps);
    }
}

long steps_of_a_slice(Timed& simulation) {
    simulation.simulation.step();
    for (long steps = 1;; steps *= 2) {
        const double seconds = seconds_of(simulation, steps);
        if (seconds > kSliceSeconds / 4) {
            return std::max(1L, std::lround(kSliceSeconds / seconds * static_cast<double>(steps)));
        }
    }
}

/// Seconds a step that `with` takes longer than `rest`, the median over rounds in which both have a slice.
double difference(Timed& with, Timed& rest) {
    const long steps[2] = {steps_of_a_slice(with), steps_of_a_slice(rest)};
    std::vector<double> differences;
    for (int round = 0; round < kRounds; ++round) {
        // Either comes first in turn.
        double seconds[2];
        for (int i : {round % 2, 1 - round % 2}) {
            seconds[i] = seconds_of(i == 0 ? with : rest, steps[i]) / static_cast<double>(steps[i]);
        }
        differences.push_back(seconds[0] - seconds[1]);
    }
    std::nth_element(differences.begin(), differences.begin() + kRounds / 2, differences.end());
    return differences[kRounds / 2];
}

} // namespace

std::vector<EffectCost> effect_costs(const Simulation& simulation, const SimulationOptions& options) {
    const Scene& scene = simulation.scene();
    const bool explicit_in_time = scene.solver.method == SolverMethod::symplectic_euler;
    const double needed = 3 * estimated_bytes(scene.body, options);
    SimulationOptions same = options;
    same.plan = simulation.describe().choice;
    std::vector<EffectCost> costs;
    for (const EffectRule& rule : effect_rules()) {
        EffectCost& cost = costs.emplace_back(EffectCost{&rule, rule.in(scene), {}, {}});
        if (!cost.in || !rule.remove || needed > available_bytes()) {
            continue;
        }
        Timed with(scene, same), rest(without(scene, rule), same);
        if (explicit_in_time) {
            cost.nanoseconds = 1e9 * difference(with, rest) / static_cast<double>(simulation.lattice().cell_count());
        }
        // After steps: some arrays are made by the first.
        cost.bytes = static_cast<long long>(with.simulation.describe().bytes) -
                     static_cast<long long>(rest.simulation.describe().bytes);
    }
    return costs;
}

} // namespace hybmss
