#pragma once

/// \file
/// The options that every command on a scene takes: --isa, --threads, --precision, --layout.

#include "hybmss/simulation.hpp"

#include <string>

namespace CLI {
class App;
}

namespace hybmss {

struct PlanArguments {
    std::string instruction_set = "automatic", precision = "double", layout;
    int threads = 0;

    void add_to(CLI::App& command, bool with_layout);

    /// Throws std::invalid_argument for a name that is not known or not available here.
    SimulationOptions options() const;
};

/// Throws std::invalid_argument that lists the known names, unless `layout` is one of them or "".
void require_lattice_layout(const std::string& option, const std::string& layout, const std::string& besides = "");

} // namespace hybmss
