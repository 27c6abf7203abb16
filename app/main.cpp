#include "app/commands.hpp"
#include "hybmss/scene.hpp"
#include "hybmss/version.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace {

constexpr int kFailed = 1, kBadInput = 2;

int report(std::string message, int code) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    std::fprintf(stderr, "hybmss: error: %s\n", message.c_str());
    return code;
}

int run(int argc, char** argv) {
    CLI::App app("Hybrid 3D mass-spring system: soft bodies of any Poisson's ratio", "hybmss");
    app.set_version_flag("--version", hybmss::kVersion);
    app.require_subcommand(1);
    add_run_command(app);
    add_explain_command(app);
    add_forces_command(app);
    add_verify_command(app);
    add_tune_command(app);
#ifdef HYBMSS_WITH_BENCH
    add_bench_command(app);
#endif
    try {
        app.parse(argc, argv);
    } catch (const CLI::RuntimeError& error) {
        return error.get_exit_code();
    } catch (const CLI::Success& asked) { // --help, --version
        return app.exit(asked);
    } catch (const CLI::Error& error) {
        return report(std::string(error.what()) + " (see hybmss --help)", kBadInput);
    }
    // What was printed may have gone to a full disk.
    return std::fflush(stdout) == 0 ? 0 : report("standard output: cannot be written", kFailed);
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const hybmss::SceneError& error) {
        return report(error.what(), kBadInput);
    } catch (const std::invalid_argument& error) {
        return report(error.what(), kBadInput);
    } catch (const std::bad_alloc&) {
        return report("out of memory", kFailed);
    } catch (const std::exception& error) {
        return report(error.what(), kFailed);
    } catch (...) {
        return report("unknown failure", kFailed);
    }
}
