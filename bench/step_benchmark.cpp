#include "bench/step_benchmark.hpp"

#include "bench/interleaved.hpp"
#include "bench/yardstick.hpp"

#include "hybmss/explicit_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

namespace hybmss::bench {
namespace {

// Long enough to make the clock and the first steps after a switch negligible, short enough to meet the same speed
// state of the machine (they last for seconds) in both slices of a round.
constexpr double kSliceSeconds = 0.012;

/// Random displacements at a strain near 1e-2 and a hundred thousandth of damping a step: the body keeps trembling for
/// the whole row (1e5 steps take the energy to about 1/e), so nothing blows up, and nothing decays into denormal
/// numbers: displacements stay near 1e-3 m, their squares far above 1e-38.
std::vector<double> random_displacements(std::size_t nodes, double cell_size) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-0.01 * cell_size, 0.01 * cell_size);
    std::vector<double> values(3 * nodes);
    std::generate(values.begin(), values.end(), [&] { return uniform(random); });
    return values;
}

template <class Range>
bool all_finite(const Range& values) {
    return std::all_of(values.begin(), values.end(), [](auto v) { return std::isfinite(v); });
}

bool all_finite(const Yardstick& body) {
    return std::all_of(body.nodes.begin(), body.nodes.end(), [](const YardstickNode& node) {
        return std::isfinite(node.position.x + node.position.y + node.position.z);
    });
}

void set_counters(benchmark::State& state, const std::vector<Round>& rounds, const PlanDescription& plan, double cells,
                  double springs) {
    std::vector<double> times, yardstick_times, ratios;
    for (const Round& round : rounds) {
        times.push_back(round.candidate);
        yardstick_times.push_back(round.yardstick);
        ratios.push_back(round.yardstick / round.candidate);
    }
    const double step_seconds = median(times);
    state.counters["ns_per_cell"] = 1e9 * step_seconds / cells;
    state.counters["cells_per_second"] = cells / step_seconds;
    state.counters["springs_per_second"] = springs / step_seconds;
    state.counters["bytes_per_cell"] = static_cast<double>(plan.bytes) / cells;
    state.counters["yardstick_ns_per_cell"] = 1e9 * median(yardstick_times) / cells;
    state.counters["threads_used"] = plan.threads;
    state.counters["ratio_to_reference"] = median(ratios);
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    const Lattice lattice = row_lattice(row);
    const Material material = row_material(row);
    ExplicitDynamics<T> dynamics(lattice, material, row_options(row));
    const PlanDescription plan = dynamics.describe();
    if (plan.instruction_set != row.instruction_set) {
        state.SkipWithError("the plan runs another instruction set than the row names");
        return;
    }
    const std::size_t nodes = dynamics.node_count();
    const std::vector<double> start = random_displacements(nodes, lattice.cell_size());
    std::vector<T> u(start.begin(), start.end());
    dynamics.set_displacements(VectorField<T>::aos(u.data(), nodes));

    Yardstick yardstick = make_yardstick(Network::from_lattice(lattice, material));
    for (std::size_t n = 0; n < nodes; ++n) {
        Vector3& x = yardstick.nodes[n].position;
        x = {x.x + start[3 * n], x.y + start[3 * n + 1], x.z + start[3 * n + 2]};
    }

    StepParameters parameters;
    parameters.time_step = 0.5 * dynamics.critical_time_step();
    parameters.mass_damping = 1e-5 / parameters.time_step;
    Interleaved interleaved([&](long steps) { dynamics.step(parameters, steps); },
                            [&](long steps) {
                                for (long s = 0; s < steps; ++s) {
                                    step(yardstick, parameters.time_step, parameters.mass_damping);
                                }
                            },
                            kSliceSeconds);
    std::vector<Round> rounds;
    for ([[maybe_unused]] auto _ : state) {
        rounds.push_back(interleaved.next());
        state.SetIterationTime(rounds.back().candidate);
    }
    dynamics.get_displacements(VectorField<T>::aos(u.data(), nodes));
    if (!all_finite(u) || !all_finite(yardstick)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const double springs = static_cast<double>(lattice.merged_springs(material.face_diagonal_ratio > 0).total());
    set_counters(state, rounds, plan, static_cast<double>(lattice.cell_count()), springs);
}

} // namespace

void measure_step(benchmark::State& state, const BenchRow& row) {
    try {
        row.precision == Precision::float32 ? measure<float>(state, row) : measure<double>(state, row);
    } catch (const std::exception& error) {
        state.SkipWithError(error.what());
    }
}

void register_step(const BenchRow& row, double seconds) {
    const auto rounds = std::max(3L, std::lround(seconds / (2 * kSliceSeconds)));
    benchmark::RegisterBenchmark(name(row).c_str(), [row](benchmark::State& state) { measure_step(state, row); })
        ->UseManualTime()
        ->Iterations(rounds);
}

} // namespace hybmss::bench
