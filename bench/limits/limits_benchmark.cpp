#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/limits/machine_limits.hpp"
#include "bench/limits/operation_count.hpp"
#include "bench/moving_body.hpp"
#include "layouts/aligned_array.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hybmss::bench {
namespace {

constexpr const char* kIntroduction =
    "slots/16: vector-arithmetic operations per 16 cells, counted by running the kernel's text on values that count;\n"
    "mul, add, other, stores: the same per vector. B in, B out: bytes of the body's arrays that a step reads and "
    "writes\n"
    "per node. arith., memory: the least ns per cell. All from the fastest of interleaved rounds; one thread.\n";

constexpr double kLimitSlice = 0.004;

/// The least time of one cell, s, and what it is bound by.
struct Bound {
    double seconds;
    const char* by;
};

/// As if nothing but one pipe held the kernel up: the slowest of the pipes' own bounds. `time` holds the seconds of one
/// vector operation of each kind; of an absent kind, 0.
Bound arithmetic_bound(const KernelCount& kernel, const std::array<double, kIssueCount>& time) {
    const auto of = [&](Issue issue) { return time[static_cast<std::size_t>(issue)]; };
    const OperationCount& n = kernel.vector;
    const Bound bounds[] = {
        // The arithmetic of both mixes is the same: the faster loop is nearer to what the core can do.
        {n.slots() * std::min(of(Issue::mixed), of(Issue::mixed_and_stores)), "all slots"},
        {n.multiplications * of(Issue::multiply_add), "multiplies"},
        {n.additions * of(Issue::add), "additions"},
        {n.estimates * of(Issue::reciprocal_square_root), "estimates"},
        // One unit does both.
        {n.square_roots * of(Issue::square_root) + n.divisions * of(Issue::divide), "divider"},
        {n.stores * of(Issue::store), "stores"}};
    const Bound slowest = *std::max_element(std::begin(bounds), std::end(bounds),
                                            [](const Bound& a, const Bound& b) { return a.seconds < b.seconds; });
    return {slowest.seconds / kernel.width, slowest.by};
}

/// Memory of as many bytes as the body's arrays that the kernel only reads, and that it updates.
class Traffic {
public:
    Traffic(const KernelCount& kernel, std::size_t nodes, std::size_t scalar, InstructionSet set)
        : loops_(limit_loops(set).stream),
          read_bytes_(whole(static_cast<std::size_t>(kernel.arrays_read) * nodes * scalar)),
          update_bytes_(whole(static_cast<std::size_t>(kernel.arrays_updated) * nodes * scalar)),
          read_(read_bytes_ / sizeof(float)), update_(update_bytes_ / sizeof(float)) {}

    void touch() {
        loops_.read(read_.data(), read_bytes_);
        loops_.update(update_.data(), update_bytes_);
    }

private:
    static std::size_t whole(std::size_t bytes) { return (bytes + 1023) / 1024 * 1024; }

