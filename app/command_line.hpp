#pragma once

#include <CLI/CLI.hpp>

namespace hybmss {

/// Parses the arguments, which runs the chosen command, and turns what it throws into one line on stderr and an exit
/// code: 0 good, 1 the simulation or check failed, 2 bad input.
int run_command_line(CLI::App& app, int argc, const char* const* argv);

/// For options that name a file or a directory: an empty one is most likely a variable that was not set.
CLI::Validator a_path();

} // namespace hybmss
