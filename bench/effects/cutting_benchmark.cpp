#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <random>

namespace hybmss::bench {

namespace {

constexpr long kCuts = 100;

constexpr const char* kIntroduction = "Cells removed from a moving body, cubes of cells at random places, a step "
                                      "before each cut; medians of 100 cuts.\n"
                                      "`anew`: the time to build the body instead, by that of a cut.\n";

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The low corners of the cubes of `edge` cells that the mesh consists of, shuffled.
std::vector<std::array<int, 3>> places_of(const BenchRow& row, int edge, std::mt19937& engine) {
    std::vector<std::array<int, 3>> places;
    for (int k = 0; k < row.mesh[2]; k += edge) {
        for (int j = 0; j < row.mesh[1]; j += edge) {
            for (int i = 0; i < row.mesh[0]; i += edge) {
                places.push_back({i, j, k});
            }
        }
    }
    std::shuffle(places.begin(), places.end(), engine);
    return places;
}

std::vector<std::uint32_t> cube(const Lattice& lattice, const std::array<int, 3>& low, int edge) {
    std::vector<std::uint32_t> cells;
    for (int k = 0; k < edge; ++k) {
        for (int j = 0; j < edge; ++j) {
            for (int i = 0; i < edge; ++i) {
                cells.push_back(static_cast<std::uint32_t>(lattice.cell_index(low[0] + i, low[1] + j, low[2] + k)));
            }
        }
    }
    return cells;
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row, int edge) {
    std::mt19937 engine(1);
    const std::vector<std::array<int, 3>> places = places_of(row, edge, engine);
    const auto make = [&](const Lattice& lattice) {
        return std::make_unique<ExplicitDynamics<T>>(lattice, row_material(row), row_options(row));
    };
    Lattice lattice = row_lattice(row);
    auto start = std::chrono::steady_clock::now();
    auto body = make(lattice);
    double anew = seconds_since(start);
    std::vector<double> cuts;
    std::size_t next = 0;
    for ([[maybe_unused]] auto _ : state) {
        if (2 * next >= places.size()) { // half of it is gone
            lattice = row_lattice(row);
            start = std::chrono::steady_clock::now();
            body = make(lattice);
            anew = std::min(anew, seconds_since(start));
            next = 0;
        }
        body->step(gentle_steps(*body), 1);
        const std::vector<std::uint32_t> cells = cube(lattice, places[next++], edge);
        start = std::chrono::steady_clock::now();
        body->remove_cells(lattice, cells);
        cuts.push_back(seconds_since(start));
        state.SetIterationTime(cuts.back());
    }
    const double cells = static_cast<double>(edge) * edge * edge;
    state.counters["removed_cells"] = cells;
    state.counters["us_per_cut"] = 1e6 * median(cuts);
    state.counters["ns_per_removed_cell"] = 1e9 * median(cuts) / cells;
    state.counters["anew_per_cut"] = anew / median(cuts);
    state.SetLabel(body->describe().layout);
}

} // namespace

Table cutting_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({"flat-rows", "active-rows"});
    const std::string heading = printed("%-14s %-12s %-7s %-6s %8s %10s %16s %10s", "mesh", "layout", "isa", "type",
                                        "removed", "us/cut", "ns/removed cell", "anew");
    Table table{kIntroduction, {}};
    for (const std::string& layout : choices.layouts) {
        for (Precision precision : choices.precisions) {
            for (const int mesh : {16, 64, 128}) {
                for (const int edge : {2, 4, 8}) {
                    const BenchRow row = {
                        {mesh, mesh, mesh}, Model::hybmss, layout, choices.instruction_sets.back(), precision, 1,
                        choices.accuracy};
                    const std::string removed = "/removed:" + std::to_string(edge * edge * edge);
                    table.rows.push_back(
                        {name(row, "cut") + removed, 1, heading, kCuts,
                         [row, edge](benchmark::State& state) {
                             row.precision == Precision::float32 ? measure<float>(state, row, edge)
                                                                 : measure<double>(state, row, edge);
                         },
                         [row](const auto& run) {
                             return printed("%-14s %-12s %-7s %-6s %8.0f %10.1f %16.1f %10.0f", mesh_name(row).c_str(),
                                            run.report_label.c_str(), std::string(name(row.instruction_set)).c_str(),
                                            std::string(name(row.precision)).c_str(), counter(run, "removed_cells"),
                                            counter(run, "us_per_cut"), counter(run, "ns_per_removed_cell"),
                                            counter(run, "anew_per_cut"));
                         }});
                }
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
