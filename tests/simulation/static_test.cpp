/// Static scenes: one load step from rest to the equilibria that physics demands.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace hybmss {
namespace {

/// An example's scene, solved for its equilibrium instead of through time.
Scene static_example(const std::string& name) {
    Scene scene = load_scene(test::example(name));
    scene.solver = {};
    scene.solver.method = SolverMethod::static_equilibrium;
    return scene;
}

Summary solved(Scene scene, const SimulationOptions& options = {}) {
    Simulation simulation(std::move(scene), options);
    return simulation.run();
}

struct Figures {
    const char* scene;
    double volume_change; ///< percent
    double force;         ///< N
};

class StaticCompression : public testing::TestWithParam<Figures> {};

TEST_P(StaticCompression, meets_the_figures) {
    const Summary summary = solved(static_example(GetParam().scene));
    ASSERT_TRUE(summary.converged) << summary.failure;
    EXPECT_LE(summary.settlement.residual, 1e-8);
    EXPECT_NEAR(100 * summary.volume.relative_volume_change, GetParam().volume_change, 0.0006);
    EXPECT_NEAR(summary.probes.at(0).force[1], -GetParam().force, 1e-5 * GetParam().force);
    EXPECT_GT(summary.volume.min_cell_volume_ratio, 0.7);
    EXPECT_EQ(summary.time, 1);
    EXPECT_GT(summary.work.cg_iterations, summary.work.newton_iterations);
}

INSTANTIATE_TEST_SUITE_P(Scenes, StaticCompression,
                         testing::Values(Figures{"compression_nu025", 13.519, 46526.7},
                                         Figures{"compression_nu0499", 0.108, 79497.9},
                                         Figures{"compression_nu0", 19.849, 37285.7}),
                         [](const auto& scene) { return std::string(scene.param.scene); });

TEST(Static, shear_and_torsion_meet_the_figures) {
    EXPECT_NEAR(solved(static_example("shear")).probes.at(0).force[0], 14108.3, 0.5);
    EXPECT_NEAR(solved(static_example("torsion_1")).probes.at(0).torque[1], 1290.9, 0.1);
    Scene torsion = static_example("torsion_1");
    std::get<Rotation>(torsion.moves.at(0).motion).degrees = 36;
    EXPECT_NEAR(solved(torsion).probes.at(0).torque[1], 47351.7, 5);
}

/// A slender bar on its foot, and what presses its head.
Scene bar_scene(const std::string& method, const std::string& more) {
    return parse_scene("[body]\ncells = [2, 2, 8]\ncell_size = 0.3\n[material]\nyoung_modulus = 1e4\n"
                       "poisson_ratio = 0.3\ndensity = 1000\n[[fix]]\nwhere = \"z-min\"\n" +
                           more + "[solver]\nmethod = \"" + method + "\"\ncount = 3\n",
                       "bar.toml");
}

/// The same by the solver itself.
struct Bar {
    Lattice lattice = Lattice::box(2, 2, 8, 0.3);
    EquilibriumSolver<double> solver{lattice, Material{.young_modulus = 1e4, .poisson_ratio = 0.3}};
    Loading loading;
    std::vector<double> u = std::vector<double>(3 * lattice.nodes().size(), 0.0);

