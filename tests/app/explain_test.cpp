/// `hybmss explain` and the program's own face.

#include "hybmss/version.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace hybmss {
namespace {

bool holds(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Explain, tells_effects_in_and_out) {
    test::TemporaryDirectory directory;
    const test::ProgramResult plain =
        test::run_program("explain " + test::example("compression_nu025"), directory.path());
    ASSERT_EQ(plain.exit_code, 0) << plain.errors;
    const std::size_t out = plain.output.find("effects out");
    ASSERT_NE(out, std::string::npos);
    const std::string in = plain.output.substr(0, out), rest = plain.output.substr(out);
    for (const char* effect :
         {"edge springs", "face diagonals", "cube diagonals", "mass damping", "fixed nodes", "prescribed motion"}) {
        EXPECT_TRUE(holds(in, effect)) << effect << plain.output;
    }
    EXPECT_TRUE(holds(rest, "kappa = 0 at poisson_ratio = 0.25")) << rest;
    EXPECT_TRUE(holds(rest, "gravity")) << rest;
    EXPECT_TRUE(holds(rest, "14230 merged (19630 if"));
    for (const char* fact :
         {"kernel", "layout", "instruction set", "threads", "bytes", "critical time step", "estimated cost"}) {
        EXPECT_TRUE(holds(rest, fact)) << fact;
    }

    const test::ProgramResult stretch =
        test::run_program("explain " + test::example("compression_nu0"), directory.path());
    EXPECT_TRUE(holds(stretch.output, "mean stretch energy (automatic: poisson_ratio < 0.25)")) << stretch.output;
    const test::ProgramResult beam = test::run_program("explain " + test::example("beam"), directory.path());
    EXPECT_TRUE(holds(beam.output, "(0, -10, 0) m/s^2"));
    EXPECT_TRUE(holds(beam.output, "no [[move]]"));
}

TEST(Explain, forced_choices_are_told) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     test::small_scene("density = 1000", "density = 1000\nface_diagonal_ratio = 0"));
    const test::ProgramResult result =
        test::run_program("explain s.toml --precision float --layout network --threads 1", directory.path());
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_TRUE(holds(result.output, "face_diagonal_ratio = 0 (HybMSS-FD)")) << result.output;
    EXPECT_TRUE(holds(result.output, "precision            float")) << result.output;
}

TEST(Explain, tells_what_each_effect_takes) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene("mass = 3", "mass = 3\nstiffness = 1e-4"));
    const test::ProgramResult result = test::run_program("explain s.toml --threads 1 --json e.json", directory.path());
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const std::size_t at = result.output.find("\n  stiffness damping ");
    ASSERT_NE(at, std::string::npos) << result.output;
    const std::string line = result.output.substr(at + 1, result.output.find('\n', at + 1) - at - 1);
    char name[64];
    long bytes = 0;
    double nanoseconds = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), " stiffness %63s %ld %lf", name, &bytes, &nanoseconds), 3) << line;
    EXPECT_GE(bytes, 60 * 3 * 8); // a vector a node
    EXPECT_TRUE(holds(line, "0.0001 s; spring_pass<damping>, kick")) << line;
    EXPECT_TRUE(holds(result.output, "no material.stiffening_quadratic")) << result.output;

    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "e.json"));
    EXPECT_EQ(json.at("plan").at("threads"), 1);
    std::size_t in = 0;
    for (const auto& effect : json.at("effects")) {
        EXPECT_FALSE(effect.at("why").get<std::string>().empty());
        if (effect.at("name") == "stiffness damping") {
            EXPECT_EQ(effect.at("bytes"), bytes);
            EXPECT_TRUE(effect.at("ns_per_cell_step").is_number());
        }
        in += effect.at("in").get<bool>();
    }
    EXPECT_EQ(in, static_cast<std::size_t>(std::count(
                      result.output.begin(),
                      result.output.begin() + static_cast<std::ptrdiff_t>(result.output.find("effects out")), '\n')) -
                      2);

    test::write_text(directory.path() / "t.toml",
                     test::small_scene("method = \"symplectic-euler\"", "method = \"static\""));
    const test::ProgramResult still = test::run_program("explain t.toml", directory.path());
    EXPECT_TRUE(holds(still.output, "mass damping         static: nothing moves")) << still.output;
}

