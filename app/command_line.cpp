#include "app/command_line.hpp"

#include "hybmss/simulation/scene.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

constexpr int kFailed = 1, kBadInput = 2;

int report(const CLI::App& app, std::string message, int code) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    std::fprintf(stderr, "%s: error: %s\n", app.get_name().c_str(), message.c_str());
    return code;
}

int parse(CLI::App& app, int argc, const char* const* argv) {
    try {
        app.parse(argc, argv);
    } catch (const CLI::RuntimeError& error) {
        return error.get_exit_code();
    } catch (const CLI::Success& asked) { // --help, --version
        app.exit(asked);
    } catch (const CLI::Error& error) {
        return report(app, std::string(error.what()) + " (see " + app.get_name() + " --help)", kBadInput);
    }
    // What was printed may have gone to a full disk.
    return std::fflush(stdout) == 0 && std::ferror(stdout) == 0
               ? 0
               : report(app, "standard output: cannot be written", kFailed);
}

} // namespace

CLI::Validator a_path() {
    return CLI::Validator(
        [](const std::string& path) { return path.empty() ? std::string("it must not be empty") : std::string(); }, "");
}

int run_command_line(CLI::App& app, int argc, const char* const* argv) {
    try {
        return parse(app, argc, argv);
    } catch (const SceneError& error) {
        return report(app, error.what(), kBadInput);
    } catch (const std::invalid_argument& error) {
        return report(app, error.what(), kBadInput);
    } catch (const std::bad_alloc&) {
        return report(app, "out of memory", kFailed);
    } catch (const std::exception& error) {
        return report(app, error.what(), kFailed);
    } catch (...) {
        return report(app, "unknown failure", kFailed);
    }
}

} // namespace hybmss
