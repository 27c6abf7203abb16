/// Each effect of a scene by what physics says of it, and the list of effects.

#include "simulation/run/effect_list.hpp"
#include "tests/program.hpp"

#include <cmath>
#include <set>

namespace hybmss {
namespace {

/// J, by the one effect that counts any.
double dissipated(const Energies& energies) {
    EXPECT_LE(energies.effects.size(), 1U);
    return energies.effects.empty() ? 0 : energies.effects[0].dissipated;
}

/// A free body, without damping, as small_scene().
Scene free_scene() {
    std::string text = test::small_scene();
    text.erase(text.find("[[fix]]"), text.find("[damping]") - text.find("[[fix]]"));
    text.replace(text.find("mass = 3"), 8, "mass = 0");
    return parse_scene(text, "s.toml");
}

double mean_velocity(const Simulation& simulation) {
    double sum = 0;
    for (const auto& v : simulation.velocities()) {
        sum += v[1];
    }
    return sum / static_cast<double>(simulation.node_count());
}

// v_n+1 = (v_n + dt g) / (1 + dt c): towards g/c, by the factor 1/(1 + dt c) a step.
TEST(MassDamping, free_fall_ends_at_the_terminal_velocity) {
    Scene scene = free_scene();
    scene.gravity.acceleration = {0, -10, 0};
    scene.damping.mass = 4;
    scene.damping.stiffness = 1e-3; // takes nothing out of a fall
    for (SolverMethod method : {SolverMethod::symplectic_euler, SolverMethod::backward_euler}) {
        scene.solver.method = method;
        scene.solver.time_step = 0.01;
        Simulation simulation(scene);
        const double terminal = -10.0 / 4, decay = 1 / (1 + 0.01 * 4);
        simulation.step(20);
        EXPECT_NEAR(mean_velocity(simulation), terminal * (1 - std::pow(decay, 20)), 1e-6);
        simulation.step(400);
        EXPECT_NEAR(mean_velocity(simulation), terminal, 1e-5);
        EXPECT_NEAR(dissipated(simulation.energies()), 0, 1e-6 * simulation.energies().kinetic);
    }
}

// A plate strikes a clamped body and stays: what swings is taken out by the springs' damping alone, and is accounted
// for. Backward Euler takes out more than that by itself.
TEST(StiffnessDamping, takes_out_what_swings) {
    Scene scene = parse_scene(test::small_scene("mass = 3", "stiffness = 2e-2"), "s.toml");
    scene.moves[0].over = 0;
    scene.solver.duration = 60;
    scene.solver.tolerance = 1e-5;
    scene.solver.time_step = Simulation(scene).time_step() / 8; // velocities are those of half a step before
    scene.output = {};
    Simulation simulation(scene);
    const Energies before = simulation.energies();
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_GT(dissipated(summary.energies), 0);
    // At rest the damping exerts nothing: the equilibrium is the undamped one.
    scene.solver.method = SolverMethod::static_equilibrium;
    scene.solver.tolerance = 1e-9;
    Simulation still(scene);
    const Summary at_rest = still.run();
    ASSERT_TRUE(at_rest.converged) << at_rest.failure;
    EXPECT_EQ(dissipated(at_rest.energies), 0);
    EXPECT_NEAR(summary.probes.at(0).force[1], at_rest.probes.at(0).force[1],
                1e-4 * std::abs(at_rest.probes.at(0).force[1]));
    // The plate stood still while the body swung: nobody worked on it, so the start's energy went into rest and heat.
    const double start = before.springs + before.volume + before.kinetic;
    const double end = summary.energies.springs + summary.energies.volume + summary.energies.kinetic;
    EXPECT_NEAR(end + dissipated(summary.energies), start, 2e-2 * start);
}

TEST(StiffnessDamping, shortens_the_stable_step) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    const double plain = Simulation(scene).critical_time_step();
    scene.damping.stiffness = 0.1;
    const Simulation damped(scene);
    EXPECT_LT(damped.critical_time_step(), 0.6 * plain);
    EXPECT_NEAR(damped.time_step(), 0.7 * damped.critical_time_step(), 1e-12);
    scene.solver.time_step = 0.9 * plain;
    EXPECT_THROW(Simulation{scene}, SceneError);
    scene.solver.method = SolverMethod::backward_euler;
    EXPECT_NO_THROW(Simulation{scene});
}

// The chosen step reckons with springs strained by a half; a given one may be as long as at rest.
TEST(StiffeningSprings, shorten_the_chosen_step_and_resist_more) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    scene.solver.method = SolverMethod::static_equilibrium;
    scene.moves[0].motion = std::array<double, 3>{0, 0.6, 0};
    const auto force = [&] {
        const Summary summary = Simulation(scene).run();
        EXPECT_TRUE(summary.converged) << summary.failure;
        return summary.probes.at(0).force[1];
    };
    const double plain = force();
    scene.material.stiffening = {1, 4};
    EXPECT_GT(force(), 1.4 * plain);

