#include "app/plan_arguments.hpp"

#include "app/command_line.hpp"
#include "layouts/messages.hpp"
#include "plan/bodies/layout_table.hpp"

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace hybmss {

void PlanArguments::add_to(CLI::App& command, bool with_layout) {
    command.add_option("--isa", instruction_set, "instruction set: automatic, sse2, avx2, avx512 or neon")
        ->capture_default_str();
    command.add_option("--threads", threads, "worker threads at most; 0: all of the machine")
        ->check(whole_number(0, 4096))
        ->capture_default_str();
    precision_option_ = command.add_option("--precision", precision, "float or double")->capture_default_str();
    command
        .add_option(
            "--effort", effort,
            "how the plan chooses: estimate (nothing is timed), measure (times the candidates), stored (wisdom)")
        ->check(CLI::IsMember({"estimate", "measure", "stored"}))
        ->capture_default_str();
    command.add_option("--wisdom", wisdom_file,
                       "wisdom that --effort measure and stored read; default: where hybmss tune puts it");
    if (with_layout) {
        command.add_option("--layout", layout, "how the body lies in memory; default: the plan's choice");
    }
    add_tile_option(command, one_tile);
}

bool PlanArguments::names_precision() const {
    return precision_option_->count() > 0;
}

SimulationOptions PlanArguments::options() const {
    SimulationOptions options;
    options.precision = parse_precision(precision);
    options.plan.instruction_set = parse_instruction_set(instruction_set);
    resolve(options.plan.instruction_set); // refuses what the machine has not
    options.plan.threads = threads;
    options.plan.one_tile = one_tile;
    require_lattice_layout("--layout", layout);
    options.plan.layout = layout;
    options.plan.effort = parse_effort(effort);
    if (options.plan.effort == Effort::estimate) {
        if (!wisdom_file.empty()) {
            throw std::invalid_argument("--wisdom " + wisdom_file +
                                        ": only --effort measure and --effort stored read wisdom");
        }
    } else {
        read_wisdom(options.plan.effort);
        options.plan.wisdom = wisdom.get();
    }
    return options;
}

void PlanArguments::read_wisdom(Effort wanted) const {
    const std::filesystem::path file = wisdom_file.empty() ? default_wisdom_file() : std::filesystem::path(wisdom_file);
    if (wanted == Effort::measure && wisdom_file.empty() && !std::filesystem::exists(file)) {
        return;
    }
    try {
        wisdom->import_file(file);
    } catch (const WisdomError& error) {
        if (wanted == Effort::stored) {
            throw std::invalid_argument(std::string("--effort stored: ") + error.what() +
                                        "; hybmss tune makes new wisdom");
        }
        std::fprintf(stderr, "hybmss: warning: %s; measuring instead\n", error.what());
    }
}

void add_tile_option(CLI::App& command, bool& one_tile) {
    command.add_flag("--one-tile", one_tile, "the body in one piece, so with one thread: other last bits, no joins");
}

std::filesystem::path default_wisdom_file() {
    const auto directory = [](const char* variable) {
        const char* value = std::getenv(variable);
        return std::filesystem::path(value ? value : "");
    };
    // The XDG base directory specification: a path that is not absolute is to be ignored.
    std::filesystem::path cache = directory("XDG_CACHE_HOME");
    if (!cache.is_absolute()) {
        cache = directory("HOME");
        if (!cache.is_absolute()) {
            throw std::invalid_argument("--wisdom is needed: the environment names neither HOME nor XDG_CACHE_HOME");
        }
        cache /= ".cache";
    }
    return cache / "hybmss" / "wisdom";
}

void require_lattice_layout(const std::string& option, const std::string& layout, const std::string& besides) {
    if (!layout.empty() && !is_layout(layout, false)) {
        throw std::invalid_argument(option + " " + layout + ": not known; allowed are " +
                                    joined(lattice_layouts(), ", ") + besides);
    }
}

} // namespace hybmss
