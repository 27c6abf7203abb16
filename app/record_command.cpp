// hybmss record: states of a scene's body and their forces by the scalar reference, for other programs' tests.
// hybmss replay: this build's forces against such a file.

#include "app/command_line.hpp"
#include "app/plan_arguments.hpp"
#include "hybmss/record.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace {

using namespace hybmss;
using Vector3 = std::array<double, 3>;

struct RecordArguments {
    std::string scene, out;
    int states = 3;
    unsigned seed = 1;
    bool force = false;
};

struct ReplayArguments {
    std::string record;
    PlanArguments plan;
};

/// Every node its own random displacement, by 5 % of a cell: no force that is wrong will hide behind a symmetry.
std::vector<Vector3> random_displacements(std::size_t nodes, double cell_size, unsigned seed) {
    std::mt19937 engine(seed);
    std::vector<Vector3> displacements(nodes);
    for (Vector3& u : displacements) {
        for (double& component : u) {
            component =
                0.05 * cell_size * (2 * static_cast<double>(engine()) / static_cast<double>(std::mt19937::max()) - 1);
        }
    }
    return displacements;
}

RecordedState recorded(const reference::Body& body, double least_scale, double time,
                       std::vector<Vector3> displacements) {
    std::vector<reference::Vector3d> u;
    for (const Vector3& v : displacements) {
        u.emplace_back(v[0], v[1], v[2]);
    }
    RecordedState state;
    state.time = time;
    state.displacements = std::move(displacements);
    for (const reference::Vector3d& f : reference::forces(body, u)) {
        state.forces.push_back({f[0], f[1], f[2]});
    }
    const std::vector<double> scales = reference::force_scale(body, u);
    // At rest nothing acts, and any error would be infinite by it.
    state.force_scale = std::max(*std::max_element(scales.begin(), scales.end()), least_scale);
    const reference::Energy energy = reference::energy(body, u);
    state.energy = {energy.springs, energy.volume};
    return state;
}

void record(const RecordArguments& arguments) {
    const auto out = open_output("--out", arguments.out, {"hybmss-record", {arguments.scene}, arguments.force});
    Simulation simulation(load_scene(arguments.scene));
    Record record;
    record.lattice = simulation.lattice();
    record.material = simulation.scene().material;
    const reference::Body body = reference::assemble(record.lattice, record.material);
    // The force of a millionth of strain on a cell's face.
    const double h = record.lattice.cell_size(), least_scale = 1e-6 * record.material.young_modulus * h * h;
    record.states.push_back(
        recorded(body, least_scale, 0,
                 random_displacements(simulation.node_count(), record.lattice.cell_size(), arguments.seed)));
    const bool still = timeless(simulation.scene().solver.method);
    const int states = still ? std::min(arguments.states, 2) : arguments.states;
    const Solver& solver = simulation.scene().solver;
    const long planned = still ? 1 : std::max(1L, std::lround(solver.duration / simulation.time_step()));
    long taken = 0;
    for (int state = 1; state < states; ++state) {
        const long until = still ? 1 : planned * state / (states - 1);
        simulation.step(until - taken);
        taken = until;
        record.states.push_back(recorded(body, least_scale, simulation.time(), simulation.displacements()));
    }
    const std::string text = record_text(record);
    parse_record(text, arguments.out); // what would be refused must not be written
    out->stream() << text;
    out->commit();
    fmt::print("{}: {} states of {} nodes\n", arguments.out, record.states.size(), simulation.node_count());
}

template <class T>
bool replay(const Record& record, const PlanOptions& options) {
    const ForcePlan<T> plan(record.lattice, record.material, options);
    const PlanDescription description = plan.describe();
    bool good = true;
    for (std::size_t s = 0; s < record.states.size(); ++s) {
        std::vector<T> u, f(3 * plan.node_count(), T(0));
        for (const Vector3& v : record.states[s].displacements) {
            u.insert(u.end(), {static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])});
        }
        const auto displacement = VectorField<const T>::aos(u.data(), plan.node_count());
        plan.add_forces(displacement, VectorField<T>::aos(f.data(), plan.node_count()));
        const auto forces = compare_forces<T>(record, s, VectorField<const T>::aos(f.data(), plan.node_count()));
        const auto energy = compare_energy<T>(record, s, plan.energy(displacement));
        const bool within = forces.within() && energy.within();
        fmt::print("{:5}  {:10.3e}  {:6}  {:10.2e}  {:10.2e}  {:10.2e}  {}\n", s, record.states[s].time,
                   description.precision, forces.error, energy.error, forces.tolerance, within ? "ok" : "MISMATCH");
        good = good && within;
    }
    return good;
}

void replay(const ReplayArguments& arguments) {
    const SimulationOptions options = arguments.plan.options();
    std::unique_ptr<Record> record;
    try {
        record = std::make_unique<Record>(load_record(arguments.record));
    } catch (const RecordError& error) {
        throw std::invalid_argument(error.what()); // bad input
    }
    fmt::print("{:>5}  {:>10}  {:6}  {:>10}  {:>10}  {:>10}\n", "state", "time, s", "type", "forces", "energy",
               "tolerance");
    const bool in_float = replay<float>(*record, options.plan);
    const bool in_double = replay<double>(*record, options.plan);
    if (!in_float || !in_double) {
        throw CLI::RuntimeError(1);
    }
}

} // namespace

void add_record_command(CLI::App& app) {
    const auto arguments = std::make_shared<RecordArguments>();
    CLI::App* command =
        app.add_subcommand("record", "write states and forces that other programs check their own forces against");
    command->add_option("SCENE", arguments->scene, "scene file (TOML)")->required();
    command->add_option("--out", arguments->out, "the record")->check(a_path())->required();
    add_force_option(*command, arguments->force);
    command
        ->add_option("--states", arguments->states,
                     "a random state, and the others evenly over the scene's duration (static: its equilibrium)")
        ->check(whole_number(1, 1000))
        ->capture_default_str();
    command->add_option("--seed", arguments->seed, "of the random state")->check(a_seed())->capture_default_str();
    command->callback([arguments] { record(*arguments); });
}

void add_replay_command(CLI::App& app) {
    const auto arguments = std::make_shared<ReplayArguments>();
    CLI::App* command = app.add_subcommand("replay", "compare this build's forces with a record, in float and double");
    command->add_option("RECORD", arguments->record, "file of `hybmss record`")->required();
    arguments->plan.add_to(*command, false);
    command->callback([arguments] { replay(*arguments); });
}
