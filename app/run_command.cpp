#include "app/command_line.hpp"
#include "app/plan_arguments.hpp"
#include "app/progress_line.hpp"
#include "app/scene_report.hpp"
#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "hybmss/simulation/world_simulation.hpp"
#include "simulation/results/results.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>

namespace {

using namespace hybmss;

struct RunArguments {
    std::string scene, out;
    bool restart = false, quiet = false, force = false;
    double checkpoint_every = 60; ///< s of wall time
    PlanArguments plan;
};

volatile std::sig_atomic_t caught = 0; // the signal that came

void remember(int signal) {
    caught = signal;
}

/// From now on the first SIGTERM, SIGINT or SIGHUP only sets `caught`; a second one of the same ends the program.
void catch_stop_signals() {
    struct sigaction action {};
    action.sa_handler = remember;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigemptyset(&action.sa_mask);
    sigaction(SIGTERM, &action, nullptr);
    sigaction(SIGINT, &action, nullptr);
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler != SIG_IGN) { // nohup
        sigaction(SIGHUP, &action, nullptr);
    }
}

/// Refuses to replace in a body's directory what no run has written.
void check_outputs(const RunArguments& arguments, const std::filesystem::path& directory) {
    constexpr std::pair<const char*, const char*> kFiles[] = {{"summary.json", "{\"converged\":"},
                                                              {"probes.csv", "time"},
                                                              {"body.pvd", "<?xmlversion=\"1.0\"?><VTKFile"},
                                                              {"skin.pvd", "<?xmlversion=\"1.0\"?><VTKFile"}};
    for (const auto& [name, beginning] : kFiles) {
        check_output("--out", directory / name, {beginning, {arguments.scene}, arguments.force});
    }
}

/// Everything about the scene is checked before the directory is made, so that bad input leaves nothing behind.
std::optional<Results> open_results(const RunArguments& arguments, const Simulation& simulation,
                                    const std::string& before) {
    if (arguments.out.empty()) {
        return std::nullopt;
    }
    check_outputs(arguments, arguments.out);
    try {
        return std::optional<Results>(std::in_place, arguments.out, simulation, before);
    } catch (const std::runtime_error& error) {
        throw std::invalid_argument(std::string("--out: ") + error.what());
    }
}

/// The checkpoint of a run in its output directory.
class RunCheckpoint {
public:
    RunCheckpoint(const RunArguments& arguments, const Simulation& simulation, const Results& results)
        : path_(path(arguments)), every_(arguments.checkpoint_every), simulation_(simulation), results_(results) {
        if (!arguments.restart) {
            remove(); // that of an earlier run, perhaps with other options
        }
    }

    static std::filesystem::path path(const RunArguments& arguments) {
        return std::filesystem::path(arguments.out) / "checkpoint";
    }

    /// Writes one where a signal asks for it or the time has come; false after a signal.
    bool operator()() {
        const int signal = caught;
        const auto now = std::chrono::steady_clock::now();
        if (signal != 0 || std::chrono::duration<double>(now - last_).count() >= every_) {
            simulation_.write_checkpoint(path_, results_.state());
            last_ = now;
        }
        return signal == 0;
    }
    /// The run has ended: nothing is left to go on with.
    void remove() const {
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
        std::filesystem::remove(path_.string() + ".partial", ignored); // of a run that was killed
    }

private:
    std::filesystem::path path_;
    double every_;
    const Simulation& simulation_;
    const Results& results_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

Simulation open_simulation(Scene scene, const RunArguments& arguments, const SimulationOptions& options,
                           std::string& before) {
    if (!arguments.restart) {
        return Simulation(std::move(scene), options);
    }
    return Simulation::restarted(std::move(scene), options, RunCheckpoint::path(arguments).string(), &before);
}

const char* signal_name(int signal) {
    return signal == SIGINT ? "SIGINT" : signal == SIGHUP ? "SIGHUP" : "SIGTERM";
}

/// As other errors do, these name the scene.
void write(const std::string& scene, const std::string& failure, const std::function<void()>& action) {
    try {
        action();
    } catch (const NotFinite& error) {
        throw std::runtime_error(scene + ": " + error.what() + (failure.empty() ? "" : "; " + failure));
    }
}

/// `which`: "" for a body alone, else what begins its lines.
void report_warnings(const RunArguments& arguments, const Simulation& simulation, const Summary& summary,
                     const std::string& which = "") {
    if (const std::string parts = summary.removed_cells > 0 ? parts_line(simulation) : ""; !parts.empty()) {
        fmt::print(stderr, "hybmss: warning: {}: {}after the cuts the body has {}\n", arguments.scene, which, parts);
    }
    if (summary.volume.min_cell_volume_ratio <= 0) {
        // An inverted cell can hold a lattice in a false equilibrium, so a settled result needs this word of caution.
        fmt::print(stderr, "hybmss: warning: {}: {}some cells are inverted (smallest volume ratio {:.3g}); {}\n",
                   arguments.scene, which, summary.volume.min_cell_volume_ratio,
                   simulation.scene().material.crush.any()
                       ? "a higher material.crush_resistance or gentler motions and loads may help"
                       : "material.crush_resistance = 20 keeps cells from that; so may gentler motions and loads");
    }
    for (const std::string& warning : summary.warnings) {
        fmt::print(stderr, "hybmss: warning: {}: {}{}\n", arguments.scene, which, warning);
    }
}

void report_failure(const RunArguments& arguments, const std::string& failure) {
    if (!failure.empty()) {
        fmt::print(stderr, "hybmss: error: {}: {}\n", arguments.scene, failure);
        throw CLI::RuntimeError(1);
    }
}

/// What came of it on stdout, warnings on stderr; throws where the run failed.
void report_end(const RunArguments& arguments, const Simulation& simulation, const Summary& summary) {
    if (arguments.quiet) {
        fmt::print("{}: {}{}\n", arguments.scene, summary_line(simulation, summary),
                   arguments.out.empty() ? "" : "; results in " + arguments.out);
    } else {
        fmt::print("{}", summary_table(simulation, summary));
        if (!arguments.out.empty()) {
            fmt::print("results in {}\n", arguments.out);
        }
    }
    report_warnings(arguments, simulation, summary);
    report_failure(arguments, summary.failure);
}

/// A run on the terminal and into its results.
class ShownRun {
public:
    explicit ShownRun(const std::string& scene) : scene_(scene), line_(stderr) {}

