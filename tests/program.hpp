#pragma once

/// \file
/// Runs the hybmss program as a shell would, in a directory of its own.

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace hybmss::test {

inline std::string read_text(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    EXPECT_TRUE(file) << path;
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

/// Removed with all it holds at the end.
class TemporaryDirectory {
public:
    TemporaryDirectory() {
        std::string pattern = (std::filesystem::temp_directory_path() / "hybmss-test-XXXXXX").string();
        if (!mkdtemp(pattern.data())) {
            throw std::runtime_error("no temporary directory");
        }
        path_ = pattern;
    }
    TemporaryDirectory(const TemporaryDirectory&) = delete;
    TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
    ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

struct ProgramResult {
    int exit_code = -1;
    std::string output, errors;
};

/// `hybmss ARGUMENTS` (or another program) with `directory` as the working directory.
inline ProgramResult run_program(const std::string& arguments, const std::filesystem::path& directory,
                                 const std::string& program = HYBMSS_APP) {
    TemporaryDirectory streams;
    const std::string out = streams.path() / "out", err = streams.path() / "err";
    const std::string command = "cd '" + directory.string() + "' && '" + program + "' " + arguments + " >'" + out +
                                "' 2>'" + err + "' </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(out), read_text(err)};
}

inline std::string example(const std::string& name) {
    return HYBMSS_SOURCE_DIR "/examples/scenes/" + name + ".toml";
}

/// A small scene that settles at once; `replace` swaps one line, which must be there, for another.
inline std::string small_scene(const std::string& line = "", const std::string& replacement = "") {
    std::string text = "[body]\n"                        // 1
                       "cells = [2, 3, 4]\n"             // 2
                       "cell_size = 0.5\n"               // 3
                       "[material]\n"                    // 4
                       "young_modulus = 1e4\n"           // 5
                       "poisson_ratio = 0.3\n"           // 6
                       "density = 1000\n"                // 7
                       "[[fix]]\n"                       // 8
                       "where = \"y-min\"\n"             // 9
                       "[[move]]\n"                      // 10
                       "where = \"y-max\"\n"             // 11
                       "translate = [0, -0.1, 0]\n"      // 12
                       "over = 1\n"                      // 13
                       "[damping]\n"                     // 14
                       "mass = 3\n"                      // 15
                       "[solver]\n"                      // 16
                       "method = \"symplectic-euler\"\n" // 17
                       "duration = 30\n"                 // 18
                       "tolerance = 1e-4\n"              // 19
                       "[output]\n"                      // 20
                       "every = 0.5\n"                   // 21
                       "[[probe]]\n"                     // 22
                       "name = \"plate\"\n"              // 23
                       "where = \"y-max\"\n";            // 24
    if (!line.empty()) {
        const std::size_t at = text.find(line + "\n");
        EXPECT_NE(at, std::string::npos) << line;
        text.replace(at, line.size(), replacement);
    }
    return text;
}

} // namespace hybmss::test
