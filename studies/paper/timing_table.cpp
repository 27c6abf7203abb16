#include "studies/paper/tables.hpp"

#include "hybmss/explicit_dynamics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

namespace hybmss::paper {
namespace {

constexpr std::size_t kRounds = 60;
constexpr double kSliceSeconds = 0.004; // other programs get the core for as long
constexpr double kPoissonRatio = 0.499; // any with a volume force

double timed(ExplicitDynamics<double>& dynamics, const StepParameters& step, long count) {
    const auto start = std::chrono::steady_clock::now();
    dynamics.step(step, count);
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

/// Seconds a step of each. The best of many short slices in turns, each round beginning with another model: what
/// else runs on the machine only ever adds time.
PerMaterial step_seconds(const Lattice& lattice) {
    PlanOptions options;
    options.threads = 1;
    std::vector<ExplicitDynamics<double>> dynamics;
    const auto materials = timed_materials();
    std::array<long, materials.size()> counts{};
    StepParameters step;
    for (std::size_t m = 0; m < materials.size(); ++m) {
        dynamics.emplace_back(lattice, materials[m], options);
        step.time_step = 0.5 * dynamics[m].critical_time_step();
        timed(dynamics[m], step, 5); // warms up
        counts[m] = std::max(1L, static_cast<long>(kSliceSeconds / (timed(dynamics[m], step, 5) / 5)));
    }
    PerMaterial best;
    best.fill(std::numeric_limits<double>::infinity());
    for (std::size_t slice = 0; slice < kRounds * materials.size(); ++slice) {
        const std::size_t m = (slice + slice / materials.size()) % materials.size();
        best[m] = std::min(best[m], timed(dynamics[m], step, counts[m]) / static_cast<double>(counts[m]));
    }
    return best;
}

} // namespace

/// The print shows its times as curves; numbers are in its words only.
Table timing_table(TableContext& context) {
    Table table{
        "timing",
        "Section 6.3: time, on the meshes of Table 6",
        {"Explicit steps in double on one thread, nu = 0.499, as in the print 1,000 for cubes and 300,000 for beams "
         "(computed from the time of fewer). Springs as the print counts them, and merged as they are "
         "computed. The print gives curves (Fig. 11 and 12) and means: HybMSS-CF takes 1.4 and HybMSS 2.1 "
         "times as long as HybMSS-FD. Best of 60 short slices, the models in turns."},
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
    std::vector<std::array<int, 3>> meshes = {{10, 10, 10}, {15, 15, 15}, {20, 20, 20}, {30, 30, 30},
                                              {4, 4, 24},   {8, 8, 48},   {10, 10, 60}, {16, 16, 96}};
    if (context.quick) {
        meshes = {{10, 10, 10}, {4, 4, 24}};
    }
    double thousand_with = 0, thousand_without = 0, cf_sum = 0, hybmss_sum = 0, means_sum = 0, means_with_sum = 0;
    for (const auto& [nx, ny, nz] : meshes) {
        context.progress(fmt::format("timing {} x {} x {}", nx, ny, nz));
        const Lattice lattice = Lattice::box(nx, ny, nz, 0.5);
        const auto [fd, cf, whole, means, means_with_face_diagonals] = step_seconds(lattice);
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
            "10 x 10 x 10, 10,000 steps: {:.3g} s without and {:.3g} s with volume force; print: 2.44 s and 5.579 s on "
            "an i7-4790K.",
            thousand_without, thousand_with),
        "Table 6 counts 12 face diagonals a cell; neighbours share them, and here each is computed once."};
    return table;
}

} // namespace hybmss::paper
