#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {

namespace {

/// The rounds of a step and of the yardstick's.
void set_counters(benchmark::State& state, const Rounds& rounds, const PlanDescription& plan, double cells,
                  double springs) {
    const double step_seconds = median(rounds.first);
    state.counters["ns_per_cell"] = 1e9 * step_seconds / cells;
    state.counters["cells_per_second"] = cells / step_seconds;
    state.counters["springs_per_second"] = springs / step_seconds;
    state.counters["bytes_per_cell"] = static_cast<double>(plan.bytes) / cells;
    state.counters["yardstick_ns_per_cell"] = 1e9 * median(rounds.second) / cells;
    state.counters["threads_used"] = plan.threads;
    state.counters["ratio_to_reference"] = median_ratio(rounds.second, rounds.first);
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    const Lattice lattice = row_lattice(row);
    const Material material = row_material(row);
    ExplicitDynamics<T> dynamics = row_dynamics<T>(row);
    const PlanDescription plan = dynamics.describe();
    if (plan.instruction_set != row.instruction_set) {
        state.SkipWithError("the plan runs another instruction set than the row names");
        return;
    }
    Yardstick yardstick = moving_yardstick(lattice, material);
    const StepParameters parameters = gentle_steps(dynamics);
    const Rounds rounds = in_turns(
        state, [&](long steps) { dynamics.step(parameters, steps); }, steps_of(yardstick, parameters));
    if (!all_finite(dynamics) || !all_finite(yardstick)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const double springs = static_cast<double>(lattice.merged_springs(material.face_diagonal_ratio > 0).total());
    set_counters(state, rounds, plan, static_cast<double>(lattice.cell_count()), springs);
}

constexpr const char* kIntroduction =
    "One step = springs + volume + integration; medians of interleaved rounds; `x ref`: the speed over plain double\n"
    "array-of-structs loops, measured in the same rounds.\n";

std::string heading() {
    return printed("%-14s %-9s %-12s %-7s %-6s %-8s %7s %5s %8s %10s %11s %10s %8s", "mesh", "model", "layout", "isa",
                   "type", "acc.", "threads", "used", "ns/cell", "Mcells/s", "Msprings/s", "bytes/cell", "x ref");
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-14s %-9s %-12s %-7s %-6s %-8s %7d %5.0f %8.2f %10.1f %11.1f %10.1f %8.2f", mesh_name(row).c_str(),
                   name(row.model).c_str(), row.layout.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), std::string(name(row.accuracy)).c_str(), row.threads,
                   counter(run, "threads_used"), counter(run, "ns_per_cell"), counter(run, "cells_per_second") / 1e6,
                   counter(run, "springs_per_second") / 1e6, counter(run, "bytes_per_cell"),
                   counter(run, "ratio_to_reference"));
}

} // namespace

Table step_benchmark(const RowChoices& choices) {
    Table table{kIntroduction, {}};
    for (const BenchRow& row : step_rows(choices.with_layouts({"lattice", "network", "coloured-soa"}))) {
        table.rows.push_back(
            {name(row), row.threads, heading(), std::max(3L, std::lround(choices.seconds / (2 * kSliceSeconds))),
             [row](benchmark::State& state) {
                 row.precision == Precision::float32 ? measure<float>(state, row) : measure<double>(state, row);
             },
             [row](const auto& run) { return line(row, run); }});
    }
    return table;
}

} // namespace hybmss::bench