    Bar() {
        loading.forces.assign(lattice.nodes().size(), {0, 0, 0});
        for (std::uint32_t n = 0; n < 9; ++n) {
            loading.supports.push_back({n, 7, {0, 0, 0}, {0, 0, 0}});
            // A corner of the face touches one cell, an edge's middle two, the middle four.
            const double share = (n % 3 == 1 ? 2 : 1) * (n / 3 == 1 ? 2 : 1) / 16.0;
            loading.forces[loading.forces.size() - 9 + n] = {0, 0, -40 * share};
        }
    }
    VectorField<double> field() { return VectorField<double>::aos(u.data(), lattice.nodes().size()); }
};

TEST(Modes, are_those_of_the_solver_about_rest_and_about_the_loaded_body) {
    Bar bar;
    const std::string load = "[[load]]\nwhere = \"z-max\"\nforce = [0, 0, -40]\n";
    for (const bool loaded : {false, true}) {
        const Summary summary = solved(bar_scene("modes", loaded ? load : ""));
        ASSERT_TRUE(summary.converged) << summary.failure;
        if (loaded) {
            ASSERT_EQ(bar.solver.solve(bar.loading, bar.field()).status, EquilibriumStatus::converged);
        }
        const ModesResult modes = bar.solver.modes(bar.loading.supports, bar.field(), {.count = 3});
        ASSERT_EQ(summary.modes.size(), 3u);
        for (std::size_t m = 0; m < 3; ++m) {
            EXPECT_NEAR(summary.modes[m].value, modes.modes[m].frequency(), 1e-9 * modes.modes[2].frequency());
        }
        EXPECT_EQ(summary.work.load_steps > 0, loaded);
    }
}

TEST(Modes, leave_a_free_bodys_own_motions_out) {
    Scene scene = bar_scene("modes", "");
    scene.fixes.clear();
    const Summary summary = solved(scene);
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_EQ(summary.rigid_motions, 6);
    EXPECT_GT(summary.modes.at(0).value, 0);
    double greatest = 0;
    for (const auto& u : summary.modes[0].shape) {
        greatest = std::max(greatest, std::hypot(u[0], u[1], u[2]));
    }
    EXPECT_NEAR(greatest, 0.24, 1e-12); // a tenth of the edge
}

TEST(Buckling, is_that_of_the_solver_for_loads_and_for_moves) {
    Bar bar;
    const Summary by_force = solved(bar_scene("buckling", "[[load]]\nwhere = \"z-max\"\nforce = [0, 0, -40]\n"));
    ASSERT_TRUE(by_force.converged) << by_force.failure;
    const BucklingResult loads = bar.solver.buckling(bar.loading, {.count = 3});
    for (std::size_t m = 0; m < 3; ++m) {
        EXPECT_NEAR(by_force.modes.at(m).value, loads.loads.at(m).factor, 1e-6 * loads.loads[m].factor);
    }
    EXPECT_EQ(by_force.energies.springs, 0); // at rest
    const Summary by_move = solved(bar_scene("buckling", "[[move]]\nwhere = \"z-max\"\ntranslate = [0, 0, -0.1]\n"));
    ASSERT_TRUE(by_move.converged) << by_move.failure;
    // A clamped head: four times the load of a free one along twice the way... but more than twice the factor at least.
    EXPECT_GT(by_move.modes.at(0).value, 0);
    const Summary pulled = solved(bar_scene("buckling", "[[load]]\nwhere = \"x-max\"\nforce = [0, 0, 0]\n"));
    EXPECT_FALSE(pulled.converged);
    EXPECT_EQ(pulled.failure, "the loading moves nothing");
}

TEST(Modes, are_refused_in_float_and_their_count_elsewhere) {
    SimulationOptions single;
    single.precision = Precision::float32;
    EXPECT_THROW(solved(bar_scene("modes", ""), single), SceneError);
    EXPECT_THROW(bar_scene("static", ""), SceneError); // with a count
}

/// Gravity alone: the support carries the weight.
TEST(Static, beam_hangs_from_its_support) {
    const Summary summary = solved(static_example("beam"));
    ASSERT_TRUE(summary.converged) << summary.failure;
    const double weight = 1000 * 0.4 * 0.4 * 2.4 * 10;
    EXPECT_NEAR(summary.probes.at(0).force[1], weight, 1e-6 * weight);
}

/// A bar of one cell across, ten long, pressed aside at its end: springs between nodes are 119 % too stiff there.
TEST(Static, springs_on_means_bend_one_cell_across) {
    for (const double across : {1.0, 2.0}) {
        Scene scene = static_example("beam");
        scene.body.cells = {static_cast<int>(across), static_cast<int>(across), static_cast<int>(10 * across)};
        scene.body.cell_size = 1 / across;
        scene.material.poisson_ratio = 0.3;
        scene.material.face_diagonal_ratio = 0;
        scene.material.springs = SpringForm::means;
        scene.gravity = {};
        Load& push = scene.loads.emplace_back();
        push.where = scene.probes.at(1).where;
        push.force = {0, -1e-6 * scene.material.young_modulus, 0};
        const Summary summary = solved(scene);
        ASSERT_TRUE(summary.converged) << summary.failure;
        // Tip deflection by F / (E a), extrapolated from fine meshes of several forms. A force in equal parts is no
        // uniform traction with more than one cell.
        const double deflection = -summary.probes.at(1).mean_displacement[1] / 1e-6;
        EXPECT_NEAR(4004.2 / deflection, 1, 0.015) << across;
    }
}

/// The clamped cube of 8^3 cells. Pressed by 30 %: figures of a separate program. Pressed by half, it wrinkles; without
/// resistance it turns inside out.
TEST(Static, crush_resistance_keeps_cells_from_turning) {
    Scene scene = static_example("compression_nu025");
    scene.body.cells = {8, 8, 8};
    scene.body.cell_size = 5.0 / 8;
    scene.material.crush.stiffness = 20;
    const auto pressed = [&](double part) {
        std::get<std::array<double, 3>>(scene.moves.at(0).motion) = {0, -5 * part, 0};
        return solved(scene);
    };
    const Summary third = pressed(0.3);
    ASSERT_TRUE(third.converged) << third.failure;
    EXPECT_NEAR(100 * third.volume.relative_volume_change, 21.276, 0.0006);
    EXPECT_NEAR(third.probes.at(0).force[1], -65206.4, 0.7);
    const Summary half = pressed(0.5);
    ASSERT_TRUE(half.converged) << half.failure;
    EXPECT_GT(half.volume.min_cell_volume_ratio, 0.45);
    scene.material.crush = {};
    const Summary turned = pressed(0.5);
    EXPECT_TRUE(!turned.converged || turned.volume.min_cell_volume_ratio < 0);
}

TEST(Static, several_load_steps_lead_to_the_same_equilibrium) {
    Scene scene = static_example("compression_nu0499");
    scene.solver.load_steps = 4;
    const Summary summary = solved(scene);
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_GT(summary.work.load_steps, 1);
    EXPECT_NEAR(summary.probes.at(0).force[1], -79497.9, 0.5);
}

TEST(Static, float_converges_to_its_own_tolerance) {
    SimulationOptions options;
    options.precision = Precision::float32;
    const Summary summary = solved(static_example("compression_nu025"), options);
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(summary.probes.at(0).force[1], -46526.7, 1e-3 * 46526.7);
}

/// The paper's energy has no lower bound at nu = 0: a free bar has no equilibrium at 20 % tension. The mean-stretch
/// energy has one.
TEST(Static, tension_below_a_quarter_needs_the_mean_stretch_energy) {
    for (const double nu : {0.0, -0.5}) {
        Scene scene = static_example("compression_nu0");
        scene.material.poisson_ratio = nu;
        scene.moves.at(0).motion = std::array<double, 3>{0, 1, 0};
        const Summary good = solved(scene);
        EXPECT_TRUE(good.converged) << nu << ": " << good.failure;
        EXPECT_GT(good.volume.min_cell_volume_ratio, 1);
        if (nu == 0) {
            EXPECT_NEAR(100 * good.volume.relative_volume_change, 20.423, 0.01);
        }
        scene.material.volume_energy = VolumeEnergy::quadratic;
        const Summary bad = solved(scene);
        EXPECT_FALSE(bad.converged);
        EXPECT_NE(bad.failure.find("\"quadratic\" has no lower bound"), std::string::npos) << bad.failure;
        for (const auto& force : bad.probes) {
            EXPECT_TRUE(std::isfinite(force.force[1]));
        }
    }
}

TEST(Static, program_writes_the_state_it_had_and_fails) {
    test::TemporaryDirectory directory;
    std::string text = test::small_scene("poisson_ratio = 0.3", "poisson_ratio = -0.5\nvolume_energy = \"quadratic\"");
    text.replace(text.find("translate = [0, -0.1, 0]"), 24, "translate = [0, 0.9, 0]");
    text.replace(text.find("symplectic-euler"), 16, "static");
    test::write_text(directory.path() / "s.toml", text);
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 1) << result.errors;
    EXPECT_NE(result.errors.find("no equilibrium"), std::string::npos) << result.errors;
    const nlohmann::json json = nlohmann::json::parse(test::read_text(directory.path() / "results/summary.json"));
    EXPECT_FALSE(json.at("converged").get<bool>());
    EXPECT_TRUE(json.at("residual").is_number());
    EXPECT_TRUE(std::filesystem::exists(directory.path() / "results/body_0001.vtu"));
}

