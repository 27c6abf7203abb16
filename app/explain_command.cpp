#include "app/command_line.hpp"
#include "app/plan_arguments.hpp"
#include "app/progress_line.hpp"
#include "app/scene_report.hpp"
#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "hybmss/simulation/world_simulation.hpp"
#include "plan/tuning/trials.hpp"
#include "simulation/results/results.hpp"
#include "simulation/run/effect_list.hpp"
#include "simulation/run/memory.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <utility>

namespace {

using namespace hybmss;

struct ExplainArguments {
    std::string scene, json, slice;
    bool keys = false, effects = false, force = false;
    PlanArguments plan;
};

/// What an effect of a scene takes, by the scene without it.
struct EffectCost {
    const EffectRule* rule;
    bool in;
    std::optional<long long> bytes;    ///< that it adds to the dynamics; none for what no body can do without
    std::optional<double> nanoseconds; ///< that it adds to a cell's step; of explicit steps alone
};

/// A scene that is stepped for the clock: begun anew, off the clock, where its run ends and where it fails, so that no
/// state counts that a run does not reach.
class TimedScene {
public:
    TimedScene(Scene scene, const SimulationOptions& options)
        : options_(options), simulation_(std::move(scene), options), end_(steps_of(simulation_)) {}

    const Simulation& simulation() const { return simulation_; }
    long end() const { return end_; }

    /// Seconds of so many steps, told by those of twenty runs at most: to begin anew takes longer than a short run.
    /// Throws std::runtime_error where not one can be taken.
    double seconds(long wanted) {
        long steps = std::min(wanted, 20 * std::min(end_, wanted));
        const double times = static_cast<double>(wanted) / static_cast<double>(steps);
        double sum = 0;
        while (steps > 0) {
            if (simulation_.steps() >= end_) {
                simulation_ = Simulation(simulation_.scene(), options_);
            }
            const long before = simulation_.steps(), count = std::min(steps, end_ - before);
            const auto start = std::chrono::steady_clock::now();
            try {
                simulation_.step(count);
                sum += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
                steps -= count;
            } catch (const std::runtime_error&) {
                // Explicit steps are looked at in fifties only.
                const bool looked_at = !explicit_in_time(simulation_.scene().solver.method);
                end_ = simulation_.steps() - (looked_at ? 0 : 50);
                if (end_ <= 0) {
                    throw;
                }
            }
        }
        return times * sum;
    }

