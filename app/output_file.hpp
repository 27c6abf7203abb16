#pragma once

/// \file
/// The files that commands write besides what they print.

#include "simulation/results/atomic_file.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace hybmss {

/// What may be written over.
struct OutputRules {
    std::string_view beginning;           ///< of all that the option ever wrote, without blanks: such a file is ours
    std::vector<std::string> inputs = {}; ///< that the command reads: never
    bool force = false;                   ///< whatever else is there, too
};

/// --force.
void add_force_option(CLI::App& command, bool& force);

/// Call these before the work, so that a wrong path is known at once. They throw std::invalid_argument that names the
/// option where the file cannot be written, is read by the command, or is somebody else's.
void check_output(const std::string& option, const std::string& path, const OutputRules& rules);
/// Null for an empty path.
std::unique_ptr<AtomicFile> open_output(const std::string& option, const std::string& path, const OutputRules& rules);

} // namespace hybmss