Scene twisted_bar(double degrees) {
    Scene scene = parse_scene(R"(
        [body]
        cells = [2, 2, 20]
        cell_size = 0.1
        [material]
        young_modulus = 1e4
        poisson_ratio = 0.25
        density = 1000
        [[fix]]
        where = "z-min"
        [[move]]
        where = "z-max"
        rotate = {axis = "z", degrees = 90}
        [[probe]]
        name = "plate"
        where = "z-max"
        [solver]
        method = "static"
    )",
                              "scene");
    std::get<Rotation>(scene.moves.at(0).motion).degrees = degrees;
    return scene;
}

/// A plate that is turned in one step by more than half a turn is taken for one turned the other way.
TEST(Static, a_bar_is_twisted_by_as_many_turns_as_its_plate) {
    const std::pair<double, double> figures[] = {{90, 0.9000}, {270, 2.7402}, {-270, -2.7402}, {360, 3.6707}};
    for (const auto& [degrees, torque] : figures) {
        const Summary summary = solved(twisted_bar(degrees));
        ASSERT_TRUE(summary.converged) << degrees << ": " << summary.failure;
        EXPECT_NEAR(summary.probes.at(0).torque[2], torque, 1e-4 * std::abs(torque)) << degrees;
        EXPECT_GE(summary.work.load_steps, std::abs(degrees) / 60);
    }
    // Here the bar is about to kink: several equilibria lie close together.
    EXPECT_NEAR(solved(twisted_bar(720)).probes.at(0).torque[2], 6.83, 0.03);
    // However short the first step, those after it grow.
    Scene many = twisted_bar(450);
    many.solver.load_steps = 1000;
    const Summary summary = solved(many);
    ASSERT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(summary.probes.at(0).torque[2], 4.5782, 1e-3);
    EXPECT_NEAR(solved(twisted_bar(450)).probes.at(0).torque[2], 4.5782, 1e-3);
    // Half by one plate and half by the other.
    Scene both = twisted_bar(135);
    both.moves.push_back(both.moves.at(0));
    both.moves.at(1).where = both.fixes.at(0).where;
    std::get<Rotation>(both.moves.at(1).motion).degrees = -135;
    both.fixes.clear();
    EXPECT_NEAR(solved(both).probes.at(0).torque[2], 2.7402, 1e-3);
}

