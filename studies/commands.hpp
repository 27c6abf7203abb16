#pragma once

/// \file
/// The commands of the hybmss-study program, by the same rules as those of hybmss (app/command_line.hpp).

namespace CLI {
class App;
}

void add_stability_command(CLI::App& app);
void add_paper_command(CLI::App& app);
void add_price_command(CLI::App& app);
void add_textbook_command(CLI::App& app);
void add_law_command(CLI::App& app);
void add_angular_command(CLI::App& app);
void add_cells_command(CLI::App& app);
void add_volumes_command(CLI::App& app);
void add_tissue_command(CLI::App& app);
void add_calculix_command(CLI::App& app);
void add_bench_command(CLI::App& app);
