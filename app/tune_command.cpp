#include "app/command_line.hpp"
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
        return arguments.check && !arguments.matrix ? check_rows(precisions, forces, arguments.threads)
                                                    : tune_matrix(precisions, forces);
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
    PlanOptions choice = plan.choice;
    choice.layout = choice.layout.empty() ? plan.layout : choice.layout; // which an estimate may leave open
    return name(candidate_of(choice));
}

/// A fixed choice, a measured one, and the best of all candidates: all on the whole body, built anew, in the same
/// rounds.
struct Checked {
    std::string row;
    ExhaustiveFigure estimated, measured, best;

    double slower_than_estimated() const { return measured.ns_per_cell_step / estimated.ns_per_cell_step - 1; }
    double slower_than_best() const { return measured.ns_per_cell_step / best.ns_per_cell_step - 1; }
};

Checked check(const TuneRow& row, const PlanOptions& options, const std::string& measured) {
    constexpr double kSecondsEach = 0.3;
    PlanOptions fixed = options;
    fixed.effort = Effort::estimate;
    const std::string estimated = chosen_name(describe_plan(row, fixed));
    const std::vector<ExhaustiveFigure> figures = time_exhaustively(row, options, kSecondsEach, {estimated, measured});
    const auto figure_of = [&](const std::string& name) {
        const auto found = std::find_if(figures.begin(), figures.end(), [&](const auto& f) { return f.name == name; });
        return found == figures.end() ? ExhaustiveFigure{name, HUGE_VAL} : *found;
    };
    Checked checked{row.name, figure_of(estimated), figure_of(measured), figures.front()};
    fmt::print("  check: the fastest of all candidates at length, on the whole body\n");
    for (const ExhaustiveFigure& figure : figures) {
        fmt::print("  {:<52} {:8.3g} ns a cell and step, {:.3f} times the best{}{}\n", figure.name,
                   figure.ns_per_cell_step, figure.ns_per_cell_step / checked.best.ns_per_cell_step,
                   figure.name == estimated ? " <- estimate" : "", figure.name == measured ? " <- chosen" : "");
    }
    return checked;
}

void print_checks(const std::vector<Checked>& checks) {
    fmt::print("\nns a cell and step\n{:<38} {:>8} {:>8} {:>8}  {}\n", "body", "estimate", "measure", "best",
               "estimate, measure, best where another");
    for (const Checked& c : checks) {
        fmt::print("{:<38} {:8.3g} {:8.3g} {:8.3g}  {}", c.row, c.estimated.ns_per_cell_step,
                   c.measured.ns_per_cell_step, c.best.ns_per_cell_step, c.estimated.name);
        fmt::print("{}", c.measured.name == c.estimated.name ? "" : ", " + c.measured.name);
        fmt::print("{}\n", c.best.name == c.measured.name ? "" : "; " + c.best.name);
    }
    const auto count = [&](const auto& holds) { return std::count_if(checks.begin(), checks.end(), holds); };
    fmt::print("of {}: measure at most 3 % slower than estimate {}, at least 10 % faster {}; best at most 5 % faster "
               "than measure {}, than estimate {}\n",
               checks.size(), count([](const Checked& c) { return c.slower_than_estimated() <= 0.03; }),
               count([](const Checked& c) { return c.slower_than_estimated() <= 1 / 1.1 - 1; }),
               count([](const Checked& c) { return c.slower_than_best() <= 0.05; }),
               count([](const Checked& c) { return c.estimated.ns_per_cell_step <= 1.05 * c.best.ns_per_cell_step; }));
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
        std::erase_if(rows, [](const TuneRow& row) { return row.network != nullptr; });
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
        "also time all candidates at length and compare the choice; without a SCENE, on 28 bodies of 10^2 to "
        "10^6 cells, with one thread and with all");
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
