/// NaN, infinity and huge numbers, wherever numbers go in.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include "hybmss/force_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::stability {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

Lattice cube() {
    return Lattice::box(3, 3, 3, kCellSize);
}

/// A scene with one value changed.
Scene scene_with(SpringForm springs, const std::string& key, const std::string& value) {
    struct Line {
        const char *table, *key, *value;
    };
    constexpr Line kLines[] = {{"[body]", "cells", "[2, 2, 2]"},
                               {"", "cell_size", "0.5"},
                               {"[material]", "young_modulus", "1e4"},
                               {"", "poisson_ratio", "0.3"},
                               {"", "density", "1000"},
                               {"", "face_diagonal_ratio", "1"},
                               {"[[fix]]\nwhere = \"y-min\"", "axes", "\"xyz\""},
                               {"[[move]]\nwhere = \"y-max\"", "translate", "[0, -0.1, 0]"},
                               {"", "over", "1"},
                               {"[gravity]", "acceleration", "[0, -1, 0]"},
                               {"[damping]", "mass", "3"},
                               {"[solver]", "duration", "1"}};
    std::string text;
    for (const Line& line : kLines) {
        text += fmt::format("{}\n{} = {}\n", line.table, line.key, key == line.key ? value : line.value);
    }
    Scene scene = parse_scene(text, "scene.toml");
    scene.material.springs = springs;
    return scene;
}

Outcome run_scene(SpringForm springs, const std::string& key, const std::string& value) {
    SimulationOptions options;
    options.plan.threads = 1;
    Simulation simulation(scene_with(springs, key, value), options);
    const Summary summary = simulation.run();
    const Energies& e = summary.energies;
    require(std::isfinite(e.springs + e.volume + e.kinetic + e.external), "a number in the results is not finite");
    Outcome outcome = summary.failure.empty() ? right("runs") : error(summary.failure);
    outcome.min_cell_volume_ratio = summary.volume.min_cell_volume_ratio;
    outcome.iterations = summary.steps;
    return outcome;
}

template <class T>
Outcome set_displacement(SpringForm springs, double value) {
    BodyMotion<T> motion(cube(), case_material(springs, 0.4));
    Vectors u(motion.node_count(), Vector3d::Zero());
    u[5][1] = value;
    motion.set_displacements(u);
    return right(fmt::format("accepted; energy {:.1e} J", motion.elastic_energy()));
}

template <class T>
Outcome set_velocity(SpringForm springs, double value) {
    BodyMotion<T> motion(cube(), case_material(springs, 0.4));
    Vectors v(motion.node_count(), Vector3d::Zero());
    v[5][1] = value;
    motion.set_velocities(v);
    return right("accepted");
}

Outcome prescribe(SpringForm springs, double displacement, double velocity) {
    BodyMotion<double> motion(cube(), case_material(springs, 0.4));
    PrescribedNode node;
    node.displacement = {displacement, 0, 0};
    node.velocity = {velocity, 0, 0};
    motion.prescribe({&node, 1});
    return right("accepted");
}

Outcome step(SpringForm springs, double time_step, double acceleration, double damping) {
    BodyMotion<double> motion(cube(), case_material(springs, 0.4));
    motion.step({time_step, {0, acceleration, 0}, damping}, 1);
    return right("accepted");
}

Outcome make(const Material& material, double cell_size) {
    const ForcePlan<float> plan(Lattice::box(2, 2, 2, cell_size), material);
    return right("accepted");
}

/// ForcePlan checks no values (it would read them twice). The contract: a node that is not finite spoils the energy and
/// the forces on nodes that share a cell with it, and nothing beyond.
template <class T>
Outcome force_plan(SpringForm springs, double value) {
    constexpr int kCells = 6;
    const Lattice lattice = Lattice::box(kCells, kCells, kCells, kCellSize);
    PlanOptions options;
    options.threads = 1;
    const ForcePlan<T> plan(lattice, case_material(springs, 0.4), options);
    std::vector<T> u(3 * plan.node_count()), f(u.size());
    const std::size_t bad = lattice.grid_node_index(1, 1, 1);
    u[3 * bad] = static_cast<T>(value);
    plan.add_forces(VectorField<const T>::aos(u.data(), plan.node_count()),
                    VectorField<T>::aos(f.data(), plan.node_count()));
    const double energy = plan.energy(VectorField<const T>::aos(u.data(), plan.node_count())).total();
    require(!std::isfinite(energy), fmt::format("the energy {:.1e} J hides the bad number", energy));
    bool spoilt = false;
    for (std::size_t n = 0; n < plan.node_count(); ++n) {
        const bool finite = std::isfinite(f[3 * n] + f[3 * n + 1] + f[3 * n + 2]);
        const Vector3d x(lattice.rest_position(n).data());
        const bool neighbour = (x.array() <= 2 * kCellSize + 1e-9).all();
        require(finite || neighbour, "the bad number went beyond its cells");
        spoilt = spoilt || !finite;
    }
    require(spoilt, "the forces hide the bad number");
    return right("energy and the neighbours' forces are not finite, all others are right");
}

