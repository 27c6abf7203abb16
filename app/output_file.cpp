#include "app/output_file.hpp"

#include <CLI/CLI.hpp>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace hybmss {
namespace {

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