    scene.solver.method = SolverMethod::symplectic_euler;
    const Simulation stiffened(scene);
    scene.material.stiffening = {};
    const Simulation linear(scene);
    EXPECT_EQ(stiffened.critical_time_step(), linear.critical_time_step());
    EXPECT_LT(stiffened.time_step(), 0.6 * linear.time_step());
}

// The chosen step reckons with cells pressed to half of crush_ratio; a given one may be as long as at rest.
TEST(CrushResistance, shortens_the_chosen_step_alone) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    scene.solver.method = SolverMethod::symplectic_euler;
    const Simulation plain(scene);
    scene.material.crush = {20, 0.7};
    const Simulation resisting(scene);
    EXPECT_EQ(resisting.critical_time_step(), plain.critical_time_step());
    EXPECT_LT(resisting.time_step(), 0.7 * plain.time_step());
}

// A plate through the whole body: one clear error, whatever the springs do.
TEST(StiffeningSprings, blow_up_is_one_clear_error) {
    test::TemporaryDirectory directory;
    std::string text = test::small_scene("translate = [0, -0.1, 0]", "translate = [0, -900000, 0]");
    text.replace(text.find("density = 1000"), 14, "density = 1000\nstiffening_cubic = 3");
    text.replace(text.find("mass = 3"), 8, "mass = 3\nstiffness = 1e-3");
    test::write_text(directory.path() / "s.toml", text);
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.errors.find("s.toml: diverged by step "), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
}

TEST(EffectList, every_effect_can_be_added_and_taken_out) {
    std::set<std::string_view> names;
    for (const EffectRule& effect : effect_rules()) {
        EXPECT_TRUE(names.insert(effect.name).second) << effect.name;
        EXPECT_EQ(effect.add == nullptr, effect.remove == nullptr) << effect.name;
        if (!effect.add) {
            continue;
        }
        Scene scene = without(free_scene(), effect);
        EXPECT_FALSE(effect.in(scene)) << effect.name;
        EXPECT_FALSE(effect.reason(Simulation(scene)).empty());
        effect.add(scene);
        EXPECT_TRUE(effect.in(scene)) << effect.name;
        EXPECT_NE(effect.reason(Simulation(scene)), effect.absence(scene)) << effect.name;
        scene.solver.method = SolverMethod::static_equilibrium;
        EXPECT_EQ(effect.in(scene), effect.in_static) << effect.name;
        if (!effect.in_static) {
            try {
                EXPECT_EQ(effect.reason(Simulation(scene)), "static: nothing moves");
            } catch (const SceneError&) { // rather than left out
                EXPECT_TRUE(effect.name == "cutting" || effect.name == "contact");
            }
        }
    }
}

TEST(EffectList, document_is_the_list) {
    const std::string document = test::read_text(std::filesystem::path(HYBMSS_SOURCE_DIR) / "docs/effects.md");
    EXPECT_NE(document.find(effects_markdown()), std::string::npos)
        << "docs/effects.md must hold what `hybmss explain --effects` prints:\n"
        << effects_markdown();
}

} // namespace
} // namespace hybmss