    const StreamLoops& loops_;
    std::size_t read_bytes_, update_bytes_;
    AlignedArray<float> read_, update_;
};

template <class T>
void measure(benchmark::State& state, const BenchRow& row, FastestTimes& fastest) {
    ExplicitDynamics<T> dynamics = row_dynamics<T>(row);
    const PlanDescription plan = dynamics.describe();
    const StepParameters parameters = gentle_steps(dynamics);
    const KernelCount kernel = count_operations(row);
    const IssueWorks loops(row.instruction_set, row.precision);
    Traffic traffic(kernel, plan.nodes, sizeof(T), row.instruction_set);

    std::vector<Trial> works = {timed([&](long steps) { dynamics.step(parameters, steps); }), timed([&](long steps) {
                                    for (long i = 0; i < steps; ++i) {
                                        traffic.touch();
                                    }
                                })};
    std::vector<std::size_t> kinds;
    for (std::size_t kind = 0; kind < kIssueCount; ++kind) {
        const auto issue = static_cast<Issue>(kind);
        const bool needed = (issue != Issue::square_root || kernel.vector.square_roots > 0) &&
                            (issue != Issue::divide || kernel.vector.divisions > 0);
        if (needed && loops.has(issue)) {
            kinds.push_back(kind);
            works.push_back(timed(loops.work(issue)));
        }
    }
    Interleaved interleaved(works, kLimitSlice);
    const double cells = static_cast<double>(plan.cells);
    std::vector<double> steps;
    std::vector<double> best(works.size(), std::numeric_limits<double>::infinity());
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        std::transform(round.begin(), round.end(), best.begin(), best.begin(),
                       [](double now, double before) { return std::min(now, before); });
        steps.push_back(round[0] / cells);
        state.SetIterationTime(round[0]);
    }
    if (!all_finite(dynamics)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    std::array<double, kIssueCount> times{};
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        times[kinds[i]] = fastest.improve(row.instruction_set, row.precision, static_cast<Issue>(kinds[i]),
                                          best[i + 2] / IssueWorks::kOperationsPerStep);
    }
    const Bound arithmetic = arithmetic_bound(kernel, times);
    const double memory = best[1] / cells;
    const double step = best[0] / cells;
    const OperationCount& n = kernel.vector;
    const double width = kernel.width, scalar = sizeof(T);
    state.counters["slots_per_vector"] = n.slots();
    state.counters["cells_per_vector"] = width;
    state.counters["slots_per_16_cells"] = n.slots() * 16 / width;
    state.counters["multiplications_per_vector"] = n.multiplications;
    state.counters["additions_per_vector"] = n.additions;
    state.counters["others_per_vector"] = n.others;
    state.counters["estimates_per_vector"] = n.estimates;
    state.counters["roots_and_divisions_per_vector"] = n.square_roots + n.divisions;
    state.counters["loads_per_vector"] = n.loads;
    state.counters["stores_per_vector"] = n.stores;
    state.counters["bytes_read_per_node"] = (kernel.arrays_read + kernel.arrays_updated) * scalar;
    state.counters["bytes_written_per_node"] = kernel.arrays_updated * scalar;
    state.counters["ns_per_cell_by_arithmetic"] = 1e9 * arithmetic.seconds;
    state.counters["ns_per_cell_by_memory"] = 1e9 * memory;
    state.counters["ns_per_cell"] = 1e9 * step;
    state.counters["median_ns_per_cell"] = 1e9 * median(steps);
    state.counters["fraction_of_limit"] = std::max(arithmetic.seconds, memory) / step;
    state.SetLabel(memory > arithmetic.seconds ? "memory" : arithmetic.by);
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed(
        "%-12s %-10s %-7s %-6s %-8s %8.0f %5.0f %5.0f %5.0f %6.0f %5.0f %5.0f %8.2f %8.2f %8.2f %-10s %6.0f %%",
        mesh_name(row).c_str(), name(row.model).c_str(), std::string(name(row.instruction_set)).c_str(),
        std::string(name(row.precision)).c_str(), std::string(name(row.accuracy)).c_str(),
        counter(run, "slots_per_16_cells"), counter(run, "multiplications_per_vector"),
        counter(run, "additions_per_vector"),
        counter(run, "others_per_vector") + counter(run, "estimates_per_vector") +
            counter(run, "roots_and_divisions_per_vector"),
        counter(run, "stores_per_vector"), counter(run, "bytes_read_per_node"), counter(run, "bytes_written_per_node"),
        counter(run, "ns_per_cell_by_arithmetic"), counter(run, "ns_per_cell_by_memory"), counter(run, "ns_per_cell"),
        run.report_label.c_str(), 100 * counter(run, "fraction_of_limit"));
}

/// "limits/step/32x32x32/HybMSS/flat-rows/avx512/float/threads:1". In a round, a slice of the step and a slice of every
/// loop that bounds it. Limits are made of the fastest round of each (of the whole run, for `times`), so the step's
/// fastest round stands against them: a limit that was measured while somebody else had the core would be none.
Row step_limits_row(const BenchRow& row, double seconds, std::shared_ptr<FastestTimes> times) {
    const std::string heading =
        printed("%-12s %-10s %-7s %-6s %-8s %8s %5s %5s %5s %6s %5s %5s %8s %8s %8s %-10s %8s", "ns/cell", "model",
                "isa", "type", "acc.", "slots/16", "mul", "add", "other", "stores", "B in", "B out", "arith.", "memory",
                "measured", "bound by", "reached");
    return {"limits/" + name(row),
            1,
            heading,
            std::max(3L, std::lround(seconds / (8 * kLimitSlice))),
            [row, times](benchmark::State& state) {
                row.precision == Precision::float32 ? measure<float>(state, row, *times)
                                                    : measure<double>(state, row, *times);
            },
            [row](const auto& run) { return line(row, run); }};
}

} // namespace

Table limits_benchmark(const RowChoices& choices) {
    if (!choices.layouts.empty()) {
        throw std::invalid_argument("--layout: the limits are those of flat-rows");
    }
    Table table{kIntroduction, {}};
    const auto times = std::make_shared<FastestTimes>();
    for (InstructionSet set : choices.instruction_sets) {
        for (Precision precision : choices.precisions) {
            table.rows.push_back(issue_row(set, precision, choices.seconds, times));
        }
        table.rows.push_back(bandwidth_row(set, choices.seconds));
        for (Precision precision : choices.precisions) {
            for (int edge : {20, 32, 64}) {
                for (Model model : {Model::hybmss, Model::without_face_diagonals, Model::without_correction_forces}) {
                    table.rows.push_back(
                        step_limits_row({{edge, edge, edge}, model, "flat-rows", set, precision, 1, choices.accuracy},
                                        choices.seconds, times));
                }
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
