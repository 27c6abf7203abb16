#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "hybmss/separation.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace hybmss::bench {

namespace {

constexpr long kCuts = 100, kSeparations = 5;

constexpr const char* kIntroduction = "Cells removed from a moving body, cubes of cells at random places, a step "
                                      "before each cut; medians of 100 cuts.\n"
                                      "`anew`: the time to build the body instead, by that of a cut.\n"
                                      "network: as many faces parted instead, by layers; the cut is separate(), a plan "
                                      "of what it gives, and\n"
                                      "the state brought over, `anew` the same of the whole body; medians of 5.\n";

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void report(benchmark::State& state, std::size_t count, const std::vector<double>& cuts, double anew) {
    state.counters["removed_cells"] = static_cast<double>(count);
    state.counters["us_per_cut"] = 1e6 * median(cuts);
    state.counters["ns_per_removed_cell"] = 1e9 * median(cuts) / static_cast<double>(count);
    state.counters["anew_per_cut"] = anew / median(cuts);
}

/// The low corners of the cubes of `edge` cells that the mesh consists of, shuffled.
std::vector<std::array<int, 3>> places_of(const BenchRow& row, int edge, std::mt19937& engine) {
    std::vector<std::array<int, 3>> places;
    for (int k = 0; k + edge <= row.mesh[2]; k += edge) {
        for (int j = 0; j + edge <= row.mesh[1]; j += edge) {
            for (int i = 0; i + edge <= row.mesh[0]; i += edge) {
                places.push_back({i, j, k});
            }
        }
    }
    std::shuffle(places.begin(), places.end(), engine);
    return places;
}

/// The first `count` of them.
std::vector<std::uint32_t> cube(const Lattice& lattice, const std::array<int, 3>& low, int edge, std::size_t count) {
    std::vector<std::uint32_t> cells;
    for (int k = 0; k < edge; ++k) {
        for (int j = 0; j < edge; ++j) {
            for (int i = 0; i < edge; ++i) {
                cells.push_back(static_cast<std::uint32_t>(lattice.cell_index(low[0] + i, low[1] + j, low[2] + k)));
            }
        }
    }
    cells.resize(count);
    return cells;
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row, std::size_t count) {
    const int edge = static_cast<int>(std::ceil(std::cbrt(static_cast<double>(count)) - 1e-9));
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
        const std::vector<std::uint32_t> cells = cube(lattice, places[next++], edge, count);
        start = std::chrono::steady_clock::now();
        body->remove_cells(lattice, cells);
        cuts.push_back(seconds_since(start));
        state.SetIterationTime(cuts.back());
    }
    report(state, count, cuts, anew);
    state.SetLabel(body->describe().layout);
}

/// Faces between layers of cells along z, a quarter of the body apart.
std::vector<std::array<std::uint32_t, 2>> faces_of(const Lattice& lattice, std::size_t count) {
    const auto [nx, ny, nz] = lattice.cells();
    std::vector<std::array<std::uint32_t, 2>> faces;
    for (int k = nz / 4; k < nz && faces.size() < count; k += nz / 4) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx && faces.size() < count; ++i) {
                faces.push_back({static_cast<std::uint32_t>(lattice.cell_index(i, j, k - 1)),
                                 static_cast<std::uint32_t>(lattice.cell_index(i, j, k))});
            }
        }
    }
    return faces;
}

template <class T>
void measure_separation(benchmark::State& state, const BenchRow& row, std::size_t count) {
    const Lattice lattice = row_lattice(row);
    const Material material = row_material(row);
    const std::vector<std::array<std::uint32_t, 2>> faces = faces_of(lattice, count);
    PlanOptions options = row_options(row);
    options.layout.clear();
    auto start = std::chrono::steady_clock::now();
    const SeparatedNetwork whole = separate(lattice, material, {});
    ExplicitDynamics<T> before(whole.network, options);
    const double anew = seconds_since(start);
    before.step(gentle_steps(before), 1);
    std::vector<double> cuts;
    for ([[maybe_unused]] auto _ : state) {
        start = std::chrono::steady_clock::now();
        const SeparatedNetwork parted = separate(lattice, material, faces);
        ExplicitDynamics<T> after(parted.network, options);
        const std::vector<std::uint32_t> from = nodes_before(whole, parted);
        std::vector<T> old(3 * before.node_count()), state_of(3 * from.size());
        for (const bool moves : {false, true}) {
            const auto out = VectorField<T>::aos(old.data(), before.node_count());
            moves ? before.get_velocities(out) : before.get_displacements(out);
            for (std::size_t n = 0; n < from.size(); ++n) {
                std::copy_n(old.begin() + 3 * static_cast<std::ptrdiff_t>(from[n]), 3,
                            state_of.begin() + 3 * static_cast<std::ptrdiff_t>(n));
            }
            const auto in = VectorField<const T>::aos(state_of.data(), from.size());
            moves ? after.set_velocities(in) : after.set_displacements(in);
        }
        cuts.push_back(seconds_since(start));
        state.SetIterationTime(cuts.back());
    }
    report(state, count, cuts, anew);
    state.SetLabel(before.describe().layout);
}

} // namespace

Table cutting_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({"flat-rows", "active-rows", "network"});
    const std::string heading = printed("%-14s %-12s %-7s %-6s %8s %10s %16s %10s", "mesh", "layout", "isa", "type",
                                        "cut", "us/cut", "ns/cell or face", "anew");
    Table table{kIntroduction, {}};
    for (const std::string& layout : choices.layouts) {
        for (Precision precision : choices.precisions) {
            for (const int mesh : {20, 60}) {
                for (const std::size_t count : {std::size_t{1}, std::size_t{10}, std::size_t{100}, std::size_t{1000}}) {
                    const BenchRow row = {
                        {mesh, mesh, mesh}, Model::hybmss, layout, choices.instruction_sets.back(), precision, 1,
                        choices.accuracy};
                    const bool parts = layout == "network";
                    const std::string of = (parts ? "/faces:" : "/removed:") + std::to_string(count);
                    table.rows.push_back(
                        {name(row, "cut") + of, 1, heading, parts ? kSeparations : kCuts,
                         [row, parts, count](benchmark::State& state) {
                             const bool single = row.precision == Precision::float32;
                             if (parts) {
                                 single ? measure_separation<float>(state, row, count)
                                        : measure_separation<double>(state, row, count);
                             } else {
                                 single ? measure<float>(state, row, count) : measure<double>(state, row, count);
                             }
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
