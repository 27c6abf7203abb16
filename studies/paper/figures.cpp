#include "studies/paper/figures.hpp"

#include "hybmss/simulation/simulation.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/run/readings.hpp"
#include "simulation/scene/scene_body.hpp"
#include "studies/calculix/problem.hpp"
#include "studies/calculix/program.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ostream>
#include <stdexcept>

namespace hybmss::paper {
namespace {

constexpr double kMiddle = 2.5; // m, of the cube's plates

double response(Kind kind, const ProbeReading& plate) {
    const std::size_t axis = response_axis(kind);
    const double value = kind == Kind::torsion ? plate.torque[axis]
                         : kind == Kind::beam  ? plate.mean_displacement[axis]
                                               : plate.force[axis];
    return std::abs(value);
}

double size(Kind kind, const Simulation& simulation, double response) {
    if (kind == Kind::shear) {
        const auto force = simulation.probes().at(0).force;
        return std::hypot(force[0], force[1], force[2]);
    }
    if (kind != Kind::torsion) {
        return response;
    }
    double sum = 0;
    const auto rest = simulation.rest_positions();
    const auto displacements = simulation.displacements(), reactions = simulation.reactions();
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n][1] > 0) { // of the upper plate; between the plates nothing is held
            sum += std::hypot(rest[n][0] + displacements[n][0] - kMiddle, rest[n][2] + displacements[n][2] - kMiddle) *
                   std::hypot(reactions[n][0], reactions[n][2]);
        }
    }
    return sum;
}

template <class Value>
std::vector<Value> picked(const std::vector<Value>& all, const std::vector<std::uint32_t>& which) {
    std::vector<Value> some;
    for (const std::uint32_t n : which) {
        some.push_back(all[n]);
    }
    return some;
}

} // namespace

Figures solve_lattice(const Experiment& experiment, const Material& material) {
    Figures figures;
    const auto start = std::chrono::steady_clock::now();
    Scene problem = scene(experiment);
    problem.material = material;
    Simulation simulation(std::move(problem));
    const Summary summary = simulation.run();
    figures.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    figures.failure = summary.failure;
    figures.volume_change = summary.volume.relative_volume_change;
    figures.response = response(experiment.kind, summary.probes.at(0));
    figures.size = size(experiment.kind, simulation, figures.response);
    figures.pictured = picked(simulation.displacements(), pictured_nodes(experiment));
    if (const std::vector<std::uint32_t> cells = compared_cells(experiment); !cells.empty()) {
        std::vector<std::array<double, 6>> stresses, nominal;
        for (const CellStress& stress : simulation.cell_stresses()) {
            const std::array<double, 9>& p = stress.first_piola;
            stresses.push_back(stress.cauchy);
            nominal.push_back({p[0], p[4], p[8], (p[1] + p[3]) / 2, (p[5] + p[7]) / 2, (p[2] + p[6]) / 2});
        }
        figures.stresses = picked(stresses, cells);
        figures.nominal = picked(nominal, cells);
    }
    return figures;
}

Material with_moduli(Material material, double shear_modulus, double volume_modulus) {
    const double r = volume_modulus / shear_modulus;
    material.poisson_ratio = (1 + r) / (4 + 2 * r);
    material.young_modulus = 2 * shear_modulus * (1 + material.poisson_ratio);
    return material;
}

Material e_form(Material material) {
    return with_moduli(material, 2 * material.young_modulus / 5, volume_modulus(material));
}

std::vector<Motion> move_lattice(const Experiment& experiment, const Material& material) {
    constexpr double kStep = 1e-3;
    constexpr int kSteps = 10000, kBefore = 8000, kSample = 20;
    std::vector<Motion> motions;
    for (const double led_over : {1.0, 10.0}) {
        for (const double damping : {0.0, 0.5, 2.0, 10.0}) {
            Scene moving = scene(experiment);
            moving.material = material;
            moving.solver.method = SolverMethod::symplectic_euler;
            moving.solver.time_step = kStep;
            moving.solver.duration = kStep * kSteps;
            moving.damping.mass = damping;
            moving.moves.at(0).over = led_over;
            Motion& motion = motions.emplace_back(Motion{led_over, damping, "", HUGE_VAL, -HUGE_VAL});
            try {
                Simulation simulation(std::move(moving));
                simulation.step(kBefore);
                for (int step = kBefore; step < kSteps; step += kSample) {
                    simulation.step(kSample);
                    if (simulation.time() < led_over - kStep / 2) {
                        continue; // the plates are not where they are to be yet
                    }
                    Figures now;
                    now.volume_change = simulation.volume_change().relative_volume_change;
                    now.response = response(experiment.kind, simulation.probes().at(0));
                    motion.least = std::min(motion.least, printed_quantity(experiment, now));
                    motion.greatest = std::max(motion.greatest, printed_quantity(experiment, now));
                }
            } catch (const std::runtime_error& error) {
                motion.failure = error.what();
            }
        }
    }
    return motions;
}

Figures solve_lattice(const Experiment& experiment, Model model) {
    return solve_lattice(experiment, with_model(scene(experiment).material, model));
}

std::string name(const ElementChoice& choice) {
    return fmt::format("{} {}", calculix::name(choice.type),
                       choice.law == calculix::Law::neo_hooke ? "neo-Hooke" : calculix::name(choice.geometry));
}

