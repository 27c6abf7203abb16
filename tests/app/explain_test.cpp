/// `hybmss explain` and the program's own face.

#include "hybmss/version.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

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