/// Half a turn a cell is more than the bar can hold. What is left is what it held last.
TEST(Static, a_bar_that_is_twisted_too_far_says_how_far_it_came) {
    Scene scene = twisted_bar(3600);
    scene.gravity.acceleration = {0, 0, -1e-3};
    scene.probes.push_back({"clamp", scene.fixes.at(0).where});
    const Summary summary = solved(scene);
    EXPECT_FALSE(summary.converged);
    // As much of its 80 kg as of the turn.
    EXPECT_NEAR(summary.probes.at(0).force[2] + summary.probes.at(1).force[2], 0.08 * summary.time, 1e-6);
    EXPECT_GT(summary.time, 0.15);
    EXPECT_LT(summary.time, 1);
    EXPECT_LE(summary.settlement.residual, 1e-8);
    EXPECT_GT(summary.probes.at(0).torque[2], 6);
    EXPECT_NE(summary.failure.find("left is the equilibrium at"), std::string::npos) << summary.failure;
}

/// A cube cannot hold a whole turn. Its cells slip through each other, and rest untwisted under a turned plate.
TEST(Static, a_cube_that_loses_its_turns_has_no_equilibrium_of_them) {
    Scene scene = twisted_bar(360);
    scene.body.cells = {4, 4, 4};
    scene.material.poisson_ratio = 0.4;
    const Summary summary = solved(scene);
    EXPECT_FALSE(summary.converged);
    EXPECT_NE(summary.failure.find("cells have slipped through each other"), std::string::npos) << summary.failure;
    EXPECT_LE(summary.settlement.residual, 1e-8);
}