    static long steps_of(const Simulation& simulation) {
        const double step = simulation.time_step();
        const double steps = step > 0 ? std::ceil(simulation.scene().solver.duration / step * (1 - 1e-12)) : 1;
        return static_cast<long>(std::clamp(steps, 1.0, 1e17));
    }

private:
    SimulationOptions options_;
    Simulation simulation_;
    long end_;
};

/// Seconds a step that `with` takes longer than `rest`, the median over rounds in which both have a slice.
double difference(TimedScene& with, TimedScene& rest) {
    constexpr int kRounds = 11;
    constexpr double kSliceSeconds = 0.005;
    Interleaved interleaved(
        {[&](long steps) { return with.seconds(steps); }, [&](long steps) { return rest.seconds(steps); }},
        kSliceSeconds);
    std::vector<double> differences;
    for (int round = 0; round < kRounds; ++round) {
        const std::vector<double> seconds = interleaved.next();
        differences.push_back(seconds[0] - seconds[1]);
    }
    return median(differences);
}

/// Every effect of the list in its order. Those in the scene that it can do without are measured: explicit steps of the
/// scene and of the scene without them in turns, by the median of the differences. That takes about a tenth of a second
/// each, longer where a step does.
std::vector<EffectCost> effect_costs(const Simulation& simulation, const SimulationOptions& options) {
    const Scene& scene = simulation.scene();
    const bool small_steps = explicit_in_time(scene.solver.method);
    const double needed = 3 * estimated_bytes(scene.body, options);
    SimulationOptions same = options;
    same.plan = simulation.describe().choice;
    std::vector<EffectCost> costs;
    for (const EffectRule& rule : effect_rules()) {
        EffectCost& cost = costs.emplace_back(EffectCost{&rule, rule.in(scene), {}, {}});
        if (!cost.in || !rule.remove || needed > available_bytes()) {
            continue;
        }
        TimedScene with(scene, same), rest(without(scene, rule), same);
        if (small_steps) {
            try {
                cost.nanoseconds = 1e9 * difference(with, rest) / static_cast<double>(simulation.cell_count());
            } catch (const std::runtime_error&) { // it fails at once, or does without this effect
            }
        }
        // After steps: some arrays are made by the first.
        cost.bytes = static_cast<long long>(with.simulation().describe().bytes) -
                     static_cast<long long>(rest.simulation().describe().bytes);
    }
    return costs;
}

/// By the scene's own steps, of a fifth of a second or five of them, but not many runs over.
double seconds_a_step(TimedScene& timed) {
    timed.seconds(1);
    double seconds = 0;
    long steps = 0;
    do {
        seconds += timed.seconds(5);
        steps += 5;
    } while (seconds < 0.2 && steps < 10 * timed.end());
    return seconds / static_cast<double>(steps);
}

/// What a run would say of the mesh, told by the equilibrium under all that holds and loads the body, where that is
/// found within a second or so, as it is on coarse meshes; else "".
std::string coarse_mesh_line(const Simulation& simulation, const SimulationOptions& options) {
    constexpr std::size_t kCoarse = 30000;
    constexpr double kQuick = 1, kPatience = 3; // s, expected and at most
    if (simulation.cell_count() > kCoarse || simulation.other_cells() != nullptr) {
        return "";
    }
    Scene scene = simulation.scene();
    if (scene.solver.accuracy || (scene.fixes.empty() && scene.moves.empty())) {
        return "";
    }
    scene.solver.method = SolverMethod::static_equilibrium;
    scene.solver.tolerance = 1e-3;
    scene.starts.clear();
    scene.obstacles.clear();
    scene.cuts.clear();
    scene.probes.clear(); // which have warnings of their own
    scene.output.energy_balance = false;
    try {
        Simulation still(std::move(scene), options);
        RunCallbacks callbacks;
        callbacks.progress = [](const Progress& progress) {
            if (progress.wall_seconds > kPatience) {
                throw std::runtime_error("it takes too long");
            }
        };
        const Summary summary = still.estimated_seconds() < kQuick ? still.run(callbacks) : Summary{};
        return summary.warnings.empty() ? "" : summary.warnings.front();
    } catch (const std::exception&) { // what is wrong with the scene, the run will say
        return "";
    }
}

void row(std::string_view label, const std::string& value) {
    fmt::print("  {:<20} {}\n", label, value);
}

/// The guaranteed bound and the sharp estimate of the stable step at rest.
std::string critical_step_text(const Simulation& simulation) {
    const FittedCells* const other = simulation.other_cells();
    const ForcePlan<double> plan = other ? ForcePlan<double>(other->network)
                                         : ForcePlan<double>(simulation.lattice(), simulation.scene().material);
    const std::vector<double> rest(3 * plan.node_count(), 0.0);
    const double sharp =
        plan.estimate_critical_time_step(VectorField<const double>::aos(rest.data(), plan.node_count()));
    return fmt::format("{:.6g} s guaranteed, {:.6g} s estimated{}, at rest", simulation.critical_time_step(), sharp,
                       simulation.scene().damping.stiffness > 0 ? " without the springs' damping" : "");
}

/// What each effect takes, and why it is there or not.
void print_effects(const Simulation& simulation, const std::vector<EffectCost>& costs) {
    const std::string kernel = simulation.describe().kernel;
    fmt::print("effects in\n");
    fmt::print("  {:<20} {:>12} {:>14}  {}\n", "", "bytes", "ns a cell-step", "why; kernel");
    for (const EffectCost& cost : costs) {
        if (cost.in) {
            fmt::print("  {:<20} {:>12} {:>14}  {}; {}\n", cost.rule->name,
                       cost.bytes ? fmt::format("{}", *cost.bytes) : "-",
                       cost.nanoseconds ? fmt::format("{:.2f}", *cost.nanoseconds) : "-", cost.rule->reason(simulation),
                       cost.rule->kernel.empty() ? kernel : cost.rule->kernel);
        }
    }
    fmt::print("effects out\n");
    for (const EffectCost& cost : costs) {
        if (!cost.in) {
            row(cost.rule->name, cost.rule->reason(simulation));
        }
    }
}

void explain_solver(const Simulation& simulation) {
    const Solver& solver = simulation.scene().solver;
    fmt::print("solver\n");
    if (solver.method != SolverMethod::static_equilibrium) {
        row("method", fmt::format("{}: the {} lowest by LOBPCG, {}", name(solver.method), solver.count,
                                  solver.method == SolverMethod::modes
                                      ? "about the equilibrium that moves and loads give, or about rest"
                                      : "about rest, as factors of moves and loads"));
        row("preconditioner", std::string(name(solver.preconditioner)));
        return;
    }
    row("method", "static: Newton's method with conjugate gradients in a trust region");
    row("preconditioner", std::string(name(solver.preconditioner)));
    row("tolerance", solver.tolerance ? fmt::format("{:g} (as given)", *solver.tolerance)
                                      : std::string("1e-8, float 1e-4 (none given)"));
    row("load steps", fmt::format("the first is 1/{} of the loading; smaller ones where one fails", solver.load_steps));
    row("estimated cost",
        fmt::format("about {:.2g} s, by a rule, right to a factor of some three where nothing buckles",
                    simulation.estimated_seconds()));
    row("critical time step", critical_step_text(simulation) + ", if it were solved by symplectic-euler");
}

void explain_time(TimedScene& timed) {
    const Simulation& simulation = timed.simulation();
    const Scene& scene = simulation.scene(); // until it is begun anew
    const bool implicit = scene.solver.method == SolverMethod::backward_euler;
    fmt::print("time\n");
    row("method", std::string(name(scene.solver.method)));
    row("critical time step", critical_step_text(simulation));
    row("time step",
        fmt::format("{:.6g} s ({})", simulation.time_step(),
                    scene.solver.time_step            ? "as given"
                    : implicit                        ? "chosen: 14 times the critical one, undamped"
                    : scene.material.stiffening.any() ? "chosen: 0.7 of the critical one of springs strained by 1/2"
                                                      : "chosen: 0.7 of the critical one"));
    const auto steps = static_cast<double>(timed.end());
    row("steps", fmt::format("{:.0f}{}", steps, scene.solver.tolerance ? " at most; fewer if the body settles" : ""));
    try {
        const double cost = seconds_a_step(timed);
        row("estimated cost",
            fmt::format("{:.3g} s ({:.3g} us a step, {:.3g} ns a cell and step, measured now)", steps * cost,
                        1e6 * cost, 1e9 * cost / static_cast<double>(simulation.cell_count())));
    } catch (const std::runtime_error& error) {
        row("estimated cost", fmt::format("cannot be measured: {}", error.what()));
    }
}

void explain_accuracy(const AccuracyReport& report, const std::array<int, 3>& chosen) {
    fmt::print("accuracy\n");
    row("wanted",
        fmt::format("{:g}{}", report.wanted, report.free_mesh ? "; the mesh is free" : "; the scene says which mesh"));
    std::string meshes;
    for (const AccuracyMesh& mesh : report.meshes) {
        meshes +=
            fmt::format("{}{} x {} x {}", meshes.empty() ? "" : ", ", mesh.cells[0], mesh.cells[1], mesh.cells[2]);
    }
    row("told by",
        fmt::format("{} cells, solved now; {}", meshes,
                    report.quantity.empty() ? "nothing changes by more than the tolerance"
                                            : fmt::format("worst is {}, order {:.2f}", report.quantity, report.order)));
    row("estimated error",
        fmt::format("{:.2g}{}", report.error_estimate,
                    report.reached()    ? ": within the wish"
                    : !report.free_mesh ? ": above the wish, and the mesh is the scene's own"
                                        : fmt::format(" on the last; `run` goes on to about {} x {} x {}", chosen[0],
                                                      chosen[1], chosen[2])));
    fmt::print("  {:<10} {:<7} {:<8} {:>9}  {:<20} {:>9} {:>8}\n", "accuracy", "type", "kernel", "tolerance", "cells",
               "GB", "s, about");
    for (const AccuracyOffer& offer : report.offers) {
        fmt::print("  {:<10g} {:<7} {:<8} {:>9.1e}  {:<20} {:>9.2g} {:>8.2g}{}\n", offer.accuracy,
                   name(offer.precision), name(offer.kernel), offer.tolerance,
                   fmt::format("{} x {} x {}", offer.cells[0], offer.cells[1], offer.cells[2]), offer.bytes / 1e9,
                   offer.seconds,
                   !offer.fits                       ? "  does not fit"
                   : offer.accuracy == report.wanted ? "  the wish"
                                                     : "");
    }
}

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
    return value ? Json(*value) : Json();
}