/// A motion that is driven beyond all bounds: the run must stop with the step and the cause and keep the last good
/// state.
Outcome blow_up(SpringForm springs, Precision precision) {
    SimulationOptions options;
    options.precision = precision;
    options.plan.threads = 1;
    Simulation simulation(scene_with(springs, "translate", "[0, -900000, 0]"), options);
    const Summary summary = simulation.run();
    require(!summary.failure.empty(), "no failure is told");
    for (const auto& u : simulation.displacements()) {
        require(std::isfinite(u[0] + u[1] + u[2]), "the state left behind is not finite");
    }
    Outcome outcome = error(summary.failure);
    outcome.min_cell_volume_ratio = summary.volume.min_cell_volume_ratio;
    outcome.iterations = summary.steps;
    return outcome;
}

} // namespace

void append_bad_number_cases(std::vector<HardCase>& cases, SpringForm springs) {
    const auto refused = [&](const std::string& name, std::function<Outcome()> run) {
        cases.push_back({"numbers: " + name, "is refused", Wanted::error, true, std::move(run)});
    };
    const char* const keys[] = {
        "cells",     "cell_size", "young_modulus", "poisson_ratio", "density", "face_diagonal_ratio",
        "translate", "over",      "acceleration",  "mass",          "duration"};
    for (const char* key : keys) {
        for (const char* value : {"nan", "inf", "1e300"}) {
            const std::string name = key;
            const bool is_vector = name == "translate" || name == "acceleration";
            const std::string text = name == "cells" ? fmt::format("[{}, 1, 1]", value)
                                     : is_vector     ? fmt::format("[0, {}, 0]", value)
                                                     : std::string(value);
            // Endless damping or time is no wrong physics; it must then end somehow, all the same.
            const bool huge_is_allowed = std::string(value) == "1e300" && (name == "mass" || name == "over");
            cases.push_back({fmt::format("numbers: scene with {} = {}", key, text),
                             huge_is_allowed ? "ends, with finite numbers or an error" : "is refused",
                             huge_is_allowed ? Wanted::answer_or_error : Wanted::error, true,
                             [=] { return run_scene(springs, name, text); }});
        }
    }
    for (const double value : {kNan, kInfinity, -kInfinity}) {
        refused(fmt::format("set_displacements with {}, float", value),
                [=] { return set_displacement<float>(springs, value); });
        refused(fmt::format("set_displacements with {}, double", value),
                [=] { return set_displacement<double>(springs, value); });
        refused(fmt::format("set_velocities with {}, float", value),
                [=] { return set_velocity<float>(springs, value); });
        refused(fmt::format("prescribed displacement {}", value), [=] { return prescribe(springs, value, 0); });
        refused(fmt::format("prescribed velocity {}", value), [=] { return prescribe(springs, 0, value); });
        refused(fmt::format("time step {}", value), [=] { return step(springs, value, 0, 0); });
        refused(fmt::format("acceleration {}", value), [=] { return step(springs, 1e-4, value, 0); });
        refused(fmt::format("damping {}", value), [=] { return step(springs, 1e-4, 0, value); });
        refused(fmt::format("Young's modulus {}", value), [=] {
            Material material = case_material(springs, 0.4);
            material.young_modulus = value;
            return make(material, kCellSize);
        });
        refused(fmt::format("Poisson's ratio {}", value),
                [=] { return make(case_material(springs, value), kCellSize); });
        refused(fmt::format("A = {}", value), [=] { return make(case_material(springs, 0.4, value), kCellSize); });
        refused(fmt::format("cell size {}", value), [=] { return make(case_material(springs, 0.4), value); });
        cases.push_back({fmt::format("numbers: ForcePlan at a displacement of {}, float", value),
                         "spoils its neighbours' forces and the energy, nothing else", Wanted::answer, true,
                         [=] { return force_plan<float>(springs, value); }});
        cases.push_back({fmt::format("numbers: ForcePlan at a displacement of {}, double", value),
                         "spoils its neighbours' forces and the energy, nothing else", Wanted::answer, true,
                         [=] { return force_plan<double>(springs, value); }});
    }
    for (const double value : {1e300, 1e-300, -1.0, 0.0}) {
        refused(fmt::format("cell size {:g}", value), [=] { return make(case_material(springs, 0.4), value); });
    }
    cases.push_back({"numbers: ForcePlan at a displacement of 1e30, float",
                     "spoils its neighbours' forces and the energy", Wanted::answer, true,
                     [=] { return force_plan<float>(springs, 1e30); }});
    cases.push_back({"numbers: ForcePlan at a displacement of 1e300, double",
                     "spoils its neighbours' forces and the energy", Wanted::answer, true,
                     [=] { return force_plan<double>(springs, 1e300); }});
    cases.push_back({"numbers: a plate driven 900 km into the body, double",
                     "stops with step and cause, last state kept", Wanted::error, true,
                     [=] { return blow_up(springs, Precision::float64); }});
    cases.push_back({"numbers: a plate driven 900 km into the body, float",
                     "stops with step and cause, last state kept", Wanted::error, true,
                     [=] { return blow_up(springs, Precision::float32); }});
}

} // namespace hybmss::stability