    /// `results`: may hold nothing. Both outlive the run.
    template <class AnyResults>
    RunCallbacks callbacks(std::optional<AnyResults>& results) {
        RunCallbacks callbacks;
        callbacks.estimate = [this](double seconds) { line_.expect(scene_, seconds); };
        if (line_.visible()) {
            callbacks.progress = [this](const Progress& progress) { line_.show(progress); };
        }
        if (results) {
            callbacks.output = [this, &results] {
                // Why the run failed is known at its end only, and tells more.
                try {
                    if (is_finite()) {
                        results->record();
                    }
                } catch (const NotFinite& error) {
                    not_finite_ = error.what();
                }
            };
        }
        return callbacks;
    }
    bool is_finite() const { return not_finite_.empty(); }
    /// Throws where a result was not finite.
    void end(const std::string& failure) {
        line_.clear();
        if (!is_finite()) {
            throw std::runtime_error(scene_ + ": " + not_finite_ + (failure.empty() ? "" : "; " + failure));
        }
    }

private:
    std::string scene_, not_finite_; ///< the result that was
    ProgressLine line_;
};

/// Nothing is written before the last mesh is solved: the others tell of the error alone.
void run_to_accuracy(const RunArguments& arguments, const Scene& scene) {
    if (arguments.restart) {
        throw std::invalid_argument("--restart: a static scene has no checkpoint to go on from");
    }
    AccuracyOptions options{arguments.plan.options(), !arguments.plan.names_precision(), {}, {}};
    ProgressLine line(stderr);
    show_meshes(line, arguments.scene, *scene.solver.accuracy, options);
    const AccurateSolution solution = solve_to_accuracy(scene, options);
    line.clear();
    std::optional<Results> results = open_results(arguments, solution.simulation, "");
    SimulationOptions used = options.simulation;
    used.precision = parse_precision(solution.summary.plan.precision);
    if (!arguments.quiet) {
        fmt::print("{:<24} {}\n", "body", body_line(solution.simulation, used));
    }
    if (results) {
        write(arguments.scene, solution.summary.failure, [&] {
            results->record();
            results->finish(solution.summary);
        });
    }
    report_end(arguments, solution.simulation, solution.summary);
}

/// Several bodies: no checkpoints, and a directory for each.
void run_world(const RunArguments& arguments, WorldScene scene) {
    if (arguments.restart) {
        throw std::invalid_argument("--restart: a scene of several bodies writes no checkpoint to go on from");
    }
    WorldSimulation world(std::move(scene), arguments.plan.options());
    std::optional<WorldResults> results;
    if (!arguments.out.empty()) {
        const std::filesystem::path out = arguments.out;
        check_output("--out", out / "summary.json", {"{\"converged\":", {arguments.scene}, arguments.force});
        check_output("--out", out / "bodies.pvd",
                     {"<?xmlversion=\"1.0\"?><VTKFile", {arguments.scene}, arguments.force});
        for (std::size_t b = 0; b < world.body_count(); ++b) {
            check_outputs(arguments, out / world.name(b));
        }
        try {
            results.emplace(out, world);
        } catch (const std::runtime_error& error) {
            throw std::invalid_argument(std::string("--out: ") + error.what());
        }
    }
    for (std::size_t b = 0; b < world.body_count(); ++b) {
        if (!arguments.quiet) {
            fmt::print("{:<24} {}\n", "body " + world.name(b), body_line(world.body(b), arguments.plan.options()));
            std::fflush(stdout);
        }
        if (const std::string parts = parts_line(world.body(b)); !parts.empty()) {
            fmt::print(stderr, "hybmss: warning: {}: body {} has {}\n", arguments.scene, world.name(b), parts);
        }
    }
    ShownRun shown(arguments.scene);
    const RunCallbacks callbacks = shown.callbacks(results);
    const WorldSummary summary = world.run(callbacks);
    shown.end(summary.failure);
    if (results) {
        write(arguments.scene, summary.failure, [&] { results->finish(summary); });
    }
    if (arguments.quiet) {
        fmt::print("{}: {}{}\n", arguments.scene, summary_line(world, summary),
                   arguments.out.empty() ? "" : "; results in " + arguments.out);
    } else {
        fmt::print("{}{}", summary_table(world, summary),
                   arguments.out.empty() ? "" : "results in " + arguments.out + "\n");
    }
    for (std::size_t b = 0; b < world.body_count(); ++b) {
        report_warnings(arguments, world.body(b), summary.bodies[b], "body " + world.name(b) + ": ");
    }
    report_failure(arguments, summary.failure);
}

void run_scene(const RunArguments& arguments) {
    std::variant<Scene, WorldScene> read = load_any_scene(arguments.scene);
    if (auto* const world = std::get_if<WorldScene>(&read)) {
        run_world(arguments, std::move(*world));
        return;
    }
    Scene scene = std::get<Scene>(std::move(read));
    if (scene.solver.accuracy) {
        run_to_accuracy(arguments, scene);
        return;
    }
    const SimulationOptions options = arguments.plan.options();
    std::string before;
    Simulation simulation = open_simulation(std::move(scene), arguments, options, before);
    std::optional<Results> results = open_results(arguments, simulation, before);
    std::optional<RunCheckpoint> checkpoint;
    if (!arguments.quiet) {
        fmt::print("{:<24} {}\n", "body", body_line(simulation, options));
        std::fflush(stdout); // the run may take long
    }
    if (const std::string parts = parts_line(simulation); !parts.empty()) {
        fmt::print(stderr, "hybmss: warning: {}: the body has {}\n", arguments.scene, parts);
    }
    ShownRun shown(arguments.scene);
    RunCallbacks callbacks = shown.callbacks(results);
    if (results && !timeless(simulation.scene().solver.method)) {
        checkpoint.emplace(arguments, simulation, *results);
        callbacks.checkpoint = [&] { return shown.is_finite() && (*checkpoint)(); };
        catch_stop_signals();
    }
    const Summary summary = simulation.run(callbacks);
    shown.end(summary.failure);
    if (summary.interrupted) {
        const int signal = caught;
        fmt::print(stderr,
                   "hybmss: stopped by {} after step {} (t = {:.6g} s); hybmss run {} --out {} --restart goes on\n",
                   signal_name(signal), summary.steps, summary.time, arguments.scene, arguments.out);
        throw CLI::RuntimeError(128 + signal); // as shells tell of a program that a signal ended
    }
    if (results) {
        write(arguments.scene, summary.failure, [&] { results->finish(summary); });
        if (checkpoint) {
            checkpoint->remove();
        }
    }
    report_end(arguments, simulation, summary);
}

void refuse_what_the_checkpoint_fixes(const CLI::App& command) {
    for (const char* fixed : {"--precision", "--layout", "--isa", "--effort", "--wisdom", "--one-tile"}) {
        if (command.get_option(fixed)->count() > 0) {
            throw std::invalid_argument(std::string(fixed) + " excludes --restart: what the checkpoint holds goes on");
        }
    }
}

} // namespace

void add_run_command(CLI::App& app) {
    const auto arguments = std::make_shared<RunArguments>();
    CLI::App* command = app.add_subcommand("run", "simulate a scene");
    command->add_option("SCENE", arguments->scene, "scene file (TOML)")->required();
    command->add_option("--out", arguments->out, "directory for summary.json, probes.csv, body_NNNN.vtu and body.pvd")
        ->check(a_path());
    add_force_option(*command, arguments->force);
    command->add_flag("--quiet", arguments->quiet, "one line at the end instead of tables");
    arguments->plan.add_to(*command, true);
    CLI::Option* restart =
        command->add_flag("--restart", arguments->restart,
                          "go on from the checkpoint in --out, with its precision, instruction set, layout and tiles");
    restart->needs("--out");
    command
        ->add_option("--checkpoint-every", arguments->checkpoint_every,
                     "wall time in s between checkpoints in --out; 0: at every check of the state")
        ->check(number(0, HUGE_VAL))
        ->capture_default_str()
        ->needs("--out");
    command->callback([arguments, command] {
        if (arguments->restart) {
            refuse_what_the_checkpoint_fixes(*command);
        }
        run_scene(*arguments);
    });
}
