#include "app/command_line.hpp"
#include "app/commands.hpp"
#include "app/output_file.hpp"
#include "app/plan_arguments.hpp"
#include "app/scene_report.hpp"
#include "app/tune_rows.hpp"
#include "plan/tuning/candidates.hpp"
#include "simulation/run/memory.hpp"
#include "simulation/scene/scene_body.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace {

using namespace hybmss;

struct TuneArguments {
    std::string scene, wisdom_file, instruction_set = "automatic", layout, precision = "both", operation = "step";
    int threads = 0;
    bool one_tile = false;
    double seconds = 0.3;
    bool matrix = false, check = false, force = false;
};

std::vector<TuneRow> rows_of(const TuneArguments& arguments) {
    std::vector<Precision> precisions = {Precision::float32, Precision::float64};
    if (arguments.precision != "both") {
        precisions = {parse_precision(arguments.precision)};
    }
    const bool forces = arguments.operation == "forces";
    if (arguments.scene.empty()) {
        return arguments.check && !arguments.matrix ? check_rows(precisions, forces) : tune_matrix(precisions, forces);
    }
    const Scene scene = load_scene(arguments.scene);
    SimulationOptions largest;
    largest.precision = precisions.back();
    check_size(scene, largest, available_bytes());
    const Lattice lattice = scene_lattice(scene);
    std::vector<TuneRow> rows;
    for (const Precision precision : precisions) {
        rows.push_back(tune_row(arguments.scene, lattice, scene.material, precision, forces));
    }
    return rows;
}

std::filesystem::path file_of(const TuneArguments& arguments) {
    if (!arguments.wisdom_file.empty()) {
        return arguments.wisdom_file;
    }
    const std::filesystem::path file = default_wisdom_file();
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    if (error) {
        throw std::invalid_argument(file.parent_path().string() + ": cannot be made: " + error.message() +
                                    "; --wisdom names another file");
    }
    return file;
}

/// What the file holds; nothing where it is refused, for then it is replaced.
Wisdom wisdom_in(const std::filesystem::path& file) {
    Wisdom wisdom;
    if (std::filesystem::exists(file)) {
        try {
            wisdom.import_file(file);
        } catch (const WisdomError& error) {
            fmt::print(stderr, "hybmss: warning: {}; it is replaced\n", error.what());
        }
    }
    return wisdom;
}

void write(const Wisdom& wisdom, const std::filesystem::path& file) {
    try {
        wisdom.export_file(file);
    } catch (const WisdomError& error) {
        throw std::invalid_argument(std::string("--wisdom ") + error.what());
    }
}

std::string chosen_name(const PlanDescription& plan) {
    return name(candidate_of(plan.choice));
}

/// How far a choice is from the best of all candidates, timed at length.
struct Checked {
    std::string row, chosen, best;
    double distance; ///< 0.03: takes 3 % longer
};

Checked check(const TuneRow& row, const PlanOptions& options, const std::string& chosen) {
    constexpr double kSecondsEach = 0.3;
    const std::vector<ExhaustiveFigure> figures = time_exhaustively(row, options, kSecondsEach);
    const double best = figures.front().ns_per_cell_step;
    fmt::print("  check: all candidates at length, on the whole body\n");
    Checked checked{row.name, chosen, figures.front().name, HUGE_VAL};
    for (const ExhaustiveFigure& figure : figures) {
        fmt::print("  {:<52} {:8.3g} ns a cell and step, {:.3f} times the best{}\n", figure.name,
                   figure.ns_per_cell_step, figure.ns_per_cell_step / best, figure.name == chosen ? " <- chosen" : "");
        if (figure.name == chosen) {
            checked.distance = figure.ns_per_cell_step / best - 1;
        }
    }
    return checked;
}

void print_checks(const std::vector<Checked>& checks) {
    fmt::print("\n{:<32} {:<48} {:<48} {:>8}\n", "body", "chosen", "best at length", "slower");
    for (const Checked& c : checks) {
        fmt::print("{:<32} {:<48} {:<48} {:6.1f} %\n", c.row, c.chosen, c.best, 100 * c.distance);
    }
    const auto near = std::count_if(checks.begin(), checks.end(), [](const Checked& c) { return c.distance <= 0.05; });
    fmt::print("{} of {} choices within 5 % of the best\n", near, checks.size());
}