Json effects_json(const Simulation& simulation, std::span<const EffectCost> costs) {
    const std::string kernel = simulation.describe().kernel;
    Json effects = Json::array();
    for (const EffectCost& cost : costs) {
        Json effect = {{"name", cost.rule->name}, {"in", cost.in}, {"why", cost.rule->reason(simulation)}};
        if (cost.in) {
            effect["kernel"] = cost.rule->kernel.empty() ? kernel : std::string(cost.rule->kernel);
            effect["bytes"] = or_null(cost.bytes);
            effect["ns_per_cell_step"] = or_null(cost.nanoseconds);
        }
        effects.push_back(effect);
    }
    return effects;
}

Json candidates_json(const PlanDescription& plan) {
    Json candidates = Json::array();
    for (const CandidateFigure& figure : plan.candidates) {
        candidates.push_back(
            {{"name", figure.name}, {"ns_per_cell_step", figure.ns_per_cell_step}, {"finalist", figure.finalist}});
    }
    return candidates;
}

/// For programs: the effects with their bytes and ns, the body, the plan and its candidates, the time steps. Numbers in
/// SI units and ns.
void write_explanation(const Simulation& simulation, std::span<const EffectCost> costs, std::ostream& out) {
    const PlanDescription plan = simulation.describe();
    Json json;
    json["effects"] = effects_json(simulation, costs);
    json["body"] = {{"cells", simulation.cell_count()}};
    if (const FittedCells* const other = simulation.other_cells()) {
        json["body"]["anisotropy"] = other->anisotropy;
        json["body"]["modulus_error"] = other->modulus_error;
    } else {
        json["body"]["grid"] = simulation.lattice().cells();
    }
    json["body"]["nodes"] = simulation.node_count();
    json["body"]["springs"] = plan.springs;
    json["plan"] = plan_json(plan);
    json["plan"]["effort"] = name(plan.effort);
    json["plan"]["why"] = plan.reason;
    json["plan"]["candidates"] = candidates_json(plan);
    json["critical_time_step"] = simulation.critical_time_step();
    json["time_step"] = simulation.time_step();
    out << json.dump(2) << '\n';
}

