#include "app/command_line.hpp"

#include "hybmss/simulation/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
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

/// CLI11 says of an unknown command that one is needed, and of none at all no more. "" where it may go on.
std::string wrong_command(const CLI::App& app, int argc, const char* const* argv) {
    const auto known = app.get_subcommands([](const CLI::App*) { return true; });
    std::string names;
    for (const CLI::App* command : known) {
        names += (names.empty() ? "" : ", ") + command->get_name();
    }
    if (names.empty()) {
        return "";
    }
    if (argc < 2) {
        return "a command is needed: one of " + names;
    }
    const std::string word = argv[1];
    if (word.starts_with("-")) {
        return app.get_option_no_throw(word) ? "" : word + ": no such option; a command comes first: one of " + names;
    }
    for (const CLI::App* command : known) {
        if (command->get_name() == word) {
            return wrong_command(*command, argc - 1, argv + 1);
        }
    }
    return "\"" + word + "\" is no command; there are " + names;
}

int parse(CLI::App& app, int argc, const char* const* argv) {
    if (const std::string wrong = wrong_command(app, argc, argv); !wrong.empty()) {
        return report(app, wrong, kBadInput);
    }
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

CLI::Validator in_range(double low, double high, bool whole) {
    return CLI::Validator(
        [=](const std::string& text) {
            double value = 0;
            const bool good = CLI::detail::lexical_cast(text, value) && value >= low && value <= high &&
                              (!whole || value == std::floor(value));
            // As digits: the option's own type may know no fraction and no exponent.
            const bool digits = !whole || text.find_first_not_of("+-0123456789") == std::string::npos;
            const char* kind = whole ? "whole number" : "number";
            return good && digits ? std::string()
                   : std::isinf(high)
                       ? fmt::format("{}: it must be a {} at least {:g}", text, kind, low)
                       : fmt::format("{}: it must be a {} from {:.10g} to {:.10g}", text, kind, low, high);
        },
        "");
}

/// Empty files too: mktemp makes them.
bool begins_with(const std::string& path, std::string_view beginning) {
    std::ifstream file(path, std::ios::binary);
    std::size_t matched = 0;
    for (char c; matched < beginning.size() && file.get(c);) {
        if (std::isspace(static_cast<unsigned char>(c)) == 0 && c != beginning[matched++]) {
            return false;
        }
    }
    return matched == 0 || matched == beginning.size();
}

} // namespace

CLI::Validator a_path() {
    return CLI::Validator(
        [](const std::string& path) { return path.empty() ? std::string("it must not be empty") : std::string(); }, "");
}

CLI::Validator number(double low, double high) {
    return in_range(low, high, false);
}

CLI::Validator whole_number(double low, double high) {
    return in_range(low, high, true);
}

CLI::Validator a_seed() {
    return whole_number(0, std::numeric_limits<unsigned>::max());
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

void add_force_option(CLI::App& command, bool& force) {
    command.add_flag("--force", force, "write over a file that is no earlier output too");
}

void check_output(const std::string& option, const std::string& path, const OutputRules& rules) {
    std::error_code error;
    for (const std::string& input : rules.inputs) {
        if (std::filesystem::equivalent(path, input, error)) {
            throw std::invalid_argument(option + " " + path + ": this file is read; the output must be another one");
        }
    }
    if (!rules.force && std::filesystem::is_regular_file(path, error) && !begins_with(path, rules.beginning)) {
        throw std::invalid_argument(option + " " + path +
                                    ": a file that is no earlier output of this is there; --force replaces it");
    }
}

std::unique_ptr<AtomicFile> open_output(const std::string& option, const std::string& path, const OutputRules& rules) {
    if (path.empty()) {
        return nullptr;
    }
    check_output(option, path, rules);
    try {
        return std::make_unique<AtomicFile>(path);
    } catch (const std::runtime_error& error) {
        throw std::invalid_argument(option + " " + error.what());
    }
}

} // namespace hybmss