std::string replaced(std::string text, const std::string& part, const std::string& other) {
    const std::size_t at = text.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    return text.replace(at, part.size(), other);
}

// A run of ten steps that finds no eighteenth: steps are timed within the run alone.
TEST(Explain, times_no_step_beyond_the_run) {
    test::TemporaryDirectory directory;
    std::string scene =
        test::small_scene("method = \"symplectic-euler\"", "method = \"backward-euler\"\ntime_step = 0.1");
    for (const auto& [part, other] : {std::pair{"[2, 3, 4]", "[4, 4, 4]"},
                                      {"poisson_ratio = 0.3", "poisson_ratio = 0"},
                                      {"[0, -0.1, 0]", "[0, -0.4, 0]"},
                                      {"mass = 3", "mass = 0"},
                                      {"duration = 30", "duration = 1"},
                                      {"tolerance = 1e-4", ""}}) {
        scene = replaced(scene, part, other);
    }
    test::write_text(directory.path() / "s.toml", scene);
    EXPECT_EQ(test::run_program("run s.toml", directory.path()).exit_code, 0);
    const test::ProgramResult result = test::run_program("explain s.toml", directory.path());
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_TRUE(holds(result.output, "measured now")) << result.output;
}

// By the equilibrium, as a run in time would come to it.
TEST(Explain, warns_of_a_coarse_mesh) {
    test::TemporaryDirectory directory;
    const std::string bent =
        replaced(replaced(test::small_scene(), "[2, 3, 4]", "[2, 20, 2]"), "[0, -0.1, 0]", "[1, 0, 0]");
    test::write_text(directory.path() / "s.toml", bent);
    const test::ProgramResult result = test::run_program("explain s.toml", directory.path());
    EXPECT_EQ(result.errors.find("hybmss: warning: s.toml: the mesh is coarse: its cells are bent or twisted"), 0u)
        << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    test::write_text(directory.path() / "s.toml", replaced(bent, "[2, 20, 2]", "[6, 60, 6]"));
    EXPECT_EQ(test::run_program("explain s.toml", directory.path()).errors, "");
}

// What cannot be timed is told of, and the rest all the same.
TEST(Explain, tells_of_a_run_that_fails_at_once) {
    test::TemporaryDirectory directory;
    for (const char* method : {"symplectic-euler", "backward-euler"}) {
        const std::string scene =
            test::small_scene("method = \"symplectic-euler\"", "method = \"" + std::string(method) + "\"");
        test::write_text(directory.path() / "s.toml",
                         replaced(replaced(scene, "over = 1", "over = 0"), "[0, -0.1, 0]", "[0, -1e9, 0]"));
        const test::ProgramResult result = test::run_program("explain s.toml --json e.json", directory.path());
        EXPECT_EQ(result.exit_code, 0) << result.errors;
        EXPECT_TRUE(holds(result.output, "estimated cost       cannot be measured: ")) << result.output;
        EXPECT_FALSE(holds(result.output, "nan") || holds(result.output, "inf ")) << result.output;
        EXPECT_TRUE(std::filesystem::exists(directory.path() / "e.json"));
    }
}

TEST(Program, version_and_help) {
    test::TemporaryDirectory directory;
    const test::ProgramResult version = test::run_program("--version", directory.path());
    EXPECT_EQ(version.exit_code, 0);
    EXPECT_TRUE(holds(version.output, kVersion)) << version.output;
    const test::ProgramResult help = test::run_program("--help", directory.path());
    EXPECT_EQ(help.exit_code, 0);
    for (const char* command : {"run", "explain", "forces", "verify"}) {
        EXPECT_TRUE(holds(help.output, command)) << command;
    }
    EXPECT_EQ(test::run_program("", directory.path()).exit_code, 2);
}

} // namespace
} // namespace hybmss
