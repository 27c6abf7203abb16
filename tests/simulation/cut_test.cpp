/// [[cut]] in scenes: when and where it bites, what it leaves, and that it survives a restart.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/run/cutting.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <random>

namespace hybmss {
namespace {

/// A bar of 4 x 12 x 4 cells of 0.1 m, fixed below and hanging in gravity.
std::string bar(const std::string& cuts, const std::string& material = "poisson_ratio = 0.4\n",
                const std::string& solver = "duration = 1\n") {
    return "[body]\ncells = [4, 12, 4]\ncell_size = 0.1\n"
           "[material]\nyoung_modulus = 1e4\ndensity = 1000\n" +
           material +
           "[[fix]]\nwhere = \"y-min\"\n"
           "[gravity]\nacceleration = [0.2, 0.5, -0.1]\n"
           "[[load]]\nwhere = \"y-max\"\nforce = [0, 0.3, 0.1]\n"
           "[[probe]]\nname = \"end\"\nwhere = \"y-max\"\n"
           "[output]\nevery = 0.25\n"
           "[solver]\n" +
           solver + cuts;
}

Simulation make(const std::string& text, const SimulationOptions& options = {}) {
    return Simulation(parse_scene(text, "s.toml"), options);
}

TEST(CutScene, bites_inside_a_box_a_sphere_and_behind_a_plane_at_rest) {
    const auto removed = [](const std::string& tool) {
        Simulation simulation = make(bar("[[cut]]\nat = 0.1\nframe = \"rest\"\n" + tool));
        const auto steps = static_cast<long>(std::ceil(0.1 / simulation.time_step()));
        simulation.step(steps - 1);
        EXPECT_EQ(simulation.removed_cell_count(), 0u);
        simulation.step(1);
        EXPECT_EQ(simulation.removed_cell_count() + simulation.lattice().cell_count(), 4u * 12 * 4);
        EXPECT_EQ(simulation.cell_nodes().size(), simulation.lattice().cell_count());
        return simulation.removed_cell_count();
    };
    // Centres at 0.05, 0.15, ...
    EXPECT_EQ(removed("box = [[0.05, 0.5, 0], [0.15, 0.7, 0.4]]\n"), 2u * 2 * 4);
    EXPECT_EQ(removed("sphere = {center = [0.15, 0.55, 0.15], radius = 0.1}\n"), 7u);
    EXPECT_EQ(removed("behind = {point = [0, 0.95, 0], normal = [0, -3, 0]}\n"), 4u * 3 * 4);
    EXPECT_EQ(removed("box = [[5, 5, 5], [6, 6, 6]]\n"), 0u);
}

TEST(CutScene, a_tool_that_moves_bites_again_and_again) {
    Simulation simulation = make(bar("[[cut]]\nat = 0.2\nuntil = 0.5\nevery = 0.1\nframe = \"rest\"\n"
                                     "velocity = [1, 0, 0]\nbox = [[0, 0.5, 0], [0.09, 0.59, 1]]\n"));
    std::vector<std::size_t> removed;
    for (const double time : {0.19, 0.29, 0.39, 0.49, 0.9}) {
        simulation.step(static_cast<long>(time / simulation.time_step()) - simulation.steps());
        removed.push_back(simulation.removed_cell_count());
    }
    EXPECT_EQ(removed, (std::vector<std::size_t>{0, 4, 8, 12, 16}));
}

TEST(CutScene, at_the_present_place_of_the_cells) {
    // Rotated by 90 degrees, the bar's end lies along x.
    std::string text = bar("[[cut]]\nat = 0.5\nbox = [[0, 0, 0], [9, 9, 0.4]]\n", "poisson_ratio = 0.25\n");
    text.replace(
        text.find("[[fix]]\nwhere = \"y-min\"\n"), 24,
        "[[move]]\nwhere = {box = [[0, 0, 0], [9, 9, 9]]}\nrotate = {axis = \"z\", degrees = 90}\nover = 0.4\n");
    Simulation simulation = make(text);
    simulation.step(static_cast<long>(0.55 / simulation.time_step()));
    // About the centroid (0.2, 0.6): x from -0.4 to 0.8, so two thirds of the bar are at x > 0.
    EXPECT_EQ(simulation.removed_cell_count(), 8u * 4 * 4);
}

TEST(CutSchedule, bites_once_a_step_at_most) {
    Cut often;
    often.at = 1;
    often.until = 2;
    often.every = 0.01;
    Cut once;
    once.at = once.until = 1.5;
    CutSchedule schedule({often, once}, 0.25);
    std::vector<long> steps;
    std::vector<std::size_t> bitten;
    while (schedule.next_step() != CutSchedule::kNever) {
        steps.push_back(schedule.next_step());
        bitten.push_back(schedule.take(steps.back()).size());
    }
    EXPECT_EQ(steps, (std::vector<long>{4, 5, 6, 7, 8}));
    EXPECT_EQ(bitten, (std::vector<std::size_t>{1, 1, 2, 1, 1}));
}

/// A rough wall that the bar leans on, where the knife goes through.
const char* const kWall = "[[obstacle]]\nplane = {point = [0.001, 0, 0], normal = [1, 0, 0]}\nfriction = 0.3\n";

TEST(CutScene, energy_leaves_with_the_cells) {
    for (const char* material :
         {"poisson_ratio = 0.45\n", "poisson_ratio = 0.1\n", "poisson_ratio = 0.3\nface_diagonal_ratio = 0\n",
          "poisson_ratio = 0.25\n", "poisson_ratio = 0.4\nsprings = \"means\"\n",
          "poisson_ratio = 0.4\nvolume_energy = \"none\"\n",
          "poisson_ratio = 0.25\ncrush_resistance = 20\ncrush_ratio = 0.9999\n",
          "poisson_ratio = 0.4\nstiffening_quadratic = 1\nstiffening_cubic = 3\n"}) {
        Simulation simulation = make(bar(kWall, material));
        simulation.step(200);
        EXPECT_GT(simulation.energies().effects.at(0).stored, 0);
        const unsigned seed = std::random_device{}();
        SCOPED_TRACE(std::string(material) + "seed " + std::to_string(seed));
        std::mt19937 engine(seed);
        const auto sum = [](const Energies& e) {
            return e.springs + e.volume + e.kinetic + e.external + e.removed + e.effects.at(0).stored;
        };
        for (int bite = 0; bite < 6; ++bite) {
            const Energies before = simulation.energies();
            std::vector<std::uint32_t> cells = {191}; // a corner with its loads
            for (int c = 0; c < 20 << bite; ++c) {
                cells.push_back(static_cast<std::uint32_t>(engine() % 192));
            }
            simulation.remove_cells(cells);
            const Energies after = simulation.energies();
            EXPECT_NE(after.removed, before.removed);
            const double scale = before.springs + before.volume + before.kinetic + std::abs(before.external);
            EXPECT_NEAR(sum(after), sum(before), 1e-12 * scale);
            simulation.step(20);
        }
    }
}

TEST(CutScene, cut_away_to_nothing_ends_well) {
    Simulation simulation = make(bar("[[cut]]\nat = 0.2\nbox = [[-9, -9, -9], [9, 9, 9]]\n", "poisson_ratio = 0.4\n",
                                     "duration = 1\ntolerance = 1e-3\n"));
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_EQ(summary.removed_cells, 192u);
    EXPECT_EQ(summary.energies.kinetic, 0);
    EXPECT_EQ(summary.probes.at(0).max_displacement, 0);
    EXPECT_TRUE(std::isfinite(summary.settlement.residual + summary.settlement.kinetic_ratio));
}

TEST(CutScene, does_not_settle_before_its_cuts_are_done) {
    const Summary summary =
        make(bar("[damping]\nmass = 30\n[[cut]]\nat = 4\nframe = \"rest\"\nbox = [[0, 0.5, 0], [0.2, 0.7, 1]]\n",
                 "poisson_ratio = 0.3\n", "duration = 60\ntolerance = 1e-2\n"))
            .run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_GT(summary.time, 4);
    EXPECT_EQ(summary.removed_cells, 16u);
}

const char* const kKnife = "[[cut]]\nat = 0.3\nuntil = 0.8\nevery = 0.05\nvelocity = [0.6, 0, 0]\n"
                           "sphere = {center = [0, 0.7, 0.2], radius = 0.12}\n"
                           "[[cut]]\nat = 0.6\nframe = \"rest\"\nbox = [[0.3, 1.1, 0.3], [0.4, 1.2, 0.4]]\n";

TEST(CutScene, survives_a_restart) {
    const test::TemporaryDirectory directory;
    const std::string file = directory.path() / "checkpoint";
    for (const auto& [layout, wall] : {std::pair{"flat-rows", ""}, {"active-rows", ""}, {"flat-rows", kWall}}) {
        const Scene scene = parse_scene(bar(std::string(kKnife) + wall), "s.toml");
        SimulationOptions options;
        options.plan.layout = layout;
        Simulation whole(scene, options);
        const Summary end = whole.run();
        EXPECT_GT(end.removed_cells, 8u);
        Simulation parts(scene, options);
        for (;;) {
            RunCallbacks callbacks;
            callbacks.checkpoint = [&] {
                parts.write_checkpoint(file);
                return false;
            };
            const Summary part = parts.run(callbacks);
            if (!part.interrupted) {
                EXPECT_EQ(part.energies.removed, end.energies.removed);
                EXPECT_EQ(part.energies.springs, end.energies.springs);
                EXPECT_EQ(part.energies.effects.size(), *wall ? 1u : 0u);
                for (std::size_t e = 0; e < part.energies.effects.size(); ++e) {
                    EXPECT_GT(end.energies.effects[e].dissipated, 0);
                    EXPECT_EQ(part.energies.effects[e].stored, end.energies.effects[e].stored);
                    EXPECT_EQ(part.energies.effects[e].dissipated, end.energies.effects[e].dissipated);
                }
                EXPECT_EQ(part.removed_cells, end.removed_cells);
                EXPECT_EQ(part.probes.at(0).force, end.probes.at(0).force);
                break;
            }
            parts = Simulation::restarted(scene, options, file);
        }
        EXPECT_EQ(parts.displacements(), whole.displacements());
        EXPECT_EQ(parts.velocities(), whole.velocities());
        EXPECT_EQ(parts.cell_nodes(), whole.cell_nodes());
    }
}

TEST(CutScene, a_run_that_diverges_goes_back_before_the_cut) {
    // The tool is the whole upper end; a plate that is torn away at once inverts everything before the next check.
    Simulation simulation = make(bar("[[move]]\nwhere = \"y-max\"\ntranslate = [0, 1e6, 0]\nover = 0.3\n"
                                     "[[cut]]\nat = 0.02\nframe = \"rest\"\nbox = [[0, 0, 0], [0.2, 0.2, 0.2]]\n"));
    std::size_t at_last_check = 0;
    RunCallbacks callbacks;
    callbacks.checkpoint = [&] {
        at_last_check = simulation.removed_cell_count();
        return true;
    };
    const Summary summary = simulation.run(callbacks);
    EXPECT_NE(summary.failure, "");
    EXPECT_EQ(summary.removed_cells, at_last_check);
    EXPECT_EQ(simulation.lattice().cell_count(), 192 - at_last_check);
    EXPECT_TRUE(std::isfinite(summary.energies.springs + summary.energies.removed));
}

TEST(CutScene, results_hold_the_cells_that_are_left) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     bar("[[cut]]\nat = 0.6\nframe = \"rest\"\nbox = [[0, 0.5, 0], [1, 0.7, 1]]\n"));
    const test::ProgramResult result = test::run_program("run s.toml --out out", directory.path());
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_NE(result.errors.find("after the cuts the body has 2 parts"), std::string::npos) << result.errors;
    EXPECT_NE(result.output.find("cut away                 32 cells, with "), std::string::npos) << result.output;
    EXPECT_NE(
        test::read_text(directory.path() / "out/body_0002.vtu").find("NumberOfPoints=\"325\" NumberOfCells=\"192\""),
        std::string::npos);
    // Two layers of cells are gone, and with them the layer of nodes between them.
    EXPECT_NE(
        test::read_text(directory.path() / "out/body_0003.vtu").find("NumberOfPoints=\"300\" NumberOfCells=\"160\""),
        std::string::npos);
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "out/summary.json"));
    EXPECT_EQ(json.at("removed_cells"), 32);
    EXPECT_TRUE(json.at("energy").at("removed").is_number_float());
}

TEST(CutScene, is_refused_where_nothing_moves_step_by_step) {
    for (const char* method : {"static", "backward-euler"}) {
        const std::string solver = std::string("duration = 1\nmethod = \"") + method + "\"\n";
        try {
            make(bar("[[cut]]\nat = 0.2\nbox = [[0, 0, 0], [1, 1, 1]]\n", "poisson_ratio = 0.4\n", solver));
            FAIL() << method;
        } catch (const SceneError& error) {
            EXPECT_EQ(std::string(error.what()), "s.toml:24:6: cut.at = 0.2: cells are cut only while a body moves by "
                                                 "symplectic-euler or leapfrog, not with method = \"" +
                                                     std::string(method) + "\"");
        }
    }
    SimulationOptions options;
    options.plan.layout = "network";
    EXPECT_THROW(make(bar("[[cut]]\nat = 0.2\nbox = [[0, 0, 0], [1, 1, 1]]\n"), options), SceneError);
    const std::uint32_t cells[] = {0};
    EXPECT_THROW(make(bar(""), options).remove_cells(cells), std::invalid_argument);
}

} // namespace
} // namespace hybmss
