/// How runs end: settled, not settled in time, diverged.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace hybmss {
namespace {

TEST(Outcome, not_settled_in_time_is_a_failure_with_results) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene("duration = 30", "duration = 1.1"));
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.errors.rfind("hybmss: error: s.toml: not settled after duration = 1.1 s: residual", 0), 0u)
        << result.errors;
    const nlohmann::json json = nlohmann::json::parse(test::read_text(directory.path() / "results/summary.json"));
    EXPECT_FALSE(json.at("converged").get<bool>());
    EXPECT_TRUE(std::filesystem::exists(directory.path() / "results/body_0003.vtu"));
}

TEST(Outcome, motion_must_end_first) {
    Simulation simulation(parse_scene(test::small_scene("over = 1", "over = 40"), "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_FALSE(summary.converged);
    EXPECT_NE(summary.failure.find("a motion has not ended"), std::string::npos) << summary.failure;
}

TEST(Outcome, without_tolerance_the_whole_duration_is_run) {
    Simulation simulation(parse_scene(test::small_scene("tolerance = 1e-4", ""), "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_EQ(summary.failure, "");
    EXPECT_TRUE(summary.converged);
    EXPECT_NEAR(summary.time, 30, summary.time_step);

    std::string text = test::small_scene("tolerance = 1e-4", "");
    text.replace(text.find("duration = 30"), 13, "duration = 2");
    Simulation shorter(parse_scene(text, "s.toml"));
    const Summary early = shorter.run();
    EXPECT_EQ(early.failure, "");
    EXPECT_FALSE(early.converged);
}

/// Undamped and without load, momentum and energy stay; the settled test must not be fooled by a turning point.
TEST(Outcome, undamped_body_never_settles) {
    std::string text = test::small_scene("mass = 3", "mass = 0");
    Simulation simulation(parse_scene(text, "s.toml"));
    EXPECT_FALSE(simulation.run().converged);
}

/// The plate falls through the whole body within a few steps.
TEST(Outcome, divergence_is_told_and_leaves_only_finite_numbers) {
    test::TemporaryDirectory directory;
    std::string text = test::small_scene("translate = [0, -0.1, 0]", "translate = [0, -900000, 0]");
    test::write_text(directory.path() / "s.toml", text);
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.errors.find("s.toml: diverged by step "), std::string::npos) << result.errors;
    const std::string summary = test::read_text(directory.path() / "results/summary.json");
    EXPECT_EQ(summary.find("null"), std::string::npos);
    EXPECT_FALSE(nlohmann::json::parse(summary).at("converged").get<bool>());
    for (const auto& entry : std::filesystem::directory_iterator(directory.path() / "results")) {
        const std::string extension = entry.path().extension();
        if (extension == ".csv" || extension == ".json") {
            const std::string content = test::read_text(entry.path());
            EXPECT_EQ(content.find("nan"), std::string::npos) << entry.path();
            EXPECT_EQ(content.find("inf"), std::string::npos) << entry.path();
        }
    }
}

/// Embedders step by call: they are told too, however many steps a call takes.
TEST(Outcome, divergence_is_told_to_who_steps_by_call) {
    const std::string text = test::small_scene("translate = [0, -0.1, 0]", "translate = [0, -900000, 0]");
    for (const long count : {1L, 7L, 1000L}) {
        Simulation simulation(parse_scene(text, "s.toml"));
        try {
            for (int call = 0; call < 1000; ++call) {
                simulation.step(count);
            }
            ADD_FAILURE() << "not told, in calls for " << count;
        } catch (const std::runtime_error& error) {
            EXPECT_EQ(std::string(error.what()).find("diverged by step "), 0u) << error.what();
            EXPECT_LE(simulation.steps(), 1000);
        }
    }
}

/// A free body under gravity alone: v = g t, no strain, and its energy is kept by the external one.
TEST(Outcome, free_fall) {
    std::string text = test::small_scene("[[fix]]", "[gravity]\nacceleration = [0, -10, 0]\n[[fix]]");
    text.erase(text.find("[[fix]]"), text.find("[damping]") - text.find("[[fix]]"));
    text.replace(text.find("mass = 3"), 8, "mass = 0");
    Simulation simulation(parse_scene(text, "s.toml"));
    simulation.step(100);
    const double t = simulation.time();
    for (const auto& v : simulation.velocities()) {
        EXPECT_NEAR(v[1], -10 * t, 1e-9 * t);
    }
    const Energies energies = simulation.energies();
    const double mass = 1000 * 0.125 * 24;
    EXPECT_NEAR(energies.kinetic, 0.5 * mass * 100 * t * t, 1e-9 * energies.kinetic);
    EXPECT_LT(energies.springs + std::abs(energies.volume), 1e-15 * energies.kinetic);
    // The method is of first order: the fall is g t (t + dt) / 2.
    EXPECT_NEAR(-energies.external, mass * 100 * t * (t + simulation.time_step()) / 2, 1e-9 * energies.kinetic);
    EXPECT_FALSE(simulation.settlement().settled);
}

} // namespace
} // namespace hybmss
