#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "bench/printed.hpp"
#include "bench/step/ratio_benchmark.hpp"
#include "bench/step/shuffled.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    const Network network = Network::from_lattice(row_lattice(row), row_material(row));
    const PlanOptions options = row_options(row);
    ExplicitDynamics<T> ordered(network, options), random(shuffled(network, 1), options);
    disturb(ordered, row_lattice(row).cell_size());
    disturb(random, row_lattice(row).cell_size());
    const StepParameters parameters = gentle_steps(ordered);
    Interleaved interleaved(
        {[&](long steps) { random.step(parameters, steps); }, [&](long steps) { ordered.step(parameters, steps); }},
        kSliceSeconds);
    std::vector<double> times, ordered_times, ratios;
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        times.push_back(round[0]);
        ordered_times.push_back(round[1]);
        ratios.push_back(round[0] / round[1]);
        state.SetIterationTime(round[0]);
    }
    if (!all_finite(ordered) || !all_finite(random)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const double springs = static_cast<double>(network.springs.size());
    state.counters["ns_per_spring"] = 1e9 * median(times) / springs;
    state.counters["ordered_ns_per_spring"] = 1e9 * median(ordered_times) / springs;
    state.counters["ratio_to_ordered"] = median(ratios);
    state.counters["bytes_per_spring"] = static_cast<double>(random.describe().bytes) / springs;
    state.SetLabel(random.describe().layout);
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-12s %-10s %-12s %-7s %-6s %7d %10.2f %10.2f %8.1f %17.2f", mesh_name(row).c_str(),
                   name(row.model).c_str(), run.report_label.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "ns_per_spring"),
                   counter(run, "ordered_ns_per_spring"), counter(run, "bytes_per_spring"),
                   counter(run, "ratio_to_ordered"));
}

} // namespace

Row numbering_row(const BenchRow& row, double seconds) {
    return {"ratio/numbering" + name(row, ""),
            row.threads,
            printed("%-12s %-10s %-12s %-7s %-6s %7s %10s %10s %8s %17s", "numbering", "model", "layout", "isa", "type",
                    "threads", "ns/spring", "ordered", "B/spring", "random / ordered"),
            std::max(3L, std::lround(seconds / (2 * kSliceSeconds))),
            [row](benchmark::State& state) {
                row.precision == Precision::float32 ? measure<float>(state, row) : measure<double>(state, row);
            },
            [row](const auto& run) { return line(row, run); }};
}

} // namespace hybmss::bench
