#include "app/tune_rows.hpp"

#include "bench/standard_bodies.hpp"
#include "plan/tuning/candidates.hpp"
#include "plan/tuning/tuner.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <random>

namespace hybmss {
namespace {

struct Variant {
    const char* name;
    double face_diagonal_ratio;
    VolumeEnergy volume_energy;
    bool for_networks; ///< networks know neither face diagonals nor, where they have no cells, a volume energy
};

constexpr Variant kVariants[] = {{"HybMSS", 1, VolumeEnergy::quadratic, true},
                                 {"HybMSS mean-stretch", 1, VolumeEnergy::mean_stretch, false},
                                 {"HybMSS-FD", 0, VolumeEnergy::quadratic, false},
                                 {"HybMSS-CF", 1, VolumeEnergy::none, true}};

std::string row_name(const std::string& body, bool network, Precision precision, bool forces) {
    return std::string(forces ? "forces " : "step ") + body + (network ? " as network " : " ") +
           std::string(name(precision));
}

template <class Planned>
std::shared_ptr<Planned> make(const TuneRow& row, const PlanOptions& options) {
    return row.network ? std::make_shared<Planned>(*row.network, options)
                       : std::make_shared<Planned>(row.lattice, row.material, options);
}

template <class T>
std::vector<T> small_displacements(const TuneRow& row, std::size_t nodes) {
    std::mt19937 engine(1);
    std::vector<T> u(3 * nodes);
    for (T& value : u) {
        value = static_cast<T>(1e-5 * row.lattice.cell_size() * (static_cast<double>(engine()) / 2147483648.0 - 1));
    }
    return u;
}

template <class T>
Trial make_trial(const TuneRow& row, const PlanOptions& options) {
    if (row.forces) {
        const auto plan = make<ForcePlan<T>>(row, options);
        const std::size_t n = plan->node_count();
        const auto u = std::make_shared<std::vector<T>>(small_displacements<T>(row, n));
        const auto f = std::make_shared<std::vector<T>>(3 * n, T(0));
        return timed([=](long steps) {
            for (long s = 0; s < steps; ++s) {
                plan->add_forces(VectorField<const T>::aos(u->data(), n), VectorField<T>::aos(f->data(), n));
            }
        });
    }
    const auto dynamics = make<ExplicitDynamics<T>>(row, options);
    const std::size_t n = dynamics->node_count();
    const std::vector<T> u = small_displacements<T>(row, n);
    dynamics->set_displacements(VectorField<const T>::aos(u.data(), n));
    return timed([dynamics, step = StepParameters{0.2 * dynamics->critical_time_step(), {0, 0, 0}, 0}](long steps) {
        dynamics->step(step, steps);
    });
}

PlanOptions options_of(const TuneRow& row, PlanOptions options) {
    options.threads = row.threads == 0 ? options.threads : row.threads;
    return options;
}

template <class T>
PlanDescription describe_as(const TuneRow& row, const PlanOptions& options) {
    return row.forces ? make<ForcePlan<T>>(row, options)->describe()
                      : make<ExplicitDynamics<T>>(row, options)->describe();
}

} // namespace

TuneRow tune_row(const std::string& scene_name, const Lattice& lattice, const Material& material, Precision precision,
                 bool forces) {
    return {row_name(scene_name, false, precision, forces), lattice, material, nullptr, precision, forces};
}

std::vector<TuneRow> tune_matrix(const std::vector<Precision>& precisions, bool forces) {
    std::vector<TuneRow> rows;
    for (int half_steps = 18; half_steps <= 36; ++half_steps) {
        const int edge = static_cast<int>(std::lround(std::exp2(half_steps / 6.0))) - 1;
        const std::string cube = std::to_string(edge) + "^3";
        for (const Variant& variant : kVariants) {
            Material material;
            material.poisson_ratio = 0.4;
            material.face_diagonal_ratio = variant.face_diagonal_ratio;
            material.volume_energy = variant.volume_energy;
            for (const bool network : {false, true}) {
                if (network && (!variant.for_networks || half_steps > 32)) {
                    continue;
                }
                const Lattice lattice = Lattice::box(edge, edge, edge, 0.1);
                const auto given =
                    network ? std::make_shared<Network>(Network::from_lattice(lattice, material)) : nullptr;
                for (const Precision precision : precisions) {
                    rows.push_back({row_name(cube + " " + variant.name, network, precision, forces), lattice, material,
                                    given, precision, forces});
                }
            }
        }
    }
    return rows;
}

std::vector<TuneRow> check_rows(const std::vector<Precision>& precisions, bool forces, int threads) {
    constexpr double kCellSize = 0.1;
    constexpr std::array<std::array<int, 3>, 14> kBoxes = {{{5, 5, 4},
                                                            {10, 10, 10},
                                                            {20, 20, 20},
                                                            {32, 32, 32},
                                                            {64, 64, 64},
                                                            {100, 100, 100},
                                                            {40, 40, 3},
                                                            {96, 96, 8},
                                                            {3, 60, 60},
                                                            {4, 4, 24},
                                                            {60, 4, 4},
                                                            {8, 8, 48},
                                                            {2, 2, 200},
                                                            {16, 16, 96}}};
    Material material, springs_alone;
    material.poisson_ratio = springs_alone.poisson_ratio = 0.4;
    springs_alone.volume_energy = VolumeEnergy::none;
    std::vector<TuneRow> bodies;
    const auto append = [&](const std::string& name, const Lattice& lattice, std::shared_ptr<const Network> network) {
        bodies.push_back({name, lattice, material, std::move(network)});
    };
    for (const auto& [nx, ny, nz] : kBoxes) {
        append(std::to_string(nx) + "x" + std::to_string(ny) + "x" + std::to_string(nz),
               Lattice::box(nx, ny, nz, kCellSize), nullptr);
    }
    append("hollow-ball-24", hollow_ball(24, 2, kCellSize), nullptr);
    append("hollow-ball-64", hollow_ball(64, 4, kCellSize), nullptr);
    for (const int percent : {10, 30, 50, 70, 90}) {
        append("scattered-" + std::to_string(percent) + "%", scattered_cells({30, 30, 30}, 0.01 * percent, kCellSize),
               nullptr);
    }
    append("tissue-24", labelled_tissue(24, kCellSize), nullptr);
    append("tissue-48", labelled_tissue(48, kCellSize), nullptr);
    const auto append_network = [&](const std::string& name, const Lattice& lattice, Network network) {
        append(name, lattice, std::make_shared<Network>(std::move(network)));
    };
    const Lattice small = Lattice::box(10, 10, 10, kCellSize), large = Lattice::box(24, 24, 24, kCellSize);
    append_network("10^3-network", small, Network::from_lattice(small, material));
    append_network("24^3-network", large, Network::from_lattice(large, material));
    append_network("24^3-network-at-random", large, shuffled(Network::from_lattice(large, material), 1));
    append_network("24^3-springs-at-random", large, shuffled(Network::from_lattice(large, springs_alone), 1));
    const Network half = Network::from_lattice(Lattice::box(12, 12, 12, kCellSize), material);
    append_network("two-12^3-glued", Lattice::box(12, 12, 24, kCellSize),
                   glued(half, half, {0, 0, 12.5 * kCellSize}, 0.6 * kCellSize, 100));

    std::vector<int> thread_counts = {1};
    if (threads != 1) {
        thread_counts.push_back(threads);
    }
    std::vector<TuneRow> rows;
    for (TuneRow& body : bodies) {
        body.forces = forces;
        for (const Precision precision : precisions) {
            for (const int most : thread_counts) {
                rows.push_back(body);
                rows.back().name = row_name(body.name, false, precision, forces) + (most == 1 ? " 1 thread" : "");
                rows.back().precision = precision;
                rows.back().threads = most;
            }
        }
    }
    return rows;
}

PlanDescription describe_plan(const TuneRow& row, const PlanOptions& given) {
    const PlanOptions options = options_of(row, given);
    return row.precision == Precision::float32 ? describe_as<float>(row, options) : describe_as<double>(row, options);
}

std::vector<ExhaustiveFigure> time_exhaustively(const TuneRow& row, const PlanOptions& given, double seconds,
                                                const std::vector<std::string>& kept) {
    constexpr double kSlice = 10e-3;
    constexpr std::size_t kFinalists = 6;
    constexpr double kHopeless = 2.5;
    const PlanOptions options = options_of(row, given);
    const std::size_t nodes = row.network ? row.network->masses.size() : row.lattice.grid_node_count();
    const auto trial = [&](const Candidate& candidate) {
        const PlanOptions fixed = fixed_options(options, candidate);
        return row.precision == Precision::float32 ? make_trial<float>(row, fixed) : make_trial<double>(row, fixed);
    };
    std::vector<Candidate> tried =
        candidates(row.network ? network_layouts() : layouts_to_try(row.lattice, row.material), options, nodes);
    for (const std::string& text : kept) {
        const std::optional<Candidate> candidate = parse_candidate(text);
        if (candidate && std::find(tried.begin(), tried.end(), *candidate) == tried.end()) {
            tried.push_back(*candidate); // what `estimate` takes may be none of the layouts to try
        }
    }
    std::vector<std::pair<double, Candidate>> brief;
    std::string hopeless; // a layout that lost by far at its first; to build a large body in it takes a while
    double best = HUGE_VAL;
    for (const Candidate& candidate : tried) {
        if (candidate.layout == hopeless) {
            continue;
        }
        brief.emplace_back(time_in_rounds({trial(candidate)}, 3 * kSlice, kSlice, false).front().seconds_a_step,
                           candidate);
        best = std::min(best, brief.back().first);
        hopeless = brief.back().first > kHopeless * best ? candidate.layout : hopeless;
    }
    std::stable_sort(brief.begin(), brief.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::string> names;
    std::vector<Trial> trials;
    for (const auto& [time, candidate] : brief) {
        if (names.size() < kFinalists || std::find(kept.begin(), kept.end(), name(candidate)) != kept.end()) {
            names.push_back(name(candidate));
            trials.push_back(trial(candidate));
        }
    }
    const std::vector<TrialTiming> timings =
        time_in_rounds(trials, seconds * static_cast<double>(trials.size()), kSlice, false);
    const std::size_t cells = !row.network                 ? row.lattice.cell_count()
                              : row.network->cells.empty() ? nodes
                                                           : row.network->cells.size();
    std::vector<ExhaustiveFigure> figures;
    for (std::size_t i = 0; i < names.size(); ++i) {
        figures.push_back({names[i], 1e9 * timings[i].seconds_a_step / static_cast<double>(cells)});
    }
    std::sort(figures.begin(), figures.end(),
              [](const auto& a, const auto& b) { return a.ns_per_cell_step < b.ns_per_cell_step; });
    return figures;
}

} // namespace hybmss