void tune(const TuneArguments& arguments) {
    PlanOptions options;
    options.instruction_set = parse_instruction_set(arguments.instruction_set);
    resolve(options.instruction_set);
    require_lattice_layout("--layout", arguments.layout);
    options.layout = arguments.layout;
    options.threads = arguments.threads;
    options.one_tile = arguments.one_tile;
    options.effort = Effort::measure;
    options.measure_seconds = arguments.seconds;

    std::vector<TuneRow> rows = rows_of(arguments);
    if (!options.layout.empty()) {
        std::erase_if(rows, [](const TuneRow& row) { return row.as_network; });
    }
    const std::filesystem::path file = file_of(arguments);
    // Opened and left, so that a wrong path is known before the work; every row writes it anew.
    open_output("--wisdom", file, {"#Whathybmssmeasured.", {arguments.scene}, arguments.force});
    Wisdom wisdom = wisdom_in(file);
    const bool terminal = isatty(fileno(stderr)) == 1;
    std::vector<Checked> checks;
    for (std::size_t r = 0; r < rows.size(); ++r) {
        if (terminal) {
            fmt::print(stderr, "\r\033[K[{} of {}] {}", r + 1, rows.size(), rows[r].name);
            std::fflush(stderr);
        }
        Wisdom found; // empty, so that what is known already is measured anew
        options.wisdom = &found;
        const PlanDescription plan = describe_plan(rows[r], options);
        wisdom.merge(found);
        write(wisdom, file); // after every row: a kill loses one
        if (terminal) {
            fmt::print(stderr, "\r\033[K");
        }
        fmt::print("{}: {}\n  {}\n", rows[r].name, chosen_name(plan), plan.reason);
        if (!arguments.scene.empty() || arguments.check) {
            fmt::print("{}", candidate_lines(plan));
        }
        if (arguments.check) {
            checks.push_back(check(rows[r], options, chosen_name(plan)));
        }
        std::fflush(stdout);
    }
    if (arguments.check) {
        print_checks(checks);
    }
    fmt::print("{} entries in {}\n", wisdom.entries(), file.string());
}

} // namespace

void add_tune_command(CLI::App& app) {
    const auto arguments = std::make_shared<TuneArguments>();
    CLI::App* command = app.add_subcommand("tune", "measure which plans are fastest here, and store it as wisdom");
    CLI::Option* scene = command->add_option("SCENE", arguments->scene, "scene file (TOML) whose body to measure");
    command
        ->add_flag("--matrix", arguments->matrix,
                   "measure cubes of all usual sizes; the default without a SCENE or --check")
        ->excludes(scene);
    command->add_option("--wisdom", arguments->wisdom_file,
                        "file to add to; default: $XDG_CACHE_HOME/hybmss/wisdom or ~/.cache/hybmss/wisdom");
    add_force_option(*command, arguments->force);
    command->add_flag(
        "--check", arguments->check,
        "also time all candidates at length and compare the choice; without a SCENE, on the meshes of the "
        "paper's Table 6 and a hollow ball of voxels");
    command->add_option("--seconds", arguments->seconds, "for timing, a body")
        ->check(number(0.01, 3600))
        ->capture_default_str();
    command->add_option("--operation", arguments->operation, "step (what run does) or forces (ForcePlan)")
        ->check(CLI::IsMember({"step", "forces"}))
        ->capture_default_str();
    command->add_option("--precision", arguments->precision, "float, double or both")
        ->check(CLI::IsMember({"float", "double", "both"}))
        ->capture_default_str();
    command->add_option("--threads", arguments->threads, "worker threads at most; 0: all of the machine")
        ->check(whole_number(0, 4096))
        ->capture_default_str();
    command->add_option("--isa", arguments->instruction_set, "instruction set: automatic, sse2, avx2, avx512 or neon")
        ->capture_default_str();
    command->add_option("--layout", arguments->layout, "for lattices, this layout only");
    add_tile_option(*command, arguments->one_tile);
    command->callback([arguments] { tune(*arguments); });
}
