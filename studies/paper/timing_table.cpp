#include "studies/paper/tables.hpp"

#include "hybmss/simulation/simulation.hpp"
#include "plan/tuning/wisdom_store.hpp"
#include "simulation/scene/scene_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

namespace hybmss::paper {
namespace {

constexpr std::size_t kRounds = 200;
constexpr double kSliceSeconds = 0.001; // seldom cut off by what else runs
constexpr double kPoissonRatio = 0.499; // any with a volume force

double timed(Simulation& simulation, long steps) {
    const auto start = std::chrono::steady_clock::now();
    simulation.step(steps);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The models, and last HybMSS-M with face diagonals.
std::array<Material, std::size(kModels) + 1> timed_materials() {
    std::array<Material, std::size(kModels) + 1> all;
    all.fill(with_model({.poisson_ratio = kPoissonRatio}, Model::hybmss_m));
    std::ranges::transform(kModels, all.begin(),
                           [](Model model) { return with_model({.poisson_ratio = kPoissonRatio}, model); });
    all.back().face_diagonal_ratio = 1;
    return all;
}

using PerMaterial = std::array<double, std::size(kModels) + 1>;

/// As the print did it: a cube between plates, of which one is led by 20 % in 10 s, or a beam that is held at one end
/// and falls under its weight.
Scene timed_scene(const Experiment& experiment, const Material& material) {
    Scene timed = scene(experiment);
    timed.material = material;
    timed.material.young_modulus = experiment.young_modulus;
    timed.solver.method = SolverMethod::symplectic_euler;
    timed.solver.duration = 1e9;
    timed.damping.mass = 2;
    for (Move& move : timed.moves) {
        move.over = 10;
    }
    return timed;
}

/// Seconds a step of each. The best of many short slices in turns, each round beginning with another model: what
/// else runs on the machine only ever adds time.
PerMaterial step_seconds(const Experiment& experiment) {
    SimulationOptions options;
    options.plan.threads = 1;
    std::vector<Simulation> simulations;
    const auto materials = timed_materials();
    std::array<long, materials.size()> counts{};
    for (std::size_t m = 0; m < materials.size(); ++m) {
        simulations.emplace_back(timed_scene(experiment, materials[m]), options);
        timed(simulations[m], 5); // warms up
        counts[m] = std::max(1L, static_cast<long>(kSliceSeconds / (timed(simulations[m], 5) / 5)));
    }
    PerMaterial best;
    best.fill(std::numeric_limits<double>::infinity());
    for (std::size_t slice = 0; slice < kRounds * materials.size(); ++slice) {
        const std::size_t m = (slice + slice / materials.size()) % materials.size();
        best[m] = std::min(best[m], timed(simulations[m], counts[m]) / static_cast<double>(counts[m]));
    }
    return best;
}

} // namespace

/// The print shows its times as curves; numbers are in its words only.
Table timing_table(TableContext& context) {
    Table table{
        "timing",
        "Section 6.3: time, on the meshes of Table 6",
        {"As the print did it: cubes between plates, of which one is led, 1,000 steps (Fig. 11); beams held at one end "
         "under gravity, 300,000 steps (Fig. 12), extrapolated here from the time of fewer. Scenes in double on one "
         "thread, "
         "nu = 0.499. Springs as the print counts them, and merged as they are computed. The print gives curves and "
         "means: HybMSS-CF takes 1.4 and HybMSS 2.1 times as long as HybMSS-FD. Best of 200 short slices, the models "
         "in "
         "turns. [The curves](../gallery.md#the-papers-figures)."},
        {{"mesh", "mesh"},
         {"cells", "cells", 0},
         {"springs_without_face_diagonals", "springs, no FD", 0},
         {"springs", "with FD", 0},
         {"merged", "merged", 0},
         {"steps", "steps", 0},
         {"hybmss_fd", "FD, s", -4},
         {"hybmss_cf", "CF, s", -4},
         {"hybmss", "HybMSS, s", -4},
         {"hybmss_m", "M, s", -4},
         {"cf_to_fd", "CF / FD", 2},
         {"hybmss_to_fd", "HybMSS / FD", 2},
         {"hybmss_m_to_hybmss", "M / HybMSS", 2},
         {"hybmss_m_1_to_hybmss", "M, A = 1 / HybMSS", 2}},
        {},
        {}};
    std::vector<Experiment> meshes;
    for (const int across : context.quick ? std::vector<int>{10} : std::vector<int>{10, 15, 20, 30}) {
        meshes.push_back({.kind = Kind::compression, .amount = 20, .across = across});
    }
    for (const int across : context.quick ? std::vector<int>{4} : std::vector<int>{4, 8, 10, 16}) {
        meshes.push_back({.kind = Kind::beam, .young_modulus = 1e7, .across = across});
    }
    double thousand_with = 0, thousand_without = 0, cf_sum = 0, hybmss_sum = 0, means_sum = 0, means_with_sum = 0;
    for (const Experiment& experiment : meshes) {
        const auto [nx, ny, nz] = mesh(experiment);
        context.progress(fmt::format("timing {} x {} x {}", nx, ny, nz));
        const Lattice lattice = scene_lattice(scene(experiment));
        const auto [fd, cf, whole, means, means_with_face_diagonals] = step_seconds(experiment);
        const double steps = nx == nz ? 1000 : 300000;
        if (nx == 10 && nz == 10) {
            thousand_without = 1e4 * cf;
            thousand_with = 1e4 * whole;
        }
        cf_sum += cf / fd;
        hybmss_sum += whole / fd;
        means_sum += means / whole;
        means_with_sum += means_with_face_diagonals / whole;
        table.rows.push_back({fmt::format("{} x {} x {}", nx, ny, nz), static_cast<double>(lattice.cell_count()),
                              static_cast<double>(lattice.unmerged_springs(false).total()),
                              static_cast<double>(lattice.unmerged_springs(true).total()),
                              static_cast<double>(lattice.merged_springs(true).total()), steps, steps * fd, steps * cf,
                              steps * whole, steps * means, cf / fd, whole / fd, means / whole,
                              means_with_face_diagonals / whole});
    }
    const auto count = static_cast<double>(meshes.size());
    table.remarks = {
        fmt::format("Means over these meshes: HybMSS-CF {:.2f} and HybMSS {:.2f} times HybMSS-FD; print: 1.4 and 2.1. "
                    "HybMSS-M {:.2f} times HybMSS, with A = 1 {:.2f} times.",
                    cf_sum / count, hybmss_sum / count, means_sum / count, means_with_sum / count),
        fmt::format(
            "10 x 10 x 10, 10,000 steps: {:.3g} s without and {:.3g} s with volume force on one thread of an {}; "
            "print: 2.44 s and 5.579 s on an Intel Core i7-4790K at 4 GHz, {:.0f} and {:.0f} times as long.",
            thousand_without, thousand_with, cpu_model(), 2.44 / thousand_without, 5.579 / thousand_with),
        "Table 6 counts 12 face diagonals a cell; neighbours share them, and here each is computed once."};
    return table;
}

} // namespace hybmss::paper
