// Scenes: what their text means and how they are written, and those that are filled by hand.

#include "hybmss/simulation/scene.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/world_scene.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>

namespace hybmss {
namespace {

TEST(Scene, integers_serve_as_numbers_and_defaults_hold) {
    const Scene scene = parse_scene("[body]\ncells = [1, 2, 3]\ncell_size = 2\n"
                                    "[material]\nyoung_modulus = 10\npoisson_ratio = 0\ndensity = 7\n"
                                    "[solver]\nduration = 4\n",
                                    "s.toml");
    EXPECT_EQ(scene.body.cells[2], 3);
    EXPECT_EQ(scene.body.cell_size, 2.0);
    EXPECT_EQ(scene.material.young_modulus, 10.0);
    EXPECT_EQ(scene.material.face_diagonal_ratio, 1.0);
    EXPECT_EQ(scene.material.volume_energy, VolumeEnergy::automatic);
    EXPECT_FALSE(scene.solver.tolerance || scene.solver.time_step || scene.output.every);
    EXPECT_EQ(scene.damping.mass, 0.0);
}

TEST(Scene, every_region_and_motion_is_read) {
    const Scene scene =
        parse_scene(test::small_scene("[[fix]]", "[[fix]]\nwhere = {node = 4}\naxes = \"zx\"\n"
                                                 "[[fix]]\nwhere = {sphere = {center = [1, 2, 3], radius = 0.5}}\n"
                                                 "[[move]]\nwhere = {box = [[0, 0, 0], [1, 2, 3]]}\n"
                                                 "rotate = {axis = \"z\", degrees = -30}\nover = 0\n[[fix]]"),
                    "s.toml");
    ASSERT_EQ(scene.fixes.size(), 3u);
    EXPECT_EQ(std::get<NodeRegion>(scene.fixes[0].where).node, 4);
    EXPECT_EQ(scene.fixes[0].axes, 5);
    EXPECT_EQ(std::get<SphereRegion>(scene.fixes[1].where).center[2], 3.0);
    EXPECT_EQ(std::get<FaceRegion>(scene.fixes[2].where).axis, 1);
    EXPECT_FALSE(std::get<FaceRegion>(scene.fixes[2].where).high);
    ASSERT_EQ(scene.moves.size(), 2u);
    EXPECT_EQ(std::get<BoxRegion>(scene.moves[0].where).high[1], 2.0);
    EXPECT_EQ(std::get<Rotation>(scene.moves[0].motion).axis, 2);
    EXPECT_EQ(std::get<Rotation>(scene.moves[0].motion).degrees, -30.0);
    EXPECT_EQ(scene.moves[1].axes, kAllAxes);
}

TEST(Scene, every_example_is_written_and_read_back) {
    int scenes = 0;
    for (const auto& entry : std::filesystem::directory_iterator(HYBMSS_SOURCE_DIR "/examples/scenes")) {
        if (entry.path().extension() == ".toml") {
            const std::variant<Scene, WorldScene> scene = load_any_scene(entry.path());
            const std::string text = std::visit([](const auto& read) { return to_toml(read); }, scene);
            EXPECT_TRUE(parse_any_scene(text, entry.path()) == scene) << text;
            ++scenes;
        }
    }
    EXPECT_GT(scenes, 5);
}

/// What no example has.
TEST(Scene, every_key_is_written_and_read_back) {
    const Scene scene = parse_scene(
        test::small_scene(
            "[[fix]]",
            "[[fix]]\nwhere = {node = 4}\naxes = \"zx\"\n"
            "[[fix]]\nwhere = {sphere = {center = [1, 2, 3], radius = 0.1}}\n"
            "[[move]]\nwhere = {box = [[0, 0, 0], [1e-300, 2, 3]]}\n"
            "rotate = {axis = \"z\", degrees = -30}\nover = 0\n"
            "[[cut]]\nbehind = {point = [0, 1, 2], normal = [0, 0, -1]}\nat = 1\n"
            "until = 2\nevery = 0.3333333333333333\nframe = \"rest\"\n"
            "[[cut]]\nsphere = {center = [1, 2, 3], radius = 0.5}\nat = 0.5\n"
            "[[obstacle]]\nsphere = {center = [1, -9, 3], radius = 0.7}\nname = \"ball\"\n"
            "rotate = {axis = \"x\", degrees = 1}\ntranslate = [1, 2, 3]\nstiffness = 7\n"
            "[[obstacle]]\ncapsule = {from = [0.1, 0.7, -3], to = [0.3, 9, 1e-3], radius = 1.5}\n"
            "[[obstacle]]\nbox = [[1e-6, -0.1, 0.3], [1.1, 0.2, 1e9]]\n"
            "[[obstacle]]\nhull = {points = [[0, 0, 0], [1, 0, 0.1], [0, 1.5, 0], [0, 0, 1]], at = [3, 2, 1]}\n"
            "[[obstacle]]\nheight = {rows = [[0, 1, 0.5], [0.1, 0, -2]], spacing = 0.3}\n"
            "[[load]]\nwhere = \"x-max\"\nforce = [1e18, -0.0, 1]\n"
            "[[load]]\nwhere = \"x-max\"\ntraction = [1, -0.0, 1e18]\n"
            "[[load]]\nwhere = \"x-max\"\nmoment = [1, 2, 3]\n"
            "[[load]]\nwhere = \"x-max\"\nacceleration = [[0, 1, 2, 3]]\n"
            "[[load]]\nwhere = \"x-max\"\nforce_density = [3, 2, 1]\n"
            "[[pressure]]\nwhere = \"x-max\"\npressure = 0.1\n"
            "[[pressure]]\nwhere = \"x-min\"\npressure = [[0, -1], [0.5, 2e5]]\n"
            "[[load]]\nwhere = {of = {of = \"x-max\", without = [{node = 3}]}, without = "
            "[\"y-min\", {sphere = {center = [1, 2, 3], radius = 0.1}}]}\n"
            "force = [[-1, 0, 0, 0], [1.5, 1, 2, 3e17]]\n"
            "[gravity]\nacceleration = [[0.1, 1, 2, 3]]\n"
            "[[start]]\nvelocity = [1, 2, 3]\n"
            "[[start]]\nwhere = \"x-min\"\nangular_velocity = [0.1, 0, 0]\n[[fix]]"),
        "s.toml");
    EXPECT_TRUE(parse_scene(to_toml(scene), "s.toml") == scene) << to_toml(scene);

    Scene free = scene;
    free.body = {.cell_size = 0, .size = {1, 2, 3}};
    free.solver = {};
    free.solver.method = SolverMethod::static_equilibrium;
    free.solver.accuracy = 1e-3;
    free.solver.load_steps = 3;
    free.solver.preconditioner = PreconditionerKind::multigrid;
    free.relaxation = {{0.1, 2}, {1e6, 1e-9}};
    for (const SolverMethod method : {SolverMethod::modes, SolverMethod::buckling}) {
        Scene shaking = scene;
        shaking.solver = {};
        shaking.solver.method = method;
        shaking.solver.count = 11;
        EXPECT_TRUE(parse_scene(to_toml(shaking), "s.toml") == shaking) << to_toml(shaking);
    }
    free.material.volume_energy = VolumeEnergy::none;
    free.material.stiffening = {-0.5, 1};
    free.material.crush = {20, 0.6};
    EXPECT_TRUE(parse_scene(to_toml(free), "s.toml") == free) << to_toml(free);
    free.body.labels = {1, 2};
    free.body.size = {0, 0, 0};
    EXPECT_THROW(to_toml(free), SceneError);
    Scene made = scene; // by a program
    made.obstacles[0].shape =
        MeshShape(std::vector<std::array<double, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                  std::vector<std::array<std::uint32_t, 3>>{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, 4);
    EXPECT_THROW(to_toml(made), SceneError);
}

TEST(Scene, any_two_moduli_are_a_material) {
    const auto moduli = [](const std::string& lines) {
        std::string text = test::small_scene("young_modulus = 1e4", lines);
        text.erase(text.find("poisson_ratio = 0.3\n"), 20);
        return parse_scene(text, "s.toml").material;
    };
    const Material by_moduli = moduli("shear_modulus = 6e3\nbulk_modulus = 1e4");
    EXPECT_DOUBLE_EQ(by_moduli.young_modulus, 15e3);
    EXPECT_DOUBLE_EQ(by_moduli.poisson_ratio, 0.25);
    const Material by_lame = moduli("lame_modulus = 6e3\nshear_modulus = 6e3");
    EXPECT_DOUBLE_EQ(by_lame.young_modulus, 15e3);
    const auto refused = [&](const std::string& lines, const std::string& told) {
        try {
            moduli(lines);
            ADD_FAILURE() << lines;
        } catch (const SceneError& error) {
            EXPECT_NE(std::string(error.what()).find(told), std::string::npos) << error.what();
        }
    };
    const Material brain = moduli("preset = \"brain-white\"");
    EXPECT_EQ(brain.young_modulus, 1767.2);
    EXPECT_EQ(brain.stiffening.cubic, 199.83);
    refused("preset = \"brain-grey\"\nyoung_modulus = 1", "neither may be given besides");
    refused("preset = \"bone\"", "\"brain-grey\" or \"brain-white\"");
    refused("shear_modulus = 6e3", "material.young_modulus: missing");
    refused("shear_modulus = 6e3\nbulk_modulus = 1e4\nyoung_modulus = 1", "only two of");
    refused("young_modulus = 1000\nshear_modulus = 300", "poisson_ratio = 0.666667");
    refused("shear_modulus = -1\nbulk_modulus = 1", "s.toml:5:17: material.shear_modulus = -1: it must be");
    refused("young_modulus = 1\npoisson_ratio = 0.3\nrelaxation = [[1, 0]]", "material.relaxation");
    refused("young_modulus = 1\npoisson_ratio = 0.3\nrelaxation = []", "one to four rows");
    refused("young_modulus = 1\npoisson_ratio = 0.3\nrelaxation = [[1, 2, 3]]", "one to four rows");
}

TEST(Scene, documentation_shows_exactly_the_keys_of_the_parser) {
    const std::string document = test::read_text(HYBMSS_SOURCE_DIR "/docs/report/scene_keys.md");
    EXPECT_NE(document.find(scene_keys_markdown()), std::string::npos)
        << "docs/report/scene_keys.md must hold what `hybmss explain --keys` prints";
}

/// The example at the head of docs/scenes.md, which is indented by four blanks.
TEST(Scene, documentation_example_is_a_scene) {
    const std::string document = test::read_text(HYBMSS_SOURCE_DIR "/docs/scenes.md");
    std::string text;
    for (std::size_t at = document.find("    [body]"); document.compare(at, 3, "Run") != 0;) {
        const std::size_t end = document.find('\n', at);
        text += document.substr(at, end + 1 - at);
        at = end + 1;
    }
    EXPECT_EQ(parse_scene(text, "docs/scenes.md").probes.at(0).name, "plate");
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Fault {
    const char* told;
    std::function<void(Scene&)> make;
};

TEST(HandFilledScene, every_number_must_be_in_its_keys_range) {
    const std::vector<Fault> faults = {
        {"solver.duration: -1 is not allowed", [](Scene& s) { s.solver.duration = -1; }},
        {"solver.duration: nan is not allowed", [](Scene& s) { s.solver.duration = kNaN; }},
        {"solver.time_step: nan", [](Scene& s) { s.solver.time_step = kNaN; }},
        {"solver.time_step: -0.001", [](Scene& s) { s.solver.time_step = -1e-3; }},
        {"solver.tolerance: -1", [](Scene& s) { s.solver.tolerance = -1; }},
        {"solver.load_steps: 0", [](Scene& s) { s.solver.load_steps = 0; }},
        {"output.every: 0", [](Scene& s) { s.output.every = 0; }},
        {"body.cell_size: -1", [](Scene& s) { s.body.cell_size = -1; }},
        {"body.origin: nan", [](Scene& s) { s.body.origin[1] = kNaN; }},
        {"material.poisson_ratio: 0.6", [](Scene& s) { s.material.poisson_ratio = 0.6; }},
        {"gravity.acceleration: nan", [](Scene& s) { s.gravity.acceleration[2] = kNaN; }},
        {"damping.mass: -1", [](Scene& s) { s.damping.mass = -1; }},
        {"fix.where: 7 is not allowed: it must be 0, 1 or 2", [](Scene& s) { s.fixes[0].where = FaceRegion{7}; }},
        {"fix.axes: 9", [](Scene& s) { s.fixes[0].axes = 9; }},
        {"move.over: nan", [](Scene& s) { s.moves[0].over = kNaN; }},
        {"move.rotate.axis: 5",
         [](Scene& s) {
             s.moves[0].motion = Rotation{5, 10};
         }},
        {"probe.where: -1",
         [](Scene& s) {
             s.probes = {{"p", SphereRegion{{0, 0, 0}, -1}}};
         }},
        {"load.force: inf",
         [](Scene& s) {
             s.loads = {{FaceRegion{}, {INFINITY, 0, 0}}};
         }},
        {"load.force: nan",
         [](Scene& s) {
             s.loads = {{FaceRegion{}, {1, 0, 0}, {{0, kNaN, 0, 0}}}};
         }},
        {"load.force: 1 is not allowed: it must be three numbers, or rows [time, x, y, z] with ascending times",
         [](Scene& s) {
             s.loads = {{FaceRegion{}, {1, 0, 0}, {{1, 0, 0, 0}, {1, 0, 0, 0}}}};
         }},
        {"start.velocity: inf", [](Scene& s) { s.starts.emplace_back().velocity[2] = INFINITY; }},
        {"start.where: 2 is not allowed: it must be one region",
         [](Scene& s) {
             s.starts.emplace_back().where = RegionWithout{{FaceRegion{}, FaceRegion{}}, {}};
         }},
        {"cut.at: nan", [](Scene& s) { s.cuts.emplace_back().at = kNaN; }},
        {"cut.at: -1", [](Scene& s) { s.cuts.emplace_back().at = -1; }},
        {"cut.every: 1e-300", [](Scene& s) { s.cuts.emplace_back().until = 1, s.cuts[0].every = 1e-300; }},
        {"obstacle.friction: -1",
         [](Scene& s) {
             s.obstacles.emplace_back();
             s.obstacles[0].shape = PlaneShape{{0, 1, 0}};
             s.obstacles[0].friction = -1;
         }},
    };
    for (const Fault& fault : faults) {
        Scene scene = parse_scene(test::small_scene(), "s.toml");
        scene.source = {};
        EXPECT_NO_THROW(Simulation{scene});
        fault.make(scene);
        try {
            Simulation simulation(scene);
            ADD_FAILURE() << "accepted: " << fault.told;
        } catch (const SceneError& error) {
            EXPECT_EQ(std::string(error.what()).find(std::string("scene: ") + fault.told), 0u) << error.what();
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
}

/// The square of such a time is 0.
TEST(HandFilledScene, a_motion_may_take_next_to_no_time) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    scene.moves[0].over = 1e-200;
    Simulation simulation(scene);
    simulation.step();
    for (const ProbeReading& probe : simulation.probes()) {
        EXPECT_TRUE(std::isfinite(probe.force[1])) << probe.force[1];
    }
}

/// Its energy is not in the balance: a scene's own cuts are refused with it too.
TEST(HandFilledScene, cells_cannot_be_removed_beside_an_energy_balance) {
    Scene scene = parse_scene(test::small_scene(), "s.toml");
    scene.output.energy_balance = true;
    scene.solver.tolerance.reset();
    Simulation simulation(scene);
    const std::uint32_t cell[] = {0};
    EXPECT_THROW(simulation.remove_cells(cell), std::invalid_argument);
}

} // namespace
} // namespace hybmss
