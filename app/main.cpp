#include "app/command_line.hpp"
#include "hybmss/version.hpp"

int main(int argc, char** argv) {
    CLI::App app("Hybrid 3D mass-spring system: soft bodies of any Poisson's ratio", "hybmss");
    app.set_version_flag("--version", hybmss::kVersion);
    app.require_subcommand(1);
    add_run_command(app);
#ifndef HYBMSS_RUN_ALONE
    add_explain_command(app);
    add_forces_command(app);
    add_record_command(app);
    add_replay_command(app);
    add_verify_command(app);
    add_tune_command(app);
#ifdef HYBMSS_WITH_VIEW
    add_view_command(app);
#endif
#ifdef HYBMSS_WITH_BENCH
    add_bench_command(app);
#endif
#endif
    return hybmss::run_command_line(app, argc, argv);
}
