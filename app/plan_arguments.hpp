#pragma once

/// \file
/// The options that every command on a scene takes: --isa, --threads, --precision, --layout, --one-tile, --effort,
/// --wisdom.

#include "hybmss/simulation/simulation.hpp"
#include "hybmss/wisdom.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace hybmss {

struct PlanArguments {
    std::string instruction_set = "automatic", precision = "double", layout, effort = "estimate", wisdom_file;
    int threads = 0;
    bool one_tile = false;
    std::shared_ptr<Wisdom> wisdom = std::make_shared<Wisdom>(); ///< what options() refers to

    void add_to(CLI::App& command, bool with_layout);
    /// Whether --precision was on the command line.
    bool names_precision() const;

    /// Reads the wisdom where the effort asks for it. Wisdom that is refused is an error for `stored`; for `measure` a
    /// warning on stderr, for then the plan measures. Throws std::invalid_argument for that, and for a name that is not
    /// known or not available here.
    SimulationOptions options() const;

private:
    void read_wisdom(Effort wanted) const;
    CLI::Option* precision_option_ = nullptr;
};

/// --one-tile
void add_tile_option(CLI::App& command, bool& one_tile);

/// Where wisdom is kept unless --wisdom says otherwise: $XDG_CACHE_HOME/hybmss/wisdom or ~/.cache/hybmss/wisdom. Throws
/// std::invalid_argument where the environment names neither.
std::filesystem::path default_wisdom_file();

/// Throws std::invalid_argument that lists the known names, unless `layout` is one of them or "".
void require_lattice_layout(const std::string& option, const std::string& layout, const std::string& besides = "");

} // namespace hybmss