void explain_world(const ExplainArguments& arguments, const WorldScene& scene);
void explain_scene(const ExplainArguments& arguments, Scene read);

void explain(const ExplainArguments& arguments) {
    if (arguments.keys) {
        fmt::print("{}", scene_keys_markdown());
        return;
    }
    if (arguments.effects) {
        fmt::print("{}", effects_markdown());
        return;
    }
    if (arguments.scene.empty()) {
        throw std::invalid_argument("explain: a SCENE file, --keys or --effects is needed");
    }
    std::variant<Scene, WorldScene> read = load_any_scene(arguments.scene);
    if (const auto* world = std::get_if<WorldScene>(&read)) {
        explain_world(arguments, *world);
    } else {
        explain_scene(arguments, std::get<Scene>(std::move(read)));
    }
}

void explain_world(const ExplainArguments& arguments, const WorldScene& scene) {
    if (!arguments.json.empty()) {
        throw std::invalid_argument("--json: it holds one body; " + arguments.scene + " has several");
    }
    const WorldSimulation world(scene, arguments.plan.options());
    fmt::print("world\n");
    row("time step",
        fmt::format("{:.6g} s for all bodies (stable: {:.6g} s)", world.time_step(), world.critical_time_step()));
    for (const auto& [first, second, reading] : world.contacts()) {
        row("contact", fmt::format("{} touches {}", first, first == second ? "itself" : second));
    }
    for (const AttachmentReading& tied : world.attachments()) {
        row("attached", fmt::format("{} nodes of {} to {}", tied.ties, tied.from, tied.to.empty() ? "space" : tied.to));
    }
    for (const NamedScene& body : scene.bodies) {
        fmt::print("\n== body {}\n", body.name);
        explain_scene(arguments, body.scene);
    }
}

