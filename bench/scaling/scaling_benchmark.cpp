#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "plan/tuning/tuner.hpp"
#include "simulation/geometry/voxel_grid.hpp" // available_bytes

#include <algorithm>
#include <cmath>
#include <optional>

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction =
    "Full HybMSS, one step; medians of interleaved rounds. `/ 32^3`: time per cell over that of 32^3 cells on as many\n"
    "threads; `speed-up`: over one thread; `quiet`: the same ratio of the fastest quarters of all rounds; `x ref`: "
    "over\n"
    "the plain double array-of-structs loops, up to 32^3.\n";

constexpr int kReferenceEdge = 32;

std::string row_name(const BenchRow& row) {
    return "scaling" + name(row).substr(std::string("step").size());
}

double cells_of(const BenchRow& row) {
    return std::pow(row.mesh[0], 3);
}

template <class T>
struct Body {
    explicit Body(const BenchRow& row) : dynamics(row_dynamics<T>(row)), parameters(gentle_steps(dynamics)) {}
    Trial work() {
        return timed([this](long steps) { dynamics.step(parameters, steps); });
    }
    ExplicitDynamics<T> dynamics;
    StepParameters parameters;
};

/// Why `bodies` such bodies do not fit the machine's memory, or nothing: the arrays of the layout, the masses, the
/// lattice's scales and the initial displacements, and a quarter for what an allocator takes.
std::string memory_short(const BenchRow& row, int bodies) {
    const double scalar = row.precision == Precision::float32 ? 4 : 8;
    const double nodes = std::pow(row.mesh[0] + 1, 3);
    const double needed = 1.25 * bodies * nodes * (20 * scalar + 16);
    const double available = available_bytes();
    return needed <= available ? ""
                               : printed("skipped: it takes %.1f GB of memory, and %.1f GB are available",
                                         1e-9 * needed, 1e-9 * available);
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    const std::string reason = memory_short(row, row.threads > 1 ? 2 : 1);
    if (!reason.empty()) {
        for ([[maybe_unused]] auto _ : state) {
            state.SetIterationTime(0);
        }
        state.SetLabel(reason);
        return;
    }
    BenchRow single = row, reference = row;
    single.threads = 1;
    reference.mesh = {kReferenceEdge, kReferenceEdge, kReferenceEdge};
    Body<T> body(row), standard(reference);
    std::optional<Body<T>> alone;
    std::vector<Trial> works = {body.work(), standard.work()};
    std::size_t alone_at = 0, yardstick_at = 0;
    if (row.threads > 1) {
        alone.emplace(single);
        alone_at = works.size();
        works.push_back(alone->work());
    }
    Yardstick yardstick;
    if (row.mesh[0] <= kReferenceEdge) {
        yardstick = moving_yardstick(row_lattice(row), row_material(row));
        yardstick_at = works.size();
        works.push_back(timed(steps_of(yardstick, body.parameters)));
    }
    Interleaved interleaved(works, kSliceSeconds);
    const double cells = cells_of(row), reference_cells = cells_of(reference);
    std::vector<double> steps, single_steps, to_reference_size, speed_up, ratio;
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        steps.push_back(round[0]);
        to_reference_size.push_back(round[0] / cells / (round[1] / reference_cells));
        single_steps.push_back(round[alone_at]);
        speed_up.push_back(round[alone_at] / round[0]);
        ratio.push_back(round[yardstick_at] / round[0]);
        state.SetIterationTime(round[0]);
    }
    if (!all_finite(body.dynamics)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const PlanDescription plan = body.dynamics.describe();
    state.counters["cells"] = cells;
    state.counters["ns_per_cell"] = 1e9 * median(steps) / cells;
    state.counters["cells_per_second"] = cells / median(steps);
    state.counters["ratio_to_32"] = median(to_reference_size);
    state.counters["speed_up"] = median(speed_up);
    state.counters["quiet_speed_up"] = fastest_quarter_mean(single_steps) / fastest_quarter_mean(steps);
    state.counters["threads_used"] = plan.threads;
    state.counters["bytes_per_node"] = static_cast<double>(plan.bytes) / static_cast<double>(plan.nodes);
    if (yardstick_at > 0) {
        state.counters["ratio_to_reference"] = median(ratio);
    }
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    if (!run.report_label.empty()) {
        return row_name(row) + ": " + run.report_label;
    }
    const double ratio = counter(run, "ratio_to_reference");
    return printed("%-14s %-12s %-7s %-6s %7d %5.0f %8.2f %8.2f %8.2f %8.2f %10.1f %8s", mesh_name(row).c_str(),
                   row.layout.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "threads_used"),
                   counter(run, "ns_per_cell"), counter(run, "ratio_to_32"), counter(run, "speed_up"),
                   counter(run, "quiet_speed_up"), counter(run, "bytes_per_node"),
                   ratio > 0 ? printed("%.2f", ratio).c_str() : "-");
}

} // namespace

Table scaling_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({"lattice"});
    std::vector<int> edges = {10, 16, 20, kReferenceEdge, 64, 128};
    if (choices.large) {
        edges.push_back(256);
    }
    const std::string heading =
        printed("%-14s %-12s %-7s %-6s %7s %5s %8s %8s %8s %8s %10s %8s", "mesh", "layout", "isa", "type", "threads",
                "used", "ns/cell", "/ 32^3", "speed-up", "quiet", "bytes/node", "x ref");
    Table table{kIntroduction, {}};
    for (const std::string& layout : choices.layouts) {
        for (InstructionSet set : choices.instruction_sets) {
            for (Precision precision : choices.precisions) {
                for (int edge : edges) {
                    for (int threads : choices.threads) {
                        const BenchRow row = {{edge, edge, edge}, Model::hybmss, layout,          set,
                                              precision,          threads,       choices.accuracy};
                        if (edge > 128 && precision == Precision::float64) {
                            continue;
                        }
                        // A round of a large body takes longer than its slices.
                        const double rounds = choices.seconds / (4 * kSliceSeconds) / (edge > 64 ? 2 : 1);
                        table.rows.push_back({row_name(row), threads, heading, std::max(5L, std::lround(rounds)),
                                              [row](benchmark::State& state) {
                                                  row.precision == Precision::float32 ? measure<float>(state, row)
                                                                                      : measure<double>(state, row);
                                              },
                                              [row](const auto& run) { return line(row, run); }});
                    }
                }
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
