#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/limits/operation_count.hpp"
#include "bench/moving_body.hpp"
#include "bench/standard_bodies.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

constexpr const char* kIntroduction = "Two bodies in the same rounds; medians of the rounds' ratios. `by count`: the "
                                      "speed-up if time went by the vector\n"
                                      "operations of the inner loop; `random / ordered`, `/ 64^3`: time of a step, or "
                                      "of a filled cell, over the other's.\n";

template <class T>
void measure_model(benchmark::State& state, const BenchRow& row) {
    BenchRow full_row = row;
    full_row.model = Model::hybmss;
    ExplicitDynamics<T> model = row_dynamics<T>(row), full = row_dynamics<T>(full_row);
    const StepParameters model_steps = gentle_steps(model), full_steps = gentle_steps(full);
    const auto [times, full_times] = in_turns(
        state, [&](long steps) { model.step(model_steps, steps); }, [&](long steps) { full.step(full_steps, steps); });
    if (!all_finite(model) || !all_finite(full)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const double cells = static_cast<double>(model.describe().cells);
    const double slots = count_operations(row).vector.slots(), full_slots = count_operations(full_row).vector.slots();
    state.counters["ns_per_cell"] = 1e9 * median(times) / cells;
    state.counters["full_ns_per_cell"] = 1e9 * median(full_times) / cells;
    state.counters["operations_share"] = slots / full_slots;
    state.counters["speed_up"] = median_ratio(full_times, times);
    state.counters["speed_up_by_count"] = full_slots / slots;
}

std::string model_line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-12s %-10s %-7s %-6s %7d %8.2f %8.2f %10.1f %% %9.2f %9.2f %8.0f %%", mesh_name(row).c_str(),
                   name(row.model).c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "ns_per_cell"),
                   counter(run, "full_ns_per_cell"), 100 * counter(run, "operations_share"), counter(run, "speed_up"),
                   counter(run, "speed_up_by_count"),
                   100 * counter(run, "speed_up") / counter(run, "speed_up_by_count"));
}

/// "ratio/models/...": HybMSS-CF and HybMSS-FD against the full model, and how far leaving out so many operations
/// should bring them.
Row model_row(const BenchRow& row, double seconds) {
    return {"ratio/models" + name(row, ""),
            row.threads,
            printed("%-12s %-10s %-7s %-6s %7s %8s %8s %12s %9s %9s %10s", "models", "model", "isa", "type", "threads",
                    "ns/cell", "full", "operations", "speed-up", "by count", "reached"),
            std::max(3L, std::lround(seconds / (2 * kSliceSeconds))),
            [row](benchmark::State& state) {
                row.precision == Precision::float32 ? measure_model<float>(state, row)
                                                    : measure_model<double>(state, row);
            },
            [row](const auto& run) { return model_line(row, run); }};
}

template <class T>
void measure_numbering(benchmark::State& state, const BenchRow& row) {
    const Network network = Network::from_lattice(row_lattice(row), row_material(row));
    const PlanOptions options = row_options(row);
    ExplicitDynamics<T> ordered(network, options), random(shuffled(network, 1), options);
    disturb(ordered, row_lattice(row).cell_size());
    disturb(random, row_lattice(row).cell_size());
    const StepParameters parameters = gentle_steps(ordered);
    const auto [times, ordered_times] = in_turns(
        state, [&](long steps) { random.step(parameters, steps); },
        [&](long steps) { ordered.step(parameters, steps); });
    if (!all_finite(ordered) || !all_finite(random)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    const double springs = static_cast<double>(network.springs.size());
    state.counters["ns_per_spring"] = 1e9 * median(times) / springs;
    state.counters["ordered_ns_per_spring"] = 1e9 * median(ordered_times) / springs;
    state.counters["ratio_to_ordered"] = median_ratio(times, ordered_times);
    state.counters["bytes_per_spring"] = static_cast<double>(random.describe().bytes) / springs;
    state.SetLabel(random.describe().layout);
}

std::string numbering_line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-12s %-10s %-12s %-7s %-6s %7d %10.2f %10.2f %8.1f %17.2f", mesh_name(row).c_str(),
                   name(row.model).c_str(), run.report_label.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "ns_per_spring"),
                   counter(run, "ordered_ns_per_spring"), counter(run, "bytes_per_spring"),
                   counter(run, "ratio_to_ordered"));
}

