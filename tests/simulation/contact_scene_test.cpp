/// Scenes with obstacles, and where their energy goes.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"
#include "tests/simulation/files.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace hybmss {
namespace {

const std::string kCube = "[body]\ncells = [4, 4, 4]\ncell_size = 0.1\n[material]\nyoung_modulus = 1e5\n"
                          "poisson_ratio = 0.3\ndensity = 1000\n";
const std::string kMetered = "[output]\nenergy_balance = true\n";

/// The balance of a whole scene, which must close; by leapfrog too.
EnergyBalance balance_of(const std::string& text) {
    EnergyBalance balance;
    Scene scene = parse_scene(text, "s.toml");
    for (const SolverMethod method : {SolverMethod::leapfrog, SolverMethod::symplectic_euler}) {
        scene.solver.method = method;
        const Summary summary = Simulation(scene).run();
        EXPECT_EQ(summary.failure, "");
        EXPECT_TRUE(summary.balance);
        balance = summary.balance.value_or(EnergyBalance{});
        EXPECT_LT(balance.relative_imbalance(), 1e-3) << balance.imbalance() << ", " << name(method);
    }
    return balance;
}

TEST(SceneEnergyBalance, closes_with_plates) {
    const EnergyBalance b = balance_of(kCube + kMetered +
                                       "[[fix]]\nwhere = \"y-min\"\n"
                                       "[[move]]\nwhere = \"y-max\"\ntranslate = [0.05, -0.04, 0]\nover = 0.3\n"
                                       "[damping]\nmass = 5\n[solver]\nduration = 0.4\n");
    EXPECT_GT(b.supports, 0.1);
    EXPECT_GT(b.elastic, 0.5 * b.supports);
    EXPECT_GT(b.mass_damping, 1e-3 * b.supports);
    EXPECT_EQ(b.effects_dissipated, 0);
}

TEST(SceneEnergyBalance, closes_with_a_turning_plate_and_gravity) {
    const EnergyBalance b =
        balance_of(kCube + kMetered +
                   "[[fix]]\nwhere = \"y-min\"\naxes = \"y\"\n[gravity]\nacceleration = [1, -9, 0]\n"
                   "[[move]]\nwhere = \"y-max\"\nrotate = {axis = \"y\", degrees = 30}\nover = 0.2\n"
                   "[solver]\nduration = 0.3\n");
    EXPECT_GT(b.supports, 0.1);
    EXPECT_GT(std::abs(b.gravity), 0.001);
    EXPECT_EQ(b.mass_damping, 0);
}

TEST(SceneEnergyBalance, closes_with_loads) {
    const EnergyBalance b =
        balance_of(kCube + kMetered +
                   "[[fix]]\nwhere = \"x-min\"\n[[load]]\nwhere = \"x-max\"\nforce = [0, -200, 50]\n"
                   "[damping]\nmass = 3\n[solver]\nduration = 0.5\n");
    EXPECT_GT(b.loads, 0.1);
    EXPECT_EQ(b.supports, 0);
    EXPECT_GT(b.mass_damping, 0.1 * b.loads);
}

/// Falls, bounces, is pushed along by a box and slides; by its nodes, and by its skin.
TEST(SceneEnergyBalance, closes_with_contact_friction_and_a_moving_box) {
    double obstacles = 0;
    for (const std::string contact : {"nodes", "skin"}) {
        SCOPED_TRACE(contact);
        const EnergyBalance b = balance_of(
            "[body]\ncontact = \"" + contact + "\"\n" + kCube.substr(kCube.find("cells")) + kMetered +
            "[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = 1\n"
            "[[obstacle]]\nname = \"floor\"\nplane = {point = [0, -0.05, 0], normal = [0, 1, 0]}\nfriction = 0.4\n"
            "[[obstacle]]\nname = \"box\"\nbox = [[-0.6, -0.04, -0.2], [-0.05, 0.3, 0.6]]\nfriction = 0.2\n"
            "translate = [0.5, 0, 0]\nover = 0.6\n[solver]\nduration = 0.8\n");
        EXPECT_GT(b.obstacles, 1);
        EXPECT_GT(b.gravity, 1);
        EXPECT_GT(b.effects_dissipated, 1);
        EXPECT_GT(b.mass_damping, 0.01);
        EXPECT_NE(b.obstacles, obstacles); // the key is heard
        obstacles = b.obstacles;
    }
}

/// A ball thrown at a cube that lies on the floor takes part in it, with its own weight.
TEST(SceneEnergyBalance, closes_with_a_free_obstacle) {
    const EnergyBalance b =
        balance_of(kCube + kMetered +
                   "[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = 1\n"
                   "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\nfriction = 0.4\n"
                   "[[obstacle]]\nname = \"ball\"\nsphere = {center = [0.57, 0.3, 0.2], radius = 0.15}\nmass = 20\n"
                   "velocity = [-3, 0, 0]\nfriction = 0.3\n[solver]\nduration = 0.3\ntime_step = 2e-4\n");
    EXPECT_LT(b.free_obstacles, -20);
    EXPECT_GT(b.gravity, 10);
    EXPECT_GT(b.kinetic + b.elastic, 5);
    EXPECT_EQ(b.obstacles, 0);
}

TEST(SceneContact, of_skins_is_refused_where_nothing_moves) {
    const Scene scene = parse_scene("[body]\ncontact = \"skin\"\n" + kCube.substr(kCube.find("cells")) +
                                        "[[fix]]\nwhere = \"x-min\"\n[[obstacle]]\n"
                                        "plane = {point = [0, -0.05, 0], normal = [0, 1, 0]}\n"
                                        "[solver]\nmethod = \"static\"\n",
                                    "s.toml");
    std::string message;
    try {
        Simulation simulation(scene);
    } catch (const SceneError& error) {
        message = error.what();
    }
    EXPECT_EQ(message.rfind("s.toml:2:11: body.contact = \"skin\": ", 0), 0u) << message;
    EXPECT_NE(message.find("leapfrog"), std::string::npos) << message;
}

/// A ball of voxels would do as well; a cube on a turntable feels the torque.
TEST(SceneEnergyBalance, closes_with_a_turning_obstacle) {
    const EnergyBalance b =
        balance_of(kCube + kMetered +
                   "[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = 3\n"
                   "[[obstacle]]\nplane = {point = [0.2, 0, 0.2], normal = [0, 1, 0]}\nfriction = 0.8\n"
                   "rotate = {axis = \"y\", degrees = 60}\nover = 0.5\n[solver]\nduration = 0.6\n");
    EXPECT_GT(b.obstacles, 0.05);
}

TEST(ContactScene, rests_with_its_weight_on_the_floor) {
    Simulation simulation(
        parse_scene(kCube + "[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = 20\n[[obstacle]]\n"
                            "plane = {point = [0, 0, 0], normal = [0, 3, 0]}\nstiffness = 2e5\nfriction = 0.5\n"
                            "[solver]\nduration = 3\ntolerance = 1e-3\n",
                    "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    const ObstacleReading& floor = summary.obstacles.at(0).reading;
    EXPECT_EQ(summary.obstacles[0].name, "obstacle_0");
    EXPECT_NEAR(floor.force[1], 64 * 10, 0.1);
    // Pressure by stiffness: 64 kg on 0.16 m^2.
    double depth = 0;
    for (const auto& u : simulation.displacements()) {
        depth = std::max(depth, -u[1]);
    }
    EXPECT_GT(depth, 640 / 0.16 / 2e5);
    EXPECT_NEAR(floor.depth, 640 / 0.16 / 2e5, 0.15 * 640 / 0.16 / 2e5); // edges bear less, corners more
    EXPECT_TRUE(summary.warnings.empty());
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     kCube + kMetered +
                         "[[obstacle]]\nname = \"a\"\nplane = {point = [0, 0, 0], normal = [0, 3, 0]}\n"
                         "[solver]\nduration = 0.1\n");
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_NE(run.output.find("obstacle a"), std::string::npos) << run.output;
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
    const nlohmann::json& a = json.at("obstacles").at("a");
    EXPECT_TRUE(a.contains("greatest_depth"));
    // 16 (rho h / 2) / dt^2, with the body's own stable step: contact leaves it as it is.
    const double dt = json.at("critical_time_step").get<double>();
    EXPECT_NEAR(a.at("stiffness").get<double>(), 16 * 1000 * 0.1 / 2 / dt / dt, 1e-6 * a.at("stiffness").get<double>());
    EXPECT_TRUE(json.at("energy_balance").contains("relative_imbalance"));
    EXPECT_TRUE(json.at("effects").at("contact").contains("dissipated"));
    // Where it stands is in every result.
    const std::vector<double> drawn =
        test::vtu_array<double>(test::read_text(directory.path() / "r/body_0000.vtu"), "obstacles");
    EXPECT_EQ(drawn, (std::vector<double>{0, 0, 3, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

/// A cube rests on a rod that stands slightly oblique; its picture is along its axis.
TEST(ContactScene, a_capsule_bears_a_cube_and_is_drawn) {
    const test::TemporaryDirectory directory;
    const std::string rod = "[[obstacle]]\nname = \"rod\"\ncapsule = {from = [-3, -0.5, 0.2], to = [3, -0.5, 0.2], "
                            "radius = 0.5}\nfriction = 1\n";
    test::write_text(directory.path() / "s.toml", kCube +
                                                      "[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = "
                                                      "20\n" +
                                                      rod + "[solver]\nduration = 1\n");
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
    EXPECT_NEAR(json.at("obstacles").at("rod").at("force").at(1).get<double>(), 640, 1);
    const std::vector<double> drawn =
        test::vtu_array<double>(test::read_text(directory.path() / "r/body_0000.vtu"), "obstacles");
    ASSERT_EQ(drawn.size(), 16u);
    EXPECT_EQ(std::vector<double>(drawn.begin(), drawn.begin() + 7), (std::vector<double>{3, 0.5, 6, 0, 0, -0.5, 0.2}));
    for (std::size_t a = 0; a < 3; ++a) { // y goes into x or its opposite
        EXPECT_NEAR(std::abs(drawn[8 + 3 * a]), a == 0 ? 1 : 0, 1e-15);
    }
    const double* r = &drawn[7];
    EXPECT_NEAR(r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                    r[2] * (r[3] * r[7] - r[4] * r[6]),
                1, 1e-14);
}

/// The columns of a csv file by their names.
std::map<std::string, std::vector<double>> columns(const std::string& csv) {
    std::istringstream lines(csv);
    std::string line, field;
    std::vector<std::string> names;
    std::map<std::string, std::vector<double>> all;
    for (bool header = true; std::getline(lines, line); header = false) {
        std::istringstream fields(line);
        for (std::size_t column = 0; std::getline(fields, field, ','); ++column) {
            header ? names.push_back(field) : all[names.at(column)].push_back(std::stod(field));
        }
    }
    return all;
}

const std::string kSlab = // 3 x 1 x 3 m, its upper face at y = 0
    "v -1 -1 -1\nv 2 -1 -1\nv -1 0 -1\nv 2 0 -1\nv -1 -1 2\nv 2 -1 2\nv -1 0 2\nv 2 0 2\n"
    "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

/// A cube at rest on the same ground, told as a box, a hull, a mesh and heights, from files and not; and the balance.
TEST(ContactScene, hulls_meshes_and_heights_bear_a_cube) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "slab.obj", kSlab);
    test::write_text(directory.path() / "flat.txt", "# heights\n0 0,0\n\n0, 0 0\r\n0 0 0\n");
    const auto scene_of = [&](const std::string& shape) {
        test::write_text(directory.path() / "s.toml",
                         kCube + kMetered + "[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = 20\n" +
                             "[[obstacle]]\n" + shape + "\nfriction = 0.5\n[solver]\nduration = 1\n");
        return load_scene((directory.path() / "s.toml").string());
    };
    std::vector<double> forces, depths;
    for (const std::string shape :
         {"box = [[-1, -1, -1], [2, 0, 2]]",
          "hull = {points = [[-1, 0, -1], [2, 0, -1], [-1, 0, 2], [2, 0, 2], [0.5, -1, 0.5]]}",
          "hull = {file = \"slab.obj\"}", "mesh = {file = \"slab.obj\", cells = 24}",
          "height = {rows = [[0, 0], [0, 0]], spacing = 3, at = [-1, 0, -1]}",
          "height = {file = \"flat.txt\", spacing = 1}"}) {
        const Scene scene = scene_of(shape);
        test::write_text(directory.path() / "again.toml", to_toml(scene));
        EXPECT_TRUE(load_scene((directory.path() / "again.toml").string()) == scene) << to_toml(scene);
        const Summary summary = Simulation(scene).run();
        EXPECT_EQ(summary.failure, "") << shape;
        forces.push_back(summary.obstacles.at(0).reading.force[1]);
        depths.push_back(summary.obstacles.at(0).reading.greatest_depth);
        EXPECT_LT(summary.balance.value_or(EnergyBalance{}).relative_imbalance(), 1e-3) << shape;
        EXPECT_NEAR(forces.back(), 640, 1) << shape;
        EXPECT_NEAR(depths.back(), depths[0], 1e-6 * depths[0]) << shape;
    }
    const auto refused = [&](const std::string& shape) {
        try {
            Simulation simulation(scene_of(shape));
        } catch (const SceneError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    test::write_text(directory.path() / "open.obj", kSlab.substr(0, kSlab.rfind("f ")));
    EXPECT_NE(
        refused("mesh = {file = \"open.obj\"}").find("mesh.file = \"open.obj\": a mesh is not closed: 4 of its edges"),
        std::string::npos)
        << refused("mesh = {file = \"open.obj\"}");
    test::write_text(directory.path() / "bad.txt", "0 0\n0 x\n");
    EXPECT_NE(refused("height = {file = \"bad.txt\", spacing = 1}").find("line 2: x is no number"), std::string::npos);
    test::write_text(directory.path() / "bad.txt", "0 0\n\n0 1 2\n");
    EXPECT_NE(refused("height = {file = \"bad.txt\", spacing = 1}").find("line 3 has 3 numbers, those before it 2"),
              std::string::npos);
    // The program, whose results hold where they stand; and an equilibrium.
    scene_of("hull = {file = \"slab.obj\", at = [0.25, 0, 0]}");
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const std::vector<double> drawn =
        test::vtu_array<double>(test::read_text(directory.path() / "r/body_0000.vtu"), "obstacles");
    EXPECT_EQ(drawn, (std::vector<double>{4, 0, 0, 0, 0.25, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
    Scene at_rest = scene_of("height = {file = \"flat.txt\", spacing = 1}");
    at_rest.obstacles[0].friction = 0;
    at_rest.output.energy_balance = false;
    at_rest.damping = {};
    at_rest.solver = {};
    at_rest.solver.method = SolverMethod::static_equilibrium;
    const Summary still = Simulation(at_rest).run();
    EXPECT_EQ(still.failure, "");
    EXPECT_NEAR(still.obstacles.at(0).reading.force[1], 640, 0.1);
}

const std::string kBall = "[[obstacle]]\nname = \"ball\"\nsphere = {center = [0.2, 0.552, 0.2], radius = 0.15}\n"
                          "mass = 3\nfriction = 0.3\n";

/// It settles when the ball does, and not before; what bears it is its weight.
TEST(ContactScene, a_ball_comes_to_rest_on_a_cube) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     kCube +
                         "[[fix]]\nwhere = \"y-min\"\n[gravity]\nacceleration = [0, -10, 0]\n[damping]\nmass = 20\n" +
                         kBall + "[solver]\nduration = 60\ntolerance = 1e-4\n[output]\nevery = 5\n");
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors << run.output;
    EXPECT_NE(run.output.find("turns by"), std::string::npos);
    const auto history = columns(test::read_text(directory.path() / "r/probes.csv"));
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
    const nlohmann::json& ball = json.at("obstacles").at("ball");
    EXPECT_NEAR(ball.at("force").at(1).get<double>(), -30, 0.03);
    EXPECT_NEAR(ball.at("position").at(0).get<double>(), 0.2, 1e-4);
    EXPECT_LT(std::abs(ball.at("velocity").at(1).get<double>()), 1e-4);
    EXPECT_NEAR(history.at("obstacles.ball.position.y").front(), 0.552, 1e-12);
    EXPECT_NEAR(history.at("obstacles.ball.position.y").back(), ball.at("position").at(1).get<double>(), 1e-9);
    EXPECT_EQ(history.at("obstacles.ball.velocity.z").size(), history.at("time").size());
}

TEST(ContactScene, free_obstacles_are_refused_where_nothing_moves_and_for_skins) {
    const auto refusal = [](const std::string& text) -> std::string {
        try {
            Simulation(parse_scene(text, "s.toml"));
        } catch (const SceneError& error) {
            return error.what();
        }
        return "";
    };
    const std::string step = "[solver]\nduration = 1\ntime_step = 0.01\nmethod = \"backward-euler\"\n";
    EXPECT_EQ(
        refusal(kCube + "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\nmass = 1\n" + step),
        "s.toml:10:8: obstacle.mass = 1: a free obstacle moves with \"symplectic-euler\" and \"leapfrog\" only: with "
        "another method obstacles have no mass");
    EXPECT_NE(refusal("[body]\ncontact = \"skin\"\n" + kCube.substr(kCube.find("cells")) +
                      "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\nmass = 1\n[solver]\nduration = 1\n")
                  .find("obstacle.mass = 1: a skin touches obstacles that are led"),
              std::string::npos);
    const Scene scene = parse_scene(kCube + kBall + "inertia = [1, 2, 3]\n[solver]\nduration = 1\n", "s.toml");
    EXPECT_EQ(parse_scene(to_toml(scene), "t.toml"), scene);
}

TEST(ContactScene, probes_csv_holds_what_obstacles_did) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     kCube + "[gravity]\nacceleration = [0, -10, 0]\n[[start]]\nvelocity = [1, -1, 0]\n"
                             "[[obstacle]]\nname = \"floor\"\nplane = {point = [0, -0.01, 0], normal = [0, 1, 0]}\n"
                             "friction = 0.5\n[[probe]]\nname = \"floor\"\nwhere = \"y-min\"\n"
                             "[output]\nevery = 0.02\n[solver]\nduration = 0.4\n");
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_NE(run.output.find("Pa/m"), std::string::npos) << run.output;
    const auto history = columns(test::read_text(directory.path() / "r/probes.csv"));
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
    const nlohmann::json& floor = json.at("obstacles").at("floor");
    for (const char* quantity : {"nodes", "depth", "energy", "dissipated"}) {
        const std::vector<double>& column = history.at(std::string("obstacles.floor.") + quantity);
        EXPECT_EQ(column.size(), 21u);
        EXPECT_NEAR(column.back(), floor.at(quantity).get<double>(), 1e-8 * std::abs(column.back())) << quantity;
    }
    for (const char* quantity : {"force", "torque", "impulse"}) {
        for (std::size_t a = 0; a < 3; ++a) {
            const double last = history.at(std::string("obstacles.floor.") + quantity + "." + "xyz"[a]).back();
            EXPECT_NEAR(last, floor.at(quantity).at(a).get<double>(), 1e-8 * std::abs(last)) << quantity;
        }
    }
    // Not yet there, on its way, at work: what the floor gave stopped the fall, and friction took from the slide.
    const auto& nodes = history.at("obstacles.floor.nodes");
    EXPECT_EQ(nodes[0], 0);
    EXPECT_GT(*std::max_element(nodes.begin(), nodes.end()), 20);
    EXPECT_GT(history.at("obstacles.floor.impulse.y").back(), 64);
    EXPECT_LT(history.at("obstacles.floor.impulse.x").back(), -5);
    EXPECT_GT(history.at("obstacles.floor.dissipated").back(), 5);
}

/// The example whose plane is tilted: it sticks up to the friction angle, and slides then as a rigid block does.
TEST(ContactScene, a_block_on_a_plane_that_is_tilted_slides_from_the_friction_angle_on) {
    Scene scene = load_scene(test::example("incline"));
    scene.output = {};
    Simulation simulation(scene);
    const auto way = [&] { return simulation.probes().at(0).mean_displacement[0]; };
    simulation.step(std::lround(2.2 / simulation.time_step()));
    const double sheared = way();
    EXPECT_LT(sheared, 5e-4); // 26 degrees
    EXPECT_EQ(simulation.run().failure, "");
    double slid = 0, speed = 0;
    const double dt = 1e-4;
    for (double t = 2; t < simulation.time(); t += dt) {
        const auto g = value_at({}, scene.gravity.acceleration_in_time, t);
        speed = std::max(speed + dt * (g[0] + scene.obstacles[0].friction * g[1] - scene.damping.mass * speed), 0.0);
        slid += dt * speed;
    }
    EXPECT_GT(slid, 0.1);
    EXPECT_NEAR(way() - sheared, slid, 0.02 * slid);
}

/// A quarter of a block under a sphere that is pressed into it by 1 % of its height.
std::string pressed_block(int cells, const std::string& poisson_ratio, const std::string& stiffness) {
    const std::string n = std::to_string(cells);
    return "[body]\ncells = [" + n + ", " + n + ", " + n + "]\ncell_size = " + std::to_string(2.0 / cells) +
           "\n[material]\nyoung_modulus = 1e6\npoisson_ratio = " + poisson_ratio +
           "\ndensity = 1000\n[[fix]]\nwhere = \"y-min\"\n[[fix]]\nwhere = \"x-min\"\naxes = \"x\"\n"
           "[[fix]]\nwhere = \"z-min\"\naxes = \"z\"\n[[probe]]\nname = \"support\"\nwhere = \"y-min\"\n"
           "[[obstacle]]\nname = \"ball\"\nsphere = {center = [0, 18, 0], radius = 16}\n"
           "translate = [0, -0.02, 0]\nover = 0.08\n" +
           stiffness + "[damping]\nmass = 50\n[solver]\nduration = 2.4\ntolerance = 3e-4\n";
}

/// Stiff contact, ten times the cells' stiffness by their size, at the default step.
TEST(ContactScene, stiff_contact_comes_to_rest) {
    const Summary summary = Simulation(parse_scene(pressed_block(10, "0.45", "stiffness = 1.9e8\n"), "s.toml")).run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    const double ball = summary.obstacles.at(0).reading.force[1], support = summary.probes.at(0).force[1];
    EXPECT_NEAR(ball, -support, 1e-3 * support);
    Scene hasty = parse_scene(pressed_block(5, "0.45", ""), "s.toml");
    hasty.solver.duration = 0.1;
    const std::string failure = Simulation(hasty).run().failure;
    EXPECT_NE(failure.find("touch ball"), std::string::npos) << failure;
}

/// Hertz: the force for the radius a of what touches, 1.4, 2.8 and 5.7 cells. The limit is of stiff contact on fine
/// meshes: 5349.9 and 5348.4 N on 10 and 20 cells at four times the stiffness, 5346 N without end.
TEST(ContactScene, the_default_stiffness_is_hertzian) {
    for (const int cells : {5, 10, 20}) {
        const Summary summary = Simulation(parse_scene(pressed_block(cells, "0.3", ""), "s.toml")).run();
        EXPECT_TRUE(summary.converged) << summary.failure;
        EXPECT_NEAR(-summary.obstacles.at(0).reading.force[1], 5346, 0.02 * 5346) << cells;
    }
}

/// A fall of 40 m onto half a metre: each step is longer than that is thick.
TEST(ContactScene, a_long_fall_does_not_pass_a_thin_box) {
    Simulation simulation(parse_scene("[body]\ncells = [3, 3, 3]\ncell_size = 1\n[material]\nyoung_modulus = 1e4\n"
                                      "poisson_ratio = 0.25\ndensity = 1000\n[gravity]\nacceleration = [0, -9.81, 0]\n"
                                      "[[obstacle]]\nbox = [[-5, -41, -5], [8, -40, 8]]\n[solver]\nduration = 3.2\n",
                                      "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_GT(28 * summary.time_step, 1);
    EXPECT_GT(summary.obstacles.at(0).reading.greatest_depth, 0);
    double mean = 0;
    for (const auto& u : simulation.displacements()) {
        mean += u[1] / static_cast<double>(simulation.node_count());
    }
    EXPECT_GT(mean, -44); // a rigid one's would pass 50
}

/// Friction's memory and the meter's sums are in the checkpoint.
TEST(ContactScene, a_restarted_run_ends_with_the_same_bits) {
    const Scene scene =
        parse_scene(kCube + kMetered +
                        "[gravity]\nacceleration = [2, -10, 0]\n[[obstacle]]\nfriction = 0.4\n"
                        "plane = {point = [0, -0.01, 0], normal = [0, 1, 0]}\n[[obstacle]]\nfriction = 0.2\n"
                        "box = [[0.5, -1, -1], [1.5, 1, 1]]\ntranslate = [-0.2, 0, 0]\nover = 0.5\n"
                        "[[obstacle]]\nbox = [[0, 0.402, 0], [0.2, 0.51, 0.3]]\nmass = 3\nfriction = 0.2\n"
                        "[solver]\nduration = 0.6\n",
                    "s.toml");
    const test::TemporaryDirectory directory;
    const std::string file = (directory.path() / "checkpoint").string();
    Simulation whole(scene), first(scene);
    const Summary expected = whole.run();
    first.step(whole.steps() / 2);
    first.write_checkpoint(file);
    Simulation rest = Simulation::restarted(scene, {}, file);
    const Summary summary = rest.run();
    EXPECT_EQ(rest.steps(), whole.steps());
    EXPECT_EQ(rest.displacements(), whole.displacements());
    EXPECT_EQ(rest.velocities(), whole.velocities());
    EXPECT_GT(summary.energies.effects.at(0).dissipated, 0);
    EXPECT_EQ(summary.energies.effects.at(0).dissipated, expected.energies.effects.at(0).dissipated);
    EXPECT_EQ(rest.obstacle_poses().at(2).position, whole.obstacle_poses().at(2).position);
    EXPECT_EQ(rest.obstacle_poses().at(2).rotation, whole.obstacle_poses().at(2).rotation);
    EXPECT_NE(summary.balance.value().free_obstacles, 0);
    EXPECT_EQ(summary.balance.value().free_obstacles, expected.balance.value().free_obstacles);
    EXPECT_EQ(summary.balance.value().gravity, expected.balance.value().gravity);
    EXPECT_EQ(summary.balance.value().obstacles, expected.balance.value().obstacles);
    EXPECT_EQ(summary.balance.value().imbalance(), expected.balance.value().imbalance());
}

/// A wall that comes closer at a constant speed, too soft and thin for that: warned of.
TEST(ContactScene, a_deep_impact_is_warned_of) {
    Simulation simulation(parse_scene(kCube + "[[obstacle]]\nbox = [[-0.3, -0.2, -0.3], [0.7, -0.1, 0.7]]\n"
                                              "velocity = [0, 40, 0]\nstiffness = 1e5\n[solver]\nduration = 0.01\n",
                                      "s.toml"));
    const Summary summary = simulation.run();
    ASSERT_EQ(summary.warnings.size(), 1u);
    EXPECT_NE(summary.warnings[0].find("deep in obstacle_0"), std::string::npos) << summary.warnings[0];
}

/// The first part of an example.
Summary run_example(const std::string& name, double duration) {
    Scene scene = load_scene(test::example(name));
    scene.solver.duration = duration;
    return Simulation(std::move(scene)).run();
}

TEST(ContactExamples, a_ball_rolls) {
    Scene scene = load_scene(test::example("rolling_ball"));
    scene.solver.duration = 0.3;
    scene.output.energy_balance = false;
    Simulation simulation(std::move(scene));
    const Summary summary = simulation.run();
    EXPECT_EQ(summary.failure, "");
    // The way of the centre along the incline: a rigid ball that rolls goes 5/7 g sin(30 degrees) t^2/2; one that only
    // slides, at a friction of 0.8 > tan(30 degrees), would not move at all. And it has turned by way over radius.
    double along = 0, turned = 0, square = 0;
    const std::vector<std::array<double, 3>> u = simulation.displacements(), v = simulation.velocities();
    std::array<double, 3> mean = {0, 0, 0};
    for (const auto& w : v) {
        for (std::size_t a = 0; a < 3; ++a) {
            mean[a] += w[a] / static_cast<double>(v.size());
        }
    }
    for (const auto& way : u) {
        along += (0.8660254 * way[0] - 0.5 * way[1]) / static_cast<double>(u.size());
    }
    for (const auto& w : v) {
        turned += std::hypot(w[0] - mean[0], w[1] - mean[1]);
        square += 1;
    }
    const double rigid = 5.0 / 7 * 9.81 * 0.5 * 0.3 * 0.3 / 2;
    EXPECT_NEAR(along, rigid, 0.2 * rigid);
    EXPECT_GT(turned / square, 0.3 * std::hypot(mean[0], mean[1]));
}

TEST(ContactExamples, a_ball_is_thrown_at_a_cube) {
    const Summary summary = run_example("thrown_ball", 0.6);
    EXPECT_EQ(summary.failure, "");
    EXPECT_LT(summary.balance.value().relative_imbalance(), 1e-2);
    EXPECT_GT(summary.obstacles.at(1).reading.impulse[0], 1);
    EXPECT_LT(summary.obstacles.at(1).pose.value().velocity[0], 4);
    EXPECT_TRUE(summary.warnings.empty());
}

TEST(ContactExamples, a_cube_drops) {
    const Summary summary = run_example("dropped_cube", 0.5);
    EXPECT_EQ(summary.failure, "");
    EXPECT_LT(summary.balance.value().relative_imbalance(), 1e-2); // see the moving box
    EXPECT_GT(summary.obstacles.at(1).reading.greatest_depth, 0);
    EXPECT_TRUE(summary.warnings.empty());
}

/// A cube between a ball and a lid that comes down: at rest where steps in time bring it.
TEST(StaticObstacles, end_where_steps_in_time_come_to_rest) {
    const std::string text = kCube +
                             "[[fix]]\nwhere = \"y-max\"\naxes = \"xz\"\n[gravity]\nacceleration = [0, -9, 0]\n"
                             "[[obstacle]]\nname = \"ball\"\nsphere = {center = [0.2, -0.3, 0.2], radius = 0.3}\n"
                             "[[obstacle]]\nname = \"lid\"\nplane = {point = [0, 0.4, 0], normal = [0, -1, 0]}\n"
                             "translate = [0, -0.05, 0]\nover = 0.2\n[damping]\nmass = 30\n";
    const double weight = 0.064 * 1000 * 9;
    std::map<std::string, double> ball;
    for (const std::string method : {"static", "backward-euler", "leapfrog"}) {
        const std::string solver = method == "static" ? "" : "duration = 2\n";
        Simulation simulation(parse_scene(text + "[solver]\nmethod = \"" + method + "\"\n" + solver, "s.toml"));
        const Summary summary = simulation.run();
        EXPECT_EQ(summary.failure, "") << method;
        EXPECT_TRUE(summary.converged) << method;
        ASSERT_EQ(summary.obstacles.size(), 2u);
        const ObstacleReading &below = summary.obstacles[0].reading, &above = summary.obstacles[1].reading;
        EXPECT_NEAR(below.force[1] + above.force[1], weight, 3e-3 * below.force[1]) << method;
        EXPECT_LT(above.force[1], -weight / 2) << method;
        EXPECT_NEAR(simulation.obstacle_poses()[1].position[1], 0.35, 1e-12);
        ball[method] = below.force[1];
        for (const EffectEnergy& effect : summary.energies.effects) {
            EXPECT_EQ(effect.name, "contact");
            EXPECT_GT(effect.stored, 0);
        }
        EXPECT_EQ(summary.energies.effects.size(), 1u) << method;
    }
    EXPECT_NEAR(ball["backward-euler"], ball["static"], 1e-4 * ball["static"]);
    EXPECT_NEAR(ball["leapfrog"], ball["static"], 1e-4 * ball["static"]);
}

/// Stopped at each step and gone on with: the same bits.
TEST(StaticObstacles, implicit_steps_go_on_from_a_checkpoint) {
    const test::TemporaryDirectory directory;
    const std::string file = directory.path() / "checkpoint";
    const Scene scene =
        parse_scene(kCube + "[gravity]\nacceleration = [0, -9, 0]\n"
                            "[[obstacle]]\nplane = {point = [0, -0.01, 0], normal = [0, 1, 0]}\n"
                            "[solver]\nmethod = \"backward-euler\"\nduration = 0.12\ntime_step = 0.02\n",
                    "s.toml");
    Simulation whole(scene);
    whole.run();
    Simulation parts(scene);
    RunCallbacks callbacks;
    callbacks.checkpoint = [&] {
        parts.write_checkpoint(file);
        return false;
    };
    Summary end = parts.run(callbacks);
    int stops = 0;
    for (; end.interrupted; end = parts.run(callbacks), ++stops) {
        parts = Simulation::restarted(Scene(scene), {}, file);
    }
    EXPECT_GT(stops, 3);
    EXPECT_EQ(parts.displacements(), whole.displacements());
    EXPECT_GT(end.obstacles.at(0).reading.nodes, 0u);
    EXPECT_EQ(end.obstacles[0].reading.force, whole.obstacles()[0].reading.force);
}

} // namespace
} // namespace hybmss