/// A load on the free end of a rod: the stretch is F L / (E A) where the ends are free to contract.
TEST(Static, load_stretches_a_rod_by_hookes_law) {
    Scene scene = parse_scene(R"(
        [body]
        cells = [2, 2, 12]
        cell_size = 0.1
        [material]
        young_modulus = 1e6
        poisson_ratio = 0.25
        density = 1000
        [[fix]]
        where = "z-min"
        axes = "z"
        [[fix]]
        where = {node = 0}
        [[fix]]
        where = {node = 2}
        axes = "y"
        [[load]]
        where = "z-max"
        force = [0, 0, 4]
        [solver]
        method = "static"
        [[probe]]
        name = "end"
        where = "z-max"
    )",
                              "rod.toml");
    const Summary summary = solved(scene);
    ASSERT_TRUE(summary.converged) << summary.failure;
    const double expected = 4 * 1.2 / (1e6 * 0.04);
    EXPECT_NEAR(summary.probes.at(0).mean_displacement[2], expected, 1e-3 * expected);
    EXPECT_NEAR(summary.energies.external, -4 * summary.probes.at(0).mean_displacement[2],
                1e-9 * summary.energies.springs);
    EXPECT_NEAR(-summary.energies.external, 2 * summary.energies.springs, 1e-3 * summary.energies.springs);
}

/// The same load through time ends at the same stretch.
TEST(Load, damped_explicit_run_settles_at_the_static_solution) {
    Scene scene = parse_scene(test::small_scene("translate = [0, -0.1, 0]", "translate = [0.01, 0, 0]"), "s.toml");
    scene.loads.push_back({BoxRegion{{0.4, 0.4, 0.4}, {1.1, 1.1, 1.1}}, {30, -20, 10}});
    scene.solver.tolerance = 1e-7;
    scene.solver.duration = 100;
    const Summary in_time = solved(scene);
    EXPECT_TRUE(in_time.converged) << in_time.failure;
    scene.solver.method = SolverMethod::static_equilibrium;
    const Summary at_rest = solved(scene);
    EXPECT_TRUE(at_rest.converged) << at_rest.failure;
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(in_time.probes.at(0).force[a], at_rest.probes.at(0).force[a], 1e-4);
    }
    EXPECT_NEAR(in_time.energies.springs, at_rest.energies.springs, 1e-5 * at_rest.energies.springs);
    EXPECT_NEAR(in_time.energies.external, at_rest.energies.external, 1e-5 * at_rest.energies.springs);
}