/// "ratio/numbering/...": the row's body as a network whose nodes and springs come in random order, against the same
/// one in the lattice's order.
Row numbering_row(const BenchRow& row, double seconds) {
    return {"ratio/numbering" + name(row, ""),
            row.threads,
            printed("%-12s %-10s %-12s %-7s %-6s %7s %10s %10s %8s %17s", "numbering", "model", "layout", "isa", "type",
                    "threads", "ns/spring", "ordered", "B/spring", "random / ordered"),
            std::max(3L, std::lround(seconds / (2 * kSliceSeconds))),
            [row](benchmark::State& state) {
                row.precision == Precision::float32 ? measure_numbering<float>(state, row)
                                                    : measure_numbering<double>(state, row);
            },
            [row](const auto& run) { return numbering_line(row, run); }};
}

constexpr int kSmallEdge = 64;

template <class T>
void measure_filled(benchmark::State& state, const BenchRow& row) {
    BenchRow small_row = row;
    small_row.mesh = {kSmallEdge, kSmallEdge, kSmallEdge};
    ExplicitDynamics<T> ball = row_dynamics<T>(row), small = row_dynamics<T>(small_row);
    const StepParameters parameters = gentle_steps(ball);
    const auto [times, small_times] = in_turns(
        state, [&](long steps) { ball.step(parameters, steps); }, [&](long steps) { small.step(parameters, steps); });
    const PlanDescription plan = ball.describe(), small_plan = small.describe();
    const double cells = static_cast<double>(plan.cells), small_cells = static_cast<double>(small_plan.cells);
    const double bytes = static_cast<double>(plan.bytes) / cells;
    if (!all_finite(ball) || !all_finite(small)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    state.counters["cells"] = cells;
    state.counters["filled"] = cells / std::pow(row.mesh[0], 3);
    state.counters["ns_per_cell"] = 1e9 * median(times) / cells;
    state.counters["ratio_to_64"] = median_ratio(times, small_times) * small_cells / cells;
    state.counters["bytes_per_cell"] = bytes;
    state.counters["bytes_ratio_to_64"] = bytes / (static_cast<double>(small_plan.bytes) / small_cells);
    state.SetLabel(plan.layout);
}

std::string filled_line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-16s %-12s %-7s %-6s %7d %9.0f %7.1f %% %9.2f %8.2f %10.1f %8.2f", mesh_name(row).c_str(),
                   run.report_label.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), row.threads, counter(run, "cells"),
                   100 * counter(run, "filled"), counter(run, "ns_per_cell"), counter(run, "ratio_to_64"),
                   counter(run, "bytes_per_cell"), counter(run, "bytes_ratio_to_64"));
}

/// "ratio/filled/...": a hollow ball in a large grid against one of the same wall in a grid of 64^3: time and memory of
/// a filled cell, whatever the grid.
Row filled_row(const BenchRow& row, double seconds) {
    return {"ratio/filled" + name(row, ""),
            row.threads,
            printed("%-16s %-12s %-7s %-6s %7s %9s %9s %9s %8s %10s %8s", "filled", "layout", "isa", "type", "threads",
                    "cells", "of grid", "ns/cell", "/ 64^3", "bytes/cell", "/ 64^3"),
            std::max(3L, std::lround(seconds / (2 * kSliceSeconds))),
            [row](benchmark::State& state) {
                row.precision == Precision::float32 ? measure_filled<float>(state, row)
                                                    : measure_filled<double>(state, row);
            },
            [row](const auto& run) { return filled_line(row, run); }};
}

} // namespace

Table ratio_benchmark(const RowChoices& asked) {
    Table table{kIntroduction, {}};
    const auto append = [&](auto make, std::array<int, 3> mesh, Model model, const char* layout, int wall) {
        RowChoices choices = asked.with_layouts({});
        choices.layouts = {layout};
        for_rows(choices, mesh, model, wall,
                 [&](const BenchRow& row) { table.rows.push_back(make(row, choices.seconds)); });
    };
    for (const int edge : {20, 32, 64}) {
        for (const Model model : {Model::without_correction_forces, Model::without_face_diagonals}) {
            append(model_row, {edge, edge, edge}, model, "flat-rows", 0);
        }
    }
    for (const Model model : {Model::hybmss, Model::without_correction_forces}) {
        append(numbering_row, {64, 64, 64}, model, "network", 0);
    }
    for (const int edge : {128, 256}) {
        append(filled_row, {edge, edge, edge}, Model::hybmss, "lattice", 4);
    }
    return table;
}

} // namespace hybmss::bench
