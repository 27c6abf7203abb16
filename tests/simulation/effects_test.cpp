/// Each effect of a scene by what physics says of it, and the list of effects.

#include "layouts/messages.hpp"
#include "simulation/run/effect_list.hpp"
#include "tests/program.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

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

/// A bar of E = 1 MPa that may slip across, with branches of relaxation, and what is done to its end.
Scene remembering_bar(const std::string& more, double poisson_ratio) {
    return parse_scene(printed("[body]\ncells = [2, 2, 4]\ncell_size = 0.1\n"
                               "[material]\nyoung_modulus = 1e6\npoisson_ratio = %g\ndensity = 1000\n"
                               "relaxation = [[0.8, 2], [0.3, 0.4]]\n",
                               poisson_ratio) +
                           "[[fix]]\nwhere = \"x-min\"\naxes = \"x\"\n[[fix]]\nwhere = \"y-min\"\naxes = \"y\"\n"
                           "[[fix]]\nwhere = \"z-min\"\naxes = \"z\"\n[damping]\nmass = 5\n"
                           "[solver]\nduration = 5\n[[probe]]\nname = \"end\"\nwhere = \"z-max\"\n" +
                           more,
                       "bar.toml");
}

TEST(Relaxation, a_stretched_bar_follows_its_prony_series) {
    for (const double nu : {0.1, 0.45}) {
        Simulation simulation(
            remembering_bar("[[move]]\nwhere = \"z-max\"\naxes = \"z\"\ntranslate = [0, 0, 4e-6]\nover = 1\n", nu));
        const double slow = 1e6 * 0.04 * 1e-5; // E A strain
        for (const double t : {2.0, 3.0, 5.0}) {
            simulation.step(std::lround(t / simulation.time_step()) - simulation.steps());
            double factor = 1; // 1 + sum of part times the integral of ds/du e^-((t - u) / time) over the way s(u)
            for (const auto& [part, time] : {std::pair{0.8, 2.0}, {0.3, 0.4}}) {
                constexpr int kPieces = 1000;
                for (int i = 0; i < kPieces; ++i) {
                    const double u = (i + 0.5) / kPieces, rate = 30 * u * u * (1 - u) * (1 - u);
                    factor += part * rate / kPieces * std::exp(-(simulation.time() - u) / time);
                }
            }
            EXPECT_NEAR(simulation.probes().at(0).force[2] / slow, factor, 1e-3) << nu << " " << t;
        }
    }
}

TEST(Relaxation, a_loaded_bar_creeps_as_its_series_says) {
    Scene scene = remembering_bar("[[load]]\nwhere = \"z-max\"\nforce = [[0, 0, 0, 0], [1, 0, 0, 0.4]]\n", 0.3);
    scene.relaxation = {{0.8, 2}};
    scene.damping.mass = 2;
    Simulation simulation(scene);
    // The strain's own series has one time, 2 (1 + 0.8) s, and the part 0.8 / 1.8 is late.
    const double time = 2 * 1.8, late = 0.8 / 1.8, end = 0.4 / 0.04 / 1e6 * 0.4;
    for (const double t : {3.0, 4.0, 5.0}) {
        simulation.step(std::lround(t / simulation.time_step()) - simulation.steps());
        const double left = late * time * std::expm1(1 / time) * std::exp(-simulation.time() / time);
        EXPECT_NEAR(simulation.probes().at(0).mean_displacement[2] / end, 1 - left, 1e-3) << t;
    }
}

TEST(Relaxation, is_balanced_goes_on_from_checkpoints_and_is_refused_where_it_is_not_there) {
    Scene scene = remembering_bar("[output]\nenergy_balance = true\n[[move]]\nwhere = \"z-max\"\naxes = \"z\"\n"
                                  "translate = [0, 0, 0.04]\nover = 0.5\n",
                                  0.3);
    scene.solver.duration = 1;
    scene.solver.method = SolverMethod::leapfrog;
    const Summary summary = Simulation(scene).run();
    ASSERT_TRUE(summary.balance);
    EXPECT_GT(summary.balance->effects_dissipated, 0.02 * summary.energies.springs);
    EXPECT_LT(summary.balance->relative_imbalance(), 1e-3);
    const auto own = std::find_if(summary.energies.effects.begin(), summary.energies.effects.end(),
                                  [](const EffectEnergy& e) { return e.name == "relaxation"; });
    ASSERT_NE(own, summary.energies.effects.end());
    EXPECT_GT(own->stored, 0);

    scene.solver.method = SolverMethod::backward_euler;
    scene.output.energy_balance = false;
    EXPECT_THROW(Simulation{scene}, SceneError);
    // What takes no time has the slow moduli.
    scene.solver = {};
    scene.solver.method = SolverMethod::static_equilibrium;
    scene.moves[0].motion = std::array<double, 3>{0, 0, 4e-6};
    EXPECT_NEAR(Simulation(scene).run().probes.at(0).force[2], 0.4, 1e-4);
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
                EXPECT_TRUE(effect.name == "cutting" || effect.name.starts_with("contact") ||
                            effect.name == "free obstacles")
                    << effect.name;
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
