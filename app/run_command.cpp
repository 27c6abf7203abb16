#include "app/body_report.hpp"
#include "app/commands.hpp"
#include "app/plan_arguments.hpp"
#include "app/progress_line.hpp"
#include "app/summary_table.hpp"
#include "simulation/results.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>

namespace {

using namespace hybmss;

struct RunArguments {
    std::string scene, out;
    PlanArguments plan;
};

/// Everything about the scene is checked before the directory is made, so that bad input leaves nothing behind.
std::optional<Results> open_results(const std::string& directory, const Simulation& simulation) {
    if (directory.empty()) {
        return std::nullopt;
    }
    try {
        return std::optional<Results>(std::in_place, directory, simulation);
    } catch (const std::runtime_error& error) {
        throw std::invalid_argument(std::string("--out: ") + error.what());
    }
}

void run_scene(const RunArguments& arguments) {
    const SimulationOptions options = arguments.plan.options();
    Simulation simulation(load_scene(arguments.scene), options);
    std::optional<Results> results = open_results(arguments.out, simulation);
    fmt::print("{:<24} {}\n", "body", body_line(simulation, options));
    std::fflush(stdout); // the run may take long
    if (const std::string parts = parts_line(simulation.lattice()); !parts.empty()) {
        fmt::print(stderr, "hybmss: warning: {}: the body has {}\n", arguments.scene, parts);
    }
    ProgressLine line(stderr);
    RunCallbacks callbacks;
    if (line.visible()) {
        callbacks.progress = [&](const Progress& progress) { line.show(progress); };
    }
    if (results) {
        callbacks.output = [&] { results->record(); };
    }
    const Summary summary = simulation.run(callbacks);
    line.clear();
    if (results) {
        results->finish(summary);
    }
    fmt::print("{}", summary_table(simulation, summary));
    if (results) {
        fmt::print("results in {}\n", arguments.out);
    }
    if (summary.volume.min_cell_volume_ratio <= 0) {
        // An inverted cell can hold a lattice in a false equilibrium, so a settled result needs this word of caution.
        fmt::print(
            stderr,
            "hybmss: warning: {}: some cells are inverted (smallest volume ratio {:.3g}); a slower motion may help\n",
            arguments.scene, summary.volume.min_cell_volume_ratio);
    }
    if (!summary.failure.empty()) {
        fmt::print(stderr, "hybmss: error: {}: {}\n", arguments.scene, summary.failure);
        throw CLI::RuntimeError(1);
    }
}

} // namespace

void add_run_command(CLI::App& app) {
    const auto arguments = std::make_shared<RunArguments>();
    CLI::App* command = app.add_subcommand("run", "simulate a scene");
    command->add_option("SCENE", arguments->scene, "scene file (TOML)")->required();
    command->add_option("--out", arguments->out, "directory for summary.json, probes.csv, body_NNNN.vtu and body.pvd");
    arguments->plan.add_to(*command, true);
    command->callback([arguments] { run_scene(*arguments); });
}
