/// What a run says on a terminal while it is at work: the same bytes go to files, and nothing off a terminal.

#include "tests/program.hpp"

#include <algorithm>
#include <pty.h>

namespace hybmss {
namespace {

/// All that `hybmss ARGUMENTS` writes to a terminal.
std::string on_a_terminal(const std::string& arguments, const std::filesystem::path& directory) {
    int master = -1;
    const pid_t child = forkpty(&master, nullptr, nullptr, nullptr);
    if (child == 0) {
        const std::string command = "cd '" + directory.string() + "' && exec '" HYBMSS_APP "' " + arguments;
        execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
        _exit(127);
    }
    std::string text;
    char buffer[4096];
    for (ssize_t count; (count = read(master, buffer, sizeof buffer)) > 0;) { // a terminal that is left gives an error
        text.append(buffer, static_cast<std::size_t>(count));
    }
    close(master);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << text;
    return text;
}

constexpr const char* kRest = R"(
[material]
young_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[fix]]
where = "y-min"
[[move]]
where = "y-max"
translate = [0, -0.05, 0]
[[probe]]
name = "plate"
where = "y-max"
[solver]
method = "static"
)";

TEST(Progress, static_solves_tell_how_far_they_are_on_a_terminal) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", std::string("[body]\ncells = [4, 4, 4]\ncell_size = 0.25\n") + kRest);
    const std::string text = on_a_terminal("run s.toml --out A", directory.path());
    EXPECT_NE(text.find("of the load, Newton"), std::string::npos) << text;
    const test::ProgramResult quiet = test::run_program("run s.toml --out B", directory.path());
    EXPECT_EQ(quiet.exit_code, 0);
    EXPECT_EQ(quiet.errors, "");
    EXPECT_EQ(test::read_text(directory.path() / "A/probes.csv"), test::read_text(directory.path() / "B/probes.csv"));
}

TEST(Progress, wishes_for_an_accuracy_tell_mesh_and_solve) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     std::string("[body]\nsize = [1, 1, 1]\n") + kRest + "accuracy = 0.1\n");
    for (const char* command : {"run s.toml --out A", "explain s.toml"}) {
        const std::string text = on_a_terminal(command, directory.path());
        EXPECT_NE(text.find("accuracy = 0.1: 4 x 4 x 4 cells: ["), std::string::npos) << text;
        EXPECT_NE(text.find("accuracy = 0.1: 8 x 8 x 8 cells, about "), std::string::npos) << text;
    }
    EXPECT_EQ(test::run_program("explain s.toml", directory.path()).errors, "");
}

TEST(Progress, long_runs_tell_what_they_take_where_there_is_no_terminal) {
    test::TemporaryDirectory directory;
    const auto errors_of = [&](const std::string& duration, const std::string& method) {
        std::string scene = test::small_scene("duration = 30", "duration = " + duration);
        scene.replace(scene.find("symplectic-euler"), 16, method).replace(scene.find("tolerance = 1e-4"), 16, "");
        test::write_text(directory.path() / "s.toml", scene);
        return test::run_program("5 '" HYBMSS_APP "' run s.toml", directory.path(), "timeout").errors;
    };
    for (const char* method : {"symplectic-euler", "backward-euler"}) {
        const std::string text = errors_of("1e11", method);
        EXPECT_EQ(text.find("hybmss: s.toml: it may take about "), 0u) << text;
        EXPECT_NE(text.find(" days\n"), std::string::npos) << text;
        EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
    }
    EXPECT_EQ(errors_of("1", "symplectic-euler"), "");
}

TEST(Progress, explain_estimates_what_a_static_solve_takes) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", std::string("[body]\ncells = [4, 4, 4]\ncell_size = 0.25\n") + kRest);
    const test::ProgramResult result = test::run_program("explain s.toml", directory.path());
    EXPECT_NE(result.output.find("estimated cost       about "), std::string::npos) << result.output;
}

} // namespace
} // namespace hybmss
