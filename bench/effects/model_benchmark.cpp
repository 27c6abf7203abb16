#include "bench/interleaved.hpp"
#include "bench/limits/operation_count.hpp"
#include "bench/moving_body.hpp"
#include "bench/printed.hpp"
#include "bench/step/ratio_benchmark.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    BenchRow full_row = row;
    full_row.model = Model::hybmss;
    ExplicitDynamics<T> model = row_dynamics<T>(row), full = row_dynamics<T>(full_row);
    const StepParameters model_steps = gentle_steps(model), full_steps = gentle_steps(full);
    Interleaved interleaved(
        {[&](long steps) { model.step(model_steps, steps); }, [&](long steps) { full.step(full_steps, steps); }},
        kSliceSeconds);
    std::vector<double> times, full_times, speed_ups;
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        times.push_back(round[0]);
        full_times.push_back(round[1]);
        speed_ups.push_back(round[1] / round[0]);
        state.SetIterationTime(round[0]);
    }
    if (!all_finite(model) || !all_finite(full)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const double cells = static_cast<double>(model.describe().cells);
    const double slots = count_operations(row).vector.slots(), full_slots = count_operations(full_row).vector.slots();
    state.counters["ns_per_cell"] = 1e9 * median(times) / cells;
    state.counters["full_ns_per_cell"] = 1e9 * median(full_times) / cells;
    state.counters["operations_share"] = slots / full_slots;
    state.counters["speed_up"] = median(speed_ups);
    state.counters["speed_up_by_count"] = full_slots / slots;
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-12s %-10s %-7s %-6s %7d %8.2f %8.2f %10.1f %% %9.2f %9.2f %8.0f %%", mesh_name(row).c_str(),
                   name(row.model).c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "ns_per_cell"),
                   counter(run, "full_ns_per_cell"), 100 * counter(run, "operations_share"), counter(run, "speed_up"),
                   counter(run, "speed_up_by_count"),
                   100 * counter(run, "speed_up") / counter(run, "speed_up_by_count"));
}

} // namespace

Row model_row(const BenchRow& row, double seconds) {
    return {"ratio/models" + name(row, ""),
            row.threads,
            printed("%-12s %-10s %-7s %-6s %7s %8s %8s %12s %9s %9s %10s", "models", "model", "isa", "type", "threads",
                    "ns/cell", "full", "operations", "speed-up", "by count", "reached"),
            std::max(3L, std::lround(seconds / (2 * kSliceSeconds))),
            [row](benchmark::State& state) {
                row.precision == Precision::float32 ? measure<float>(state, row) : measure<double>(state, row);
            },
            [row](const auto& run) { return line(row, run); }};
}

} // namespace hybmss::bench