Figures solve_finite_elements(const Experiment& experiment, const ElementChoice& choice) {
    const Scene origin = scene(experiment);
    calculix::Problem problem = calculix::scene_problem(origin, choice.type, choice.geometry, choice.law);
    const std::vector<std::uint32_t> cells = compared_cells(experiment);
    problem.stresses = !cells.empty();
    if (!calculix::is_installed()) {
        throw std::runtime_error(calculix::kNotInstalled);
    }
    Figures figures;
    calculix::Solution solution;
    try {
        solution = calculix::solve(problem);
    } catch (const std::runtime_error& error) {
        figures.failure = error.what();
        return figures;
    }
    const Lattice lattice = scene_lattice(origin);
    const std::span<const Vector3> rest = problem.mesh.rest;
    const Region& where = origin.probes.at(0).where;
    const std::vector<std::uint32_t> nodes = select_nodes(rest, lattice.cell_size(), where);
    const ProbeNodes probe{"plate", nodes, rest_centroid(rest, nodes)};
    figures.seconds = solution.seconds;
    figures.response = response(experiment.kind, read_probe(probe, rest, solution.displacements, solution.support));
    figures.volume_change = measure_volume_change(solution.displacements, cell_corners(lattice), lattice.cell_size())
                                .relative_volume_change;
    figures.pictured = picked(solution.displacements, pictured_nodes(experiment));
    figures.stresses = picked(solution.stresses, cells);
    return figures;
}

double mean_distance(const Figures& a, const Figures& b) {
    if (a.pictured.size() != b.pictured.size() || a.pictured.empty()) {
        throw std::invalid_argument("mean_distance: " + std::to_string(a.pictured.size()) + " and " +
                                    std::to_string(b.pictured.size()) + " nodes; the same number above 0 is wanted");
    }
    double sum = 0;
    for (std::size_t n = 0; n < a.pictured.size(); ++n) {
        const auto &u = a.pictured[n], &v = b.pictured[n];
        sum += std::hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2]);
    }
    return sum / static_cast<double>(a.pictured.size());
}

double stress_distance(const std::vector<std::array<double, 6>>& a, const std::vector<std::array<double, 6>>& of) {
    if (a.size() != of.size() || a.empty()) {
        throw std::invalid_argument("stress_distance: " + std::to_string(a.size()) + " and " +
                                    std::to_string(of.size()) + " cells; the same number above 0 is wanted");
    }
    double sum = 0, whole = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        for (std::size_t c = 0; c < 6; ++c) {
            const double times = c < 3 ? 1 : 2, d = a[n][c] - of[n][c];
            sum += times * d * d;
            whole += times * of[n][c] * of[n][c];
        }
    }
    return std::sqrt(sum / whole);
}

namespace {

std::string key(const Experiment& experiment, const ElementChoice& choice) {
    return paper::key(experiment) + " " + paper::name(choice);
}

/// CalculiX prints seven digits; sums of them carry no more.
double rounded(double value) {
    return std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr);
}

} // namespace

FiniteElements::FiniteElements(Source source) : source_(source) {
    if (source == Source::program) {
        if (!calculix::is_installed()) {
            throw std::runtime_error(calculix::kNotInstalled);
        }
        version_ = calculix::version();
        return;
    }
    try {
        const auto stored = nlohmann::json::parse(kStoredFiniteElements);
        version_ = stored.at("calculix").get<std::string>();
        for (const auto& [name, entry] : stored.at("results").items()) {
            Figures& figures = known_[name];
            figures.failure = entry.value("failure", "");
            figures.volume_change = entry.value("volume_change", 0.0);
            figures.response = entry.value("response", 0.0);
            figures.seconds = entry.value("seconds", 0.0);
            for (const auto& u : entry.value("pictured", nlohmann::json::array())) {
                figures.pictured.push_back(u.get<std::array<double, 3>>());
            }
            for (const auto& s : entry.value("stresses", nlohmann::json::array())) {
                figures.stresses.push_back(s.get<std::array<double, 6>>());
            }
        }
    } catch (const nlohmann::json::exception& error) {
        throw std::runtime_error(std::string("studies/paper/calculix_results.json: ") + error.what());
    }
}

const Figures& FiniteElements::figures(const Experiment& experiment, const ElementChoice& choice) {
    const std::string name = key(experiment, choice);
    const auto [entry, is_new] = known_.try_emplace(name);
    if (is_new && source_ == Source::program) {
        if (before_run) {
            before_run(name);
        }
        entry->second = solve_finite_elements(experiment, choice);
    } else if (is_new) {
        entry->second.failure = "no result of CalculiX is kept for " + name;
    }
    return entry->second;
}

std::string FiniteElements::description() const {
    return "CalculiX " + version_ + (source_ == Source::stored ? ", results kept with this program" : "");
}

void FiniteElements::write(std::ostream& out) const {
    // A line an experiment: differences stay readable.
    out << "{\"command\": \"hybmss-study paper --calculix --store "
           "studies/paper/calculix_results.json\",\n\"calculix\": \""
        << version_ << "\",\n\"results\": {";
    const char* separator = "\n";
    for (const auto& [name, figures] : known_) {
        nlohmann::ordered_json entry;
        if (figures.good()) {
            entry["volume_change"] = rounded(figures.volume_change);
            entry["response"] = rounded(figures.response);
            entry["seconds"] = rounded(figures.seconds);
            for (const auto& u : figures.pictured) {
                entry["pictured"].push_back({rounded(u[0]), rounded(u[1]), rounded(u[2])});
            }
            for (const auto& s : figures.stresses) {
                auto& row = entry["stresses"].emplace_back();
                for (const double component : s) {
                    row.push_back(rounded(component));
                }
            }
        } else {
            entry["failure"] = figures.failure;
        }
        out << separator << nlohmann::json(name).dump() << ": " << entry.dump();
        separator = ",\n";
    }
    out << "\n}}\n";
}

} // namespace hybmss::paper
