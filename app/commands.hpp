#pragma once

/// \file
/// The commands of the hybmss program. Each function adds one to the command line; its work runs as CLI11's callback.
/// Commands throw SceneError or std::invalid_argument for bad input (exit code 2), CLI::RuntimeError(1) for a run or
/// check that failed and has said so, and other exceptions for everything else (exit code 1).

namespace CLI {
class App;
}

void add_run_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_forces_command(CLI::App& app);
void add_record_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_verify_command(CLI::App& app);
void add_tune_command(CLI::App& app);
void add_bench_command(CLI::App& app);
