#pragma once

#include <CLI/CLI.hpp>

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

} // namespace hybmss