void explain_cubes(const ExplainArguments& arguments, const Simulation& simulation, const std::string& parts) {
    const Scene& scene = simulation.scene();
    row("cells", fmt::format("{}", simulation.cell_count()));
    const auto grid = simulation.lattice().cells();
    row("grid", fmt::format("{} x {} x {} cells of {:g} m; low corner at ({:g}, {:g}, {:g})", grid[0], grid[1], grid[2],
                            scene.body.cell_size, scene.body.origin[0], scene.body.origin[1], scene.body.origin[2]));
    if (!scene.body.resampled.empty()) {
        row("resampled", scene.body.resampled);
    }
    if (const std::string labels = labels_line(scene); !labels.empty()) {
        row("labels", labels);
    }
    if (const std::string fills = fills_line(simulation); !fills.empty()) {
        row("fill", fills);
    }
    if (!arguments.slice.empty()) {
        fmt::print("{}", slice_lines(simulation, static_cast<std::size_t>(arguments.slice[0] - 'x')));
    }
    row("parts", parts.empty() ? "1: all cells hang together by their faces" : parts);
    if (scene.tear_strain || std::ranges::any_of(scene.cuts, &Cut::separates)) {
        row("may part", fmt::format("along faces, as a network from the start; {}",
                                    scene.tear_strain ? fmt::format("beyond a strain of {:g}", *scene.tear_strain)
                                                      : std::string("by [[cut]] alone")));
    }
    row("nodes", fmt::format("{}", simulation.node_count()));
    row("springs",
        scene.material.springs == SpringForm::means
            ? fmt::format("{} on means: each cell has its own", simulation.describe().springs)
            : fmt::format("{} merged ({} if neighbouring cells kept their own face diagonals)",
                          simulation.describe().springs,
                          simulation.lattice().unmerged_springs(scene.material.face_diagonal_ratio > 0).total()));
}

void explain_other_cells(const Simulation& simulation) {
    const SceneBody& body = simulation.scene().body;
    row("cells", other_cells_line(simulation));
    row("fit", body.shape == SceneCells::mesh ? fit_line(*simulation.other_cells())
               : body.shape == SceneCells::tetrahedra
                   ? std::string("none needed: these springs are isotropic, but for the pyramids that close a box "
                                 "whose sides differ")
                   : std::string("none needed: these springs are isotropic"));
    row("nodes", fmt::format("{}", simulation.node_count()));
    row("springs", fmt::format("{}", simulation.describe().springs));
}

