#pragma once

/// \file
/// What commands share: how a command line is parsed and ends, the values of options, the files that commands write.

#include "simulation/results/atomic_file.hpp"

#include <CLI/CLI.hpp>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// Parses the arguments, which runs the chosen command, and turns what it throws into one line on stderr and an exit
/// code: 0 good, 1 the simulation or check failed, 2 bad input.
int run_command_line(CLI::App& app, int argc, const char* const* argv);

/// For options that name a file or a directory: an empty one is most likely a variable that was not set.
CLI::Validator a_path();

/// For options that take a number in a range; CLI11's own lets NaN pass, and refuses "1.5" as out of range.
CLI::Validator number(double low, double high);
CLI::Validator whole_number(double low, double high);
CLI::Validator a_seed();

// ---- the files that commands write besides what they print

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

// The commands of the hybmss program. Each function adds one to the command line; its work runs as CLI11's callback.
// Commands throw SceneError or std::invalid_argument for bad input (exit code 2), CLI::RuntimeError(1) for a run or
// check that failed and has said so, and other exceptions for everything else (exit code 1).
void add_run_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_forces_command(CLI::App& app);
void add_record_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_verify_command(CLI::App& app);
void add_tune_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_bench_command(CLI::App& app);