/// With steps a hundred times the explicit limit the damped cube settles at the same equilibrium.
TEST(BackwardEuler, settles_at_the_equilibrium_with_steps_a_hundred_times_the_explicit_limit) {
    Scene scene = load_scene(test::example("compression_nu025"));
    scene.solver.method = SolverMethod::backward_euler;
    scene.solver.tolerance = 1e-5;
    scene.output = {};
    scene.solver.time_step = 100 * Simulation(scene).critical_time_step();
    const Summary summary = solved(scene);
    ASSERT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(100 * summary.volume.relative_volume_change, 13.519, 13.519e-4);
    EXPECT_NEAR(summary.probes.at(0).force[1], -46526.7, 1e-4 * 46526.7);
    EXPECT_GT(summary.work.newton_iterations, 0);
}

/// v_n+1 = v_n + dt g: a falling body is not slowed.
TEST(BackwardEuler, free_fall) {
    std::string text = test::small_scene("[[fix]]", "[gravity]\nacceleration = [0, -10, 0]\n[[fix]]");
    text.erase(text.find("[[fix]]"), text.find("[damping]") - text.find("[[fix]]"));
    text.replace(text.find("mass = 3"), 8, "mass = 0");
    text.replace(text.find("symplectic-euler"), 16, "backward-euler");
    Scene scene = parse_scene(text, "s.toml");
    for (const double duration : {3.0, 2.4}) { // of steps: the last one is cut
        scene.solver.time_step = 0.1;
        scene.solver.duration = 0.1 * duration;
        Simulation simulation(scene);
        simulation.step(3);
        EXPECT_NEAR(simulation.time(), scene.solver.duration, 1e-12);
        for (const auto& v : simulation.velocities()) {
            EXPECT_NEAR(v[1], -10 * simulation.time(), 1e-5 * simulation.time());
        }
    }
}

/// A run ends at its duration and writes at its outputs' times, whatever the step that is asked for.
TEST(BackwardEuler, steps_are_cut_at_outputs_and_at_the_end) {
    for (const double asked : {0.0, 0.03, 0.25, 10.0}) { // 0: its own
        for (const double every : {0.1, 0.4, 0.0}) {     // 0: no outputs on the way
            SCOPED_TRACE(std::to_string(asked) + " and " + std::to_string(every));
            std::string text = test::small_scene("[[fix]]", "[[fix]]");
            text.replace(text.find("symplectic-euler"), 16, "backward-euler");
            Scene scene = parse_scene(text, "s.toml");
            scene.solver.duration = 1;
            scene.solver.tolerance.reset();
            scene.solver.time_step.reset();
            scene.output.every.reset();
            if (asked > 0) {
                scene.solver.time_step = asked;
            }
            if (every > 0) {
                scene.output.every = every;
            }
            Simulation simulation(scene);
            std::vector<double> times;
            RunCallbacks callbacks;
            callbacks.output = [&] { times.push_back(simulation.time()); };
            const Summary summary = simulation.run(callbacks);
            EXPECT_EQ(summary.failure, "");
            EXPECT_NEAR(summary.time, 1, 1e-12);
            EXPECT_LE(summary.time_step, asked > 0 ? asked : 1e9);
            for (std::size_t o = 0; o + 1 < times.size(); ++o) {
                EXPECT_NEAR(times[o], static_cast<double>(o) * every, 1e-12);
            }
            EXPECT_EQ(times.size(), every == 0.1 ? 11u : every > 0 ? 4u : 2u);
            // A program may go on: by whole steps.
            simulation.step(1);
            EXPECT_NEAR(simulation.time(), 1 + summary.time_step, 1e-12);
        }
    }
}

TEST(BackwardEuler, explicit_steps_that_long_are_refused_with_the_way_out) {
    Scene scene = load_scene(test::example("compression_nu025"));
    scene.solver.time_step = 1;
    try {
        Simulation simulation(scene);
        FAIL();
    } catch (const SceneError& error) {
        EXPECT_NE(std::string(error.what()).find("backward-euler"), std::string::npos) << error.what();
    }
}

} // namespace
} // namespace hybmss
