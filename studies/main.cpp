#include "app/command_line.hpp"
#include "hybmss/version.hpp"
#include "studies/commands.hpp"

int main(int argc, char** argv) {
    CLI::App app("What accuracy costs, the hard cases, and the paper's experiments", "hybmss-study");
    app.set_version_flag("--version", hybmss::kVersion);
    app.require_subcommand(1);
    add_paper_command(app);
    add_price_command(app);
    add_stability_command(app);
    add_textbook_command(app);
    add_law_command(app);
    add_angular_command(app);
    add_cells_command(app);
    add_volumes_command(app);
    add_tissue_command(app);
    add_calculix_command(app);
#ifdef HYBMSS_WITH_BENCH
    add_bench_command(app);
#endif
    return hybmss::run_command_line(app, argc, argv);
}