void explain_scene(const ExplainArguments& arguments, Scene read) {
    const auto json = open_output("--json", arguments.json, {"{\"effects\":", {arguments.scene}, arguments.force});
    SimulationOptions options = arguments.plan.options();
    std::optional<AccuracyReport> offers;
    if (read.solver.accuracy) {
        Scene chosen;
        AccuracyOptions probing{options, !arguments.plan.names_precision(), {}, {}};
        ProgressLine line(stderr);
        show_meshes(line, arguments.scene, *read.solver.accuracy, probing);
        offers = accuracy_offers(read, probing, &chosen);
        line.clear();
        options.precision = offers->precision;
        read = std::move(chosen);
    }
    TimedScene timed(std::move(read), options);
    const Simulation& simulation = timed.simulation();
    const Scene& scene = simulation.scene();
    const PlanDescription plan = simulation.describe();
    if (!arguments.slice.empty()) {
        (void)simulation.lattice(); // which is drawn
    }
    const std::string parts = parts_line(simulation);
    if (!parts.empty()) {
        fmt::print(stderr, "hybmss: warning: {}: the body has {}\n", arguments.scene, parts);
    }
    if (const std::string coarse = coarse_mesh_line(simulation, options); !coarse.empty()) {
        fmt::print(stderr, "hybmss: warning: {}: {}\n", arguments.scene, coarse);
    }
    const std::vector<EffectCost> costs = effect_costs(simulation, options);
    print_effects(simulation, costs);
    fmt::print("body\n");
    if (simulation.other_cells() != nullptr) {
        explain_other_cells(simulation);
    } else {
        explain_cubes(arguments, simulation, parts);
    }
    row("memory", fmt::format("about {:.3g} MB in the whole run", estimated_bytes(scene.body, options) / 1e6));
    const std::vector<std::string> shared = simulation.shared_supports();
    if (const std::vector<ProbeReading> probes = simulation.probes(); !probes.empty()) {
        fmt::print("probes\n");
        for (const ProbeReading& probe : probes) {
            row(probe.name, fmt::format("{} held nodes, {} of them shared with other supports", probe.reaction_nodes,
                                        probe.shared_reaction_nodes));
        }
    }
    for (const std::string& line : shared) {
        fmt::print(stderr, "hybmss: warning: {}: {}\n", arguments.scene, line);
    }
    fmt::print("plan\n");
    row("effort", std::string(name(plan.effort)));
    row("why", plan.reason);
    row("kernel", plan.kernel);
    row("layout", plan.layout);
    row("instruction set", std::string(name(plan.instruction_set)));
    row("precision", plan.precision);
    row("threads", fmt::format("{}", plan.threads));
    row("tiles", fmt::format("{}", plan.tiles));
    row("bytes",
        fmt::format("{} in the plan, about {:.3g} in the whole run", plan.bytes, estimated_bytes(scene.body, options)));
    if (!plan.candidates.empty()) {
        fmt::print("candidates\n{}", candidate_lines(plan));
    }
    if (timeless(scene.solver.method)) {
        explain_solver(simulation);
        if (offers) {
            explain_accuracy(*offers, simulation.lattice().cells());
        }
    } else {
        explain_time(timed);
    }
    if (json) {
        write_explanation(simulation, costs, json->stream());
        json->commit();
    }
}

} // namespace

void add_explain_command(CLI::App& app) {
    const auto arguments = std::make_shared<ExplainArguments>();
    CLI::App* command = app.add_subcommand("explain", "tell what a scene calls for, and how it would be computed");
    command->add_option("SCENE", arguments->scene, "scene file (TOML)");
    command->add_flag("--keys", arguments->keys,
                      "print all keys of the scene format instead, as in docs/report/scene_keys.md");
    command->add_flag("--effects", arguments->effects, "print all effects there are instead, as in docs/effects.md");
    command->add_option("--slice", arguments->slice, "draw the layer of cells in the middle of this axis: x, y or z")
        ->check(CLI::IsMember({"x", "y", "z"}));
    command->add_option("--json", arguments->json, "also write it to this file")->check(a_path());
    add_force_option(*command, arguments->force);
    arguments->plan.add_to(*command, true);
    command->callback([arguments] { explain(*arguments); });
}
