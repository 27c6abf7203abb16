#include "app/tune_rows.hpp"

#include "bench/standard_bodies.hpp"
#include "plan/tuning/candidates.hpp"
#include "plan/tuning/tuner.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
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
    return row.as_network ? std::make_shared<Planned>(Network::from_lattice(row.lattice, row.material), options)
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

template <class T>
PlanDescription describe_as(const TuneRow& row, const PlanOptions& options) {
    return row.forces ? make<ForcePlan<T>>(row, options)->describe()
                      : make<ExplicitDynamics<T>>(row, options)->describe();
}

} // namespace

TuneRow tune_row(const std::string& scene_name, const Lattice& lattice, const Material& material, Precision precision,
                 bool forces) {
    return {row_name(scene_name, false, precision, forces), lattice, material, false, precision, forces};
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
                for (const Precision precision : precisions) {
                    rows.push_back({row_name(cube + " " + variant.name, network, precision, forces),
                                    Lattice::box(edge, edge, edge, 0.1), material, network, precision, forces});
                }
            }
        }
    }
    return rows;
}

std::vector<TuneRow> check_rows(const std::vector<Precision>& precisions, bool forces) {
    constexpr double kCellSize = 0.1;
    std::vector<std::pair<std::string, Lattice>> bodies;
    for (const auto& [nx, ny, nz] : kTable6) {
        bodies.emplace_back(std::to_string(nx) + "x" + std::to_string(ny) + "x" + std::to_string(nz),
                            Lattice::box(nx, ny, nz, kCellSize));
    }
    bodies.emplace_back("hollow-ball-64", hollow_ball(64, 4, kCellSize));
    Material material;
    material.poisson_ratio = 0.4;
    std::vector<TuneRow> rows;
    for (const auto& [name, lattice] : bodies) {
        for (const Precision precision : precisions) {
            rows.push_back(tune_row(name, lattice, material, precision, forces));
        }
    }
    return rows;
}

PlanDescription describe_plan(const TuneRow& row, const PlanOptions& options) {
    return row.precision == Precision::float32 ? describe_as<float>(row, options) : describe_as<double>(row, options);
}

std::vector<ExhaustiveFigure> time_exhaustively(const TuneRow& row, const PlanOptions& options, double seconds) {
    constexpr double kSlice = 10e-3;
    const std::vector<Candidate> tried =
        candidates(row.as_network ? network_layouts() : layouts_to_try(row.lattice, row.material), options,
                   row.lattice.grid_node_count());
    std::vector<Trial> trials;
    for (const Candidate& candidate : tried) {
        const PlanOptions fixed = fixed_options(options, candidate);
        trials.push_back(row.precision == Precision::float32 ? make_trial<float>(row, fixed)
                                                             : make_trial<double>(row, fixed));
    }
    const std::vector<TrialTiming> timings =
        time_in_rounds(trials, seconds * static_cast<double>(trials.size()), kSlice, false);
    std::vector<ExhaustiveFigure> figures;
    for (std::size_t i = 0; i < tried.size(); ++i) {
        figures.push_back(
            {name(tried[i]), 1e9 * timings[i].seconds_a_step / static_cast<double>(row.lattice.cell_count())});
    }
    std::sort(figures.begin(), figures.end(),
              [](const auto& a, const auto& b) { return a.ns_per_cell_step < b.ns_per_cell_step; });
    return figures;
}

} // namespace hybmss
