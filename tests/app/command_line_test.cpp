/// What all commands have in common: words that they do not know, numbers out of range, files that they must not touch.

#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <thread>

namespace hybmss {
namespace {

using test::read_text;
using test::run_program;
using test::write_text;

struct CommandLine : ::testing::Test {
    CommandLine() { write_text(file("s.toml"), test::small_scene()); }

    std::filesystem::path file(const std::string& name) const { return directory.path() / name; }

    /// Exit code 2, nothing on stdout, one line on stderr that has `words` in it.
    void expect_refused(const std::string& arguments, const std::string& words) const {
        const test::ProgramResult result = run_program(arguments, directory.path());
        EXPECT_EQ(result.exit_code, 2) << arguments;
        EXPECT_EQ(result.output, "") << arguments;
        EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << arguments << result.errors;
        EXPECT_NE(result.errors.find(words), std::string::npos) << arguments << ": " << result.errors;
    }
    void expect_success(const std::string& arguments) const {
        const test::ProgramResult result = run_program(arguments, directory.path());
        EXPECT_EQ(result.exit_code, 0) << arguments << ": " << result.errors;
    }

    test::TemporaryDirectory directory;
};

TEST_F(CommandLine, unknown_words_are_named) {
    expect_refused("", "a command is needed: one of run, explain");
    expect_refused("walk", "\"walk\" is no command; there are run, explain");
    expect_refused("--walk", "--walk: no such option");
    expect_refused("run s.toml --walk", "--walk");
    expect_refused("run", "SCENE is required");
    expect_success("--version");
    expect_success("run --help");
}

TEST_F(CommandLine, numbers_are_held_to_their_range) {
    expect_refused("run s.toml --threads 1.5", "--threads: 1.5: it must be a whole number from 0 to 4096");
    expect_refused("run s.toml --threads -1", "from 0 to 4096");
    expect_refused("run s.toml --out o --checkpoint-every nan", "nan: it must be a number at least 0");
    expect_refused("record s.toml --out r --states 1e3", "1e3: it must be a whole number");
    expect_refused("verify --seed 4294967296", "4294967296: it must be a whole number from 0 to 4294967295");
}

TEST_F(CommandLine, what_is_read_is_not_written) {
    const std::string scene = read_text(file("s.toml"));
    write_text(file("u.csv"), "x,y,z\n");
    for (const std::string force : {"", " --force"}) {
        expect_refused("record s.toml --out ./s.toml" + force, "--out ./s.toml: this file is read");
        expect_refused("explain s.toml --json s.toml" + force, "--json s.toml: this file is read");
        expect_refused("tune s.toml --wisdom s.toml" + force, "--wisdom s.toml: this file is read");
        expect_refused("forces s.toml --displacements u.csv --out u.csv" + force, "--out u.csv: this file is read");
    }
    EXPECT_EQ(read_text(file("s.toml")), scene);
    EXPECT_EQ(read_text(file("u.csv")), "x,y,z\n");
}

TEST_F(CommandLine, foreign_files_stay_unless_forced) {
    std::filesystem::create_directory(file("o"));
    const std::pair<const char*, const char*> cases[] = {{"explain s.toml --json theirs", "theirs"},
                                                         {"record s.toml --out theirs", "theirs"},
                                                         {"run s.toml --out o", "o/summary.json"},
                                                         {"run s.toml --out o", "o/probes.csv"},
                                                         {"run s.toml --out o", "o/body.pvd"}};
    for (const auto& [arguments, name] : cases) {
        write_text(file(name), "theirs");
        expect_refused(arguments, std::string(name) + ": a file that is no earlier output");
        EXPECT_EQ(read_text(file(name)), "theirs") << arguments;
        expect_success(std::string(arguments) + " --force");
        EXPECT_NE(read_text(file(name)), "theirs") << arguments;
        expect_success(arguments); // its own
    }
    write_text(file("short"), "{"); // the beginning of one
    expect_refused("explain s.toml --json short", "short: a file that is no earlier output");
}

// Plans of two and of more threads than there are cores, at once: oneTBB has nothing to say to that.
TEST_F(CommandLine, threads_beyond_the_cores_are_no_matter) {
    write_text(file("l.toml"), test::small_scene("cells = [2, 3, 4]", "cells = [24, 24, 24]"));
    const std::string threads = std::to_string(4 * std::max(std::thread::hardware_concurrency(), 1u));
    const test::ProgramResult result =
        run_program("tune l.toml --seconds 0.01 --wisdom w --threads " + threads, directory.path());
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.errors, "");
}

// What was refused by a wrong reason once, or not at all.
TEST_F(CommandLine, files_and_numbers_are_refused_by_their_reason) {
    expect_refused("replay missing", "missing: cannot be read: No such file or directory");
    expect_refused("replay .", ".: cannot be read: it is a directory");
    expect_refused("forces s.toml --displacements .", ".: cannot be read: it is a directory");
    expect_refused("bench --min-time nan", "--min-time: nan: it must be a number from 0.01 to 3600");
    for (const char* command : {"explain s.toml --json", "record s.toml --out", "tune s.toml --wisdom",
                                "forces s.toml --displacements s.toml --out", "verify --json", "bench --json"}) {
        expect_refused(std::string(command) + " none/x", "none/x: cannot be written: No such file or directory");
        expect_refused(std::string(command) + " .", " .: cannot be written: it is a directory");
    }
    expect_refused("run s.toml --out s.toml/x", "--out: s.toml/x: this directory cannot be made");
}

TEST_F(CommandLine, quiet_run_is_one_line) {
    const test::ProgramResult result = run_program("run s.toml --quiet --out o", directory.path());
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(result.errors, "");
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
    for (const char* part : {"s.toml: settled (", "24 cells", "results in o"}) {
        EXPECT_NE(result.output.find(part), std::string::npos) << result.output;
    }
}

TEST_F(CommandLine, price_of_a_digit_has_every_type_and_level) {
    expect_refused("bench --price --effects", "at most 1");
    expect_success("bench --price --min-time 0.01 --json p.json");
    const auto rows = nlohmann::json::parse(read_text(file("p.json"))).at("benchmarks");
    std::set<std::string> names;
    for (const auto& row : rows) {
        names.insert(row.at("name"));
        EXPECT_GT(row.at("ns_per_cell"), 0.0) << row;
        // `fast` in double is an estimate and one step, where a set has estimates: no better than float.
        const auto name = row.at("name").get<std::string>();
        const bool rough = name.find("float") != std::string::npos || name.find("fast") != std::string::npos;
        EXPECT_LT(row.at("error_at_0.01"), rough ? 1e-5 : 1e-12) << row;
        EXPECT_GT(row.at("error_at_0.01"), 0.0) << row;
    }
    EXPECT_EQ(names.size(), 6U);
}

TEST_F(CommandLine, realtime_rows_hold_their_frames) {
    expect_refused("bench --realtime --price", "at most 1");
    expect_success("bench --realtime --quick --isa sse2 --filter 10mm/1000Hz/.*/float --json r.json");
    const auto rows = nlohmann::json::parse(read_text(file("r.json"))).at("benchmarks");
    ASSERT_EQ(rows.size(), 2U);
    for (const auto& row : rows) {
        const auto value = [&](const char* key) { return row.at(key).get<double>(); };
        EXPECT_GE(value("edge"), 1) << row;
        EXPECT_EQ(value("cells"), std::pow(value("edge"), 3)) << row;
        // The cell's critical step by its speed of sound, 6.2 m/s, is some 1.6 ms; by its springs less.
        EXPECT_GE(value("steps_a_frame"), 1) << row;
        EXPECT_LE(value("steps_a_frame"), 4) << row;
        EXPECT_LE(value("median_ms"), value("p99_ms")) << row;
        EXPECT_LE(value("p99_ms"), value("frame_ms")) << "what does not hold is not reported: " << row;
        EXPECT_LE(value("p99_ms"), value("worst_ms")) << row;
    }
}

} // namespace
} // namespace hybmss
