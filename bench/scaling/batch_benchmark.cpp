#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "plan/tuning/tuner.hpp"

#include "hybmss/batch.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction =
    "64 bodies, full HybMSS, ten steps a call; medians of interleaved rounds. `speed-up`: over the same bodies stepped "
    "one\n"
    "after the other on one thread; `quiet`: the same ratio of the fastest quarters of all rounds.\n"
    "Then small and slender bodies on one thread, so many in a batch, by the time a cell of 30^3 (fastest quarters);\n"
    "`lanes`: of these, stepped side by side.\n";

constexpr std::size_t kBodies = 64;
constexpr long kStepsACall = 10;

std::string row_name(const BenchRow& row) {
    return "batch" + name(row).substr(std::string("step").size());
}

/// `steps` steps, `kStepsACall` at a time.
template <class Call>
void in_calls(long steps, const Call& call) {
    for (; steps > 0; steps -= kStepsACall) {
        call(std::min(steps, kStepsACall));
    }
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    BenchRow single = row;
    single.threads = 1;
    std::vector<ExplicitDynamics<T>> bodies;
    for (std::size_t b = 0; b < kBodies; ++b) {
        bodies.push_back(row_dynamics<T>(single));
    }
    const StepParameters parameters = gentle_steps(bodies[0]);
    Batch<T> batch(row.threads);
    const auto [together, alone] = in_turns(
        state, [&](long steps) { in_calls(steps, [&](long count) { batch.step(bodies, parameters, count); }); },
        [&](long steps) {
            in_calls(steps, [&](long count) {
                for (ExplicitDynamics<T>& body : bodies) {
                    body.step(parameters, count);
                }
            });
        });
    const double cells = static_cast<double>(kBodies) * std::pow(row.mesh[0], 3);
    if (!std::all_of(bodies.begin(), bodies.end(), [](const auto& body) { return all_finite(body); })) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    state.counters["bodies"] = static_cast<double>(kBodies);
    state.counters["ns_per_cell"] = 1e9 * median(together) / cells;
    state.counters["cells_per_second"] = cells / median(together);
    state.counters["speed_up"] = median_ratio(alone, together);
    state.counters["quiet_speed_up"] = fastest_quarter_mean(alone) / fastest_quarter_mean(together);
    state.counters["threads_used"] = batch.threads();
}

/// Bodies whose lines are short against a vector, in numbers that take some milliseconds a step.
struct SmallBodies {
    std::array<int, 3> mesh;
    std::size_t count;
};
constexpr SmallBodies kSmall[] = {{{3, 3, 3}, 1000},  {{4, 4, 4}, 500},   {{5, 5, 5}, 250},  {{8, 8, 8}, 64},
                                  {{10, 10, 10}, 32}, {{12, 12, 12}, 16}, {{1, 1, 500}, 32}, {{4, 4, 24}, 64},
                                  {{8, 8, 48}, 16},   {{10, 10, 10}, 1},  {{1, 1, 500}, 1},  {{4, 4, 24}, 1},
                                  {{8, 8, 48}, 1}};

/// So many bodies of the row against one of 30^3 cells.
template <class T>
void measure_small(benchmark::State& state, const BenchRow& row, std::size_t count) {
    std::vector<ExplicitDynamics<T>> bodies;
    for (std::size_t b = 0; b < count; ++b) {
        bodies.push_back(row_dynamics<T>(row));
    }
    BenchRow large = row;
    large.mesh = {30, 30, 30};
    ExplicitDynamics<T> cube = row_dynamics<T>(large);
    const StepParameters parameters = gentle_steps(bodies[0]), of_cube = gentle_steps(cube);
    Batch<T> batch(row.threads);
    const auto [small, whole] = in_turns(
        state, [&](long steps) { in_calls(steps, [&](long calls) { batch.step(bodies, parameters, calls); }); },
        [&](long steps) { in_calls(steps, [&](long calls) { cube.step(of_cube, calls); }); });
    const double cells = static_cast<double>(count) * row.mesh[0] * row.mesh[1] * row.mesh[2];
    if (!std::all_of(bodies.begin(), bodies.end(), [](const auto& body) { return all_finite(body); })) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    state.counters["bodies"] = static_cast<double>(count);
    state.counters["lanes"] = static_cast<double>(batch.describe().side_by_side);
    state.counters["ns_per_cell"] = 1e9 * fastest_quarter_mean(small) / cells;
    state.counters["of_cube"] = fastest_quarter_mean(small) / cells / (fastest_quarter_mean(whole) / 27000);
}

std::string small_line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-14s %-12s %-7s %-6s %7.0f %7.0f %8.2f %8.2f", mesh_name(row).c_str(), row.layout.c_str(),
                   std::string(name(row.instruction_set)).c_str(), std::string(name(row.precision)).c_str(),
                   counter(run, "bodies"), counter(run, "lanes"), counter(run, "ns_per_cell"), counter(run, "of_cube"));
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-14s %-12s %-7s %-6s %7d %5.0f %8.2f %8.1f %8.2f %8.2f", mesh_name(row).c_str(),
                   row.layout.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "threads_used"),
                   counter(run, "ns_per_cell"), 1e-6 * counter(run, "cells_per_second"), counter(run, "speed_up"),
                   counter(run, "quiet_speed_up"));
}

} // namespace

Table batch_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({"lattice"});
    const std::string heading = printed("%-14s %-12s %-7s %-6s %7s %5s %8s %8s %8s %8s", "mesh", "layout", "isa",
                                        "type", "threads", "used", "ns/cell", "Mcells/s", "speed-up", "quiet");
    const std::string of_small = printed("%-14s %-12s %-7s %-6s %7s %7s %8s %8s", "mesh", "layout", "isa", "type",
                                         "bodies", "lanes", "ns/cell", "by 30^3");
    Table table{kIntroduction, {}};
    for (const std::string& layout : choices.layouts) {
        for (InstructionSet set : choices.instruction_sets) {
            for (Precision precision : choices.precisions) {
                for (const int edge : {4, 6, 8, 10, 14}) {
                    for (int threads : choices.threads) {
                        const BenchRow row = {{edge, edge, edge}, Model::hybmss, layout,          set,
                                              precision,          threads,       choices.accuracy};
                        table.rows.push_back({row_name(row), threads, heading,
                                              std::max(5L, std::lround(choices.seconds / (2 * kSliceSeconds))),
                                              [row](benchmark::State& state) {
                                                  row.precision == Precision::float32 ? measure<float>(state, row)
                                                                                      : measure<double>(state, row);
                                              },
                                              [row](const auto& run) { return line(row, run); }});
                    }
                }
                for (const SmallBodies& small : kSmall) {
                    const BenchRow row = {small.mesh, Model::hybmss, layout, set, precision, 1, choices.accuracy};
                    const auto measure = precision == Precision::float32 ? measure_small<float> : measure_small<double>;
                    table.rows.push_back(
                        {"small" + row_name(row) + printed("/bodies:%zu", small.count), 1, of_small,
                         std::max(5L, std::lround(choices.seconds / (2 * kSliceSeconds))),
                         [=, count = small.count](benchmark::State& state) { measure(state, row, count); },
                         [row](const auto& run) { return small_line(row, run); }});
                }
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
