#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "bench/printed.hpp"
#include "bench/step/ratio_benchmark.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

constexpr int kSmallEdge = 64;

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    BenchRow small_row = row;
    small_row.mesh = {kSmallEdge, kSmallEdge, kSmallEdge};
    ExplicitDynamics<T> ball = row_dynamics<T>(row), small = row_dynamics<T>(small_row);
    const StepParameters parameters = gentle_steps(ball);
    Interleaved interleaved(
        {[&](long steps) { ball.step(parameters, steps); }, [&](long steps) { small.step(parameters, steps); }},
        kSliceSeconds);
    const PlanDescription plan = ball.describe(), small_plan = small.describe();
    const double cells = static_cast<double>(plan.cells), small_cells = static_cast<double>(small_plan.cells);
    const double bytes = static_cast<double>(plan.bytes) / cells;
    std::vector<double> times, ratios;
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        times.push_back(round[0] / cells);
        ratios.push_back(round[0] / cells / (round[1] / small_cells));
        state.SetIterationTime(round[0]);
    }
    if (!all_finite(ball) || !all_finite(small)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    state.counters["cells"] = cells;
    state.counters["filled"] = cells / std::pow(row.mesh[0], 3);
    state.counters["ns_per_cell"] = 1e9 * median(times);
    state.counters["ratio_to_64"] = median(ratios);
    state.counters["bytes_per_cell"] = bytes;
    state.counters["bytes_ratio_to_64"] = bytes / (static_cast<double>(small_plan.bytes) / small_cells);
    state.SetLabel(plan.layout);
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-16s %-12s %-7s %-6s %7d %9.0f %7.1f %% %9.2f %8.2f %10.1f %8.2f", mesh_name(row).c_str(),
                   run.report_label.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "cells"),
                   100 * counter(run, "filled"), counter(run, "ns_per_cell"), counter(run, "ratio_to_64"),
                   counter(run, "bytes_per_cell"), counter(run, "bytes_ratio_to_64"));
}

} // namespace

Row filled_row(const BenchRow& row, double seconds) {
    return {"ratio/filled" + name(row, ""),
            row.threads,
            printed("%-16s %-12s %-7s %-6s %7s %9s %9s %9s %8s %10s %8s", "filled", "layout", "isa", "type", "threads",
                    "cells", "of grid", "ns/cell", "/ 64^3", "bytes/cell", "/ 64^3"),
            std::max(3L, std::lround(seconds / (2 * kSliceSeconds))),
            [row](benchmark::State& state) {
                row.precision == Precision::float32 ? measure<float>(state, row) : measure<double>(state, row);
            },
            [row](const auto& run) { return line(row, run); }};
}

} // namespace hybmss::bench
