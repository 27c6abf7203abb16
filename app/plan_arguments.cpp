#include "app/plan_arguments.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <stdexcept>

namespace hybmss {

void PlanArguments::add_to(CLI::App& command, bool with_layout) {
    command.add_option("--isa", instruction_set, "instruction set: automatic, sse2, avx2, avx512 or neon")
        ->capture_default_str();
    command.add_option("--threads", threads, "worker threads at most; 0: all of the machine")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    command.add_option("--precision", precision, "float or double")->capture_default_str();
    if (with_layout) {
        command.add_option("--layout", layout, "how the body lies in memory; default: the plan's choice");
    }
}

SimulationOptions PlanArguments::options() const {
    SimulationOptions options;
    options.precision = parse_precision(precision);
    options.plan.instruction_set = resolve(parse_instruction_set(instruction_set));
    options.plan.threads = threads;
    require_lattice_layout("--layout", layout);
    options.plan.layout = layout;
    return options;
}

void require_lattice_layout(const std::string& option, const std::string& layout, const std::string& besides) {
    const std::vector<std::string> known = lattice_layouts();
    if (layout.empty() || std::find(known.begin(), known.end(), layout) != known.end()) {
        return;
    }
    std::string list;
    for (const std::string& one : known) {
        list += (list.empty() ? "" : ", ") + one;
    }
    throw std::invalid_argument(option + " " + layout + ": not known; allowed are " + list + besides);
}

} // namespace hybmss
