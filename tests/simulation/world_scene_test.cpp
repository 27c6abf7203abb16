// Scenes of several bodies: how they are read, and that each body moves as it should.

#include "hybmss/simulation/world_simulation.hpp"
#include "simulation/results/results.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace hybmss {
namespace {

using Vector3 = std::array<double, 3>;

const std::string kMaterial = "young_modulus = 2e4\npoisson_ratio = 0.3\ndensity = 1000\n";

std::string body(const std::string& name, const std::string& cells, const std::string& more = "") {
    return "[[body]]\nname = \"" + name + "\"\ncells = " + cells + "\ncell_size = 0.01\n" + more;
}
std::string solver(double duration, const std::string& more = "") {
    return "[solver]\nduration = " + std::to_string(duration) + "\n" + more;
}
WorldScene world_of(const std::string& text) {
    return std::get<WorldScene>(parse_any_scene(text, "w.toml"));
}
SimulationOptions threads(int count, Precision precision = Precision::float64) {
    SimulationOptions options;
    options.precision = precision;
    options.plan.threads = count;
    return options;
}
std::string refusal(const std::string& text) {
    try {
        WorldSimulation(world_of(text), threads(1)).step(1);
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

// What one body may have of its own; and the same for a body alone.
const std::string kActs = R"(
[[fix]]
BODYwhere = "x-min"
[[move]]
BODYwhere = "x-max"
translate = [0.001, 0, 0]
over = 0.02
[[load]]
BODYwhere = "y-max"
force = [[0, 0, 0, 0], [0.02, 0, -0.1, 0]]
[[start]]
BODYwhere = {box = [[0.011, 0, 0], [0.039, 1, 1]]}
velocity = [0, 0.1, 0]
[[cut]]
BODYbox = [[0.02, 0.01, -1], [0.03, 1, 1]]
at = 0.01
[[probe]]
BODYname = "p"
where = "x-max"
)";
std::string acts(const std::string& name) {
    std::string text = kActs;
    for (std::size_t at; (at = text.find("BODY")) != std::string::npos;) {
        text.replace(at, 4, name.empty() ? "" : "body = \"" + name + "\"\n");
    }
    return text;
}
const std::string kShared = "[[obstacle]]\nname = \"floor\"\nplane = {point = [0, -0.001, 0], normal = [0, 1, 0]}\n"
                            "[gravity]\nacceleration = [0, -9.81, 0]\n[damping]\nmass = 2\n";

TEST(WorldScenes, a_body_has_what_names_it_and_what_all_share) {
    const std::string one = "[body]\ncells = [5, 2, 2]\ncell_size = 0.01\n[material]\n" + kMaterial + kShared;
    const WorldScene world = world_of(body("a", "[5, 2, 2]") +
                                      body("b", "[5, 2, 2]",
                                           "[body.material]\nyoung_modulus = 7e4\n"
                                           "poisson_ratio = 0.4\ndensity = 900\n") +
                                      "[material]\n" + kMaterial + kShared + solver(0.05) + acts("a"));
    ASSERT_EQ(world.bodies.size(), 2u);
    EXPECT_EQ(world.bodies[0].name, "a");
    EXPECT_EQ(world.bodies[0].scene, parse_scene(one + solver(0.05) + acts(""), "w.toml"));
    Scene other = parse_scene(one + solver(0.05), "w.toml");
    other.material.young_modulus = 7e4;
    other.material.poisson_ratio = 0.4;
    other.material.density = 900;
    EXPECT_EQ(world.bodies[1].scene, other);
    EXPECT_TRUE(std::holds_alternative<Scene>(parse_any_scene(one + solver(0.05), "w.toml")));
}

TEST(WorldScenes, all_that_a_world_has_is_written_and_read_again) {
    const WorldScene world =
        world_of(body("a", "[5, 2, 2]") + body("b", "[3, 3, 3]", "place = {translate = [1, 0, 0]}\n") + "[material]\n" +
                 kMaterial + kShared + solver(0.05) + acts("a") +
                 "[[contact]]\nbetween = [\"a\", \"b\"]\nself = true\nfriction = 0.25\n" +
                 "[[attach]]\nfrom = {body = \"a\", where = \"x-min\"}\nto = {point = [1, 2, 3]}\nstiffness = 7\n" +
                 "[[attach]]\nfrom = {body = \"b\", where = {node = 3}}\nto = {}\n");
    EXPECT_EQ(std::get<WorldScene>(parse_any_scene(to_toml(world), "w.toml")), world) << to_toml(world);
}

TEST(WorldScenes, one_body_moves_as_it_does_alone_to_the_bit) {
    for (const char* method : {"", "method = \"leapfrog\"\n"}) {
        for (const Precision precision : {Precision::float32, Precision::float64}) {
            Simulation alone(parse_scene("[body]\ncells = [5, 2, 2]\ncell_size = 0.01\n[material]\n" + kMaterial +
                                             kShared + solver(0.05, method) + acts(""),
                                         "w.toml"),
                             threads(1, precision));
            WorldSimulation world(world_of(body("a", "[5, 2, 2]") + "[material]\n" + kMaterial + kShared +
                                           solver(0.05, method) + acts("")),
                                  threads(1, precision));
            const Summary of_one = alone.run();
            const WorldSummary of_all = world.run();
            EXPECT_EQ(of_all.failure, "");
            EXPECT_EQ(of_all.steps, of_one.steps);
            EXPECT_EQ(of_all.bodies[0].removed_cells, of_one.removed_cells);
            EXPECT_GT(of_one.removed_cells, 0u);
            EXPECT_EQ(world.body(0).displacements(), alone.displacements());
            EXPECT_EQ(world.body(0).velocities(), alone.velocities());
            EXPECT_EQ(of_all.bodies[0].probes[0].force, of_one.probes[0].force);
            EXPECT_EQ(of_all.bodies[0].obstacles[0].reading.impulse, of_one.obstacles[0].reading.impulse);
        }
    }
}

TEST(WorldScenes, bodies_that_do_not_touch_move_as_alone_and_all_threads_agree) {
    const std::string place = "place = {translate = [0, 0, 0.5]}\n";
    const std::string text = body("a", "[5, 2, 2]") + body("b", "[3, 3, 3]", place) + "[material]\n" + kMaterial +
                             kShared + solver(0.04) + acts("a") +
                             "[[contact]]\nbetween = [\"a\", \"b\"]\nself = true\n";
    WorldSimulation first(world_of(text), threads(1)), second(world_of(text), threads(2));
    first.step(400);
    for (int s = 0; s < 400; ++s) {
        second.step();
    }
    Scene alone_a = world_of(text).bodies[0].scene;
    alone_a.solver.time_step = first.time_step();
    Simulation alone(alone_a, threads(1));
    alone.step(400);
    EXPECT_EQ(first.body(0).displacements(), alone.displacements());
    for (std::size_t b = 0; b < 2; ++b) {
        EXPECT_EQ(first.body(b).displacements(), second.body(b).displacements());
    }
    EXPECT_NEAR(first.body(1).rest_positions()[0][2], 0.5, 1e-15);
}

TEST(WorldScenes, the_shortest_step_is_everybodys) {
    const WorldSimulation world(
        world_of(body("a", "[2, 2, 2]") +
                 body("b", "[2, 2, 2]", "[body.material]\nyoung_modulus = 2e6\npoisson_ratio = 0.3\ndensity = 1000\n") +
                 "[material]\n" + kMaterial + solver(1)),
        threads(1));
    EXPECT_EQ(world.body(0).time_step(), world.body(1).time_step());
    EXPECT_EQ(world.time_step(), 0.7 * world.body(1).critical_time_step());
    EXPECT_EQ(world.critical_time_step(), world.body(1).critical_time_step());
}

/// By a quarter turn about z: (x, y) -> (-y, x).
Vector3 quarter(const Vector3& v) {
    return {-v[1], v[0], v[2]};
}

TEST(WorldScenes, a_turned_body_moves_as_one_that_all_else_is_turned_for) {
    const auto scene = [&](const std::string& place, const std::string& gravity, const std::string& way) {
        return parse_scene("[body]\ncells = [4, 3, 2]\ncell_size = 0.01\n" + place + "[material]\n" + kMaterial +
                               "[gravity]\nacceleration = " + gravity +
                               "\n[[fix]]\nwhere = \"x-min\"\n[[move]]\nwhere = \"x-max\"\ntranslate = " + way +
                               "\nover = 0.01\n[[probe]]\nname = \"p\"\nwhere = \"x-max\"\n" + solver(0.05),
                           "w.toml");
    };
    Simulation straight(scene("", "[3, -9, 1]", "[0.002, 0.001, 0]"), threads(1));
    Simulation turned(scene("place = {rotate = {axis = \"z\", degrees = 90}}\n", "[9, 3, 1]", "[-0.001, 0.002, 0]"),
                      threads(1));
    EXPECT_EQ(turned.scene().body.place.rotate->degrees, 90);
    EXPECT_LT(turned.energies().springs, 1e-25);
    for (Simulation* body : {&straight, &turned}) {
        body->step(200);
    }
    const std::vector<Vector3> u = straight.displacements(), v = turned.displacements();
    const std::span<const Vector3> rest = straight.rest_positions();
    const Vector3 middle = {0.02, 0.015, 0.01};
    double greatest = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
        Vector3 arm{}, there{};
        for (std::size_t a = 0; a < 3; ++a) {
            arm[a] = rest[n][a] + u[n][a] - middle[a];
            there[a] = rest[n][a] + v[n][a] - middle[a];
        }
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(quarter(arm)[a], there[a], 1e-13);
            greatest = std::max(greatest, std::abs(u[n][a]));
        }
    }
    EXPECT_GT(greatest, 1e-3);
    const ProbeReading a = straight.probes()[0], b = turned.probes()[0];
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(quarter(a.force)[axis], b.force[axis], 1e-9);
        EXPECT_NEAR(quarter(a.torque)[axis], b.torque[axis], 1e-11);
        EXPECT_NEAR(quarter(a.mean_displacement)[axis], b.mean_displacement[axis], 1e-13);
    }
    EXPECT_NEAR(a.max_displacement, b.max_displacement, 1e-13);
}

TEST(WorldScenes, a_place_is_written_and_read_again_and_static_scenes_are_not_turned) {
    const std::string text = "[body]\ncells = [4, 3, 2]\ncell_size = 0.01\n"
                             "place = {translate = [1, 2, 3], rotate = {axis = \"y\", degrees = -30}}\n[material]\n" +
                             kMaterial;
    const Scene scene = parse_scene(text + solver(1), "w.toml");
    EXPECT_EQ(scene.body.origin, (Vector3{1, 2, 3}));
    EXPECT_EQ(parse_scene(to_toml(scene), "w.toml"), scene);
    Scene still = scene;
    still.solver.method = SolverMethod::static_equilibrium;
    EXPECT_THROW(Simulation(still, threads(1)), SceneError);
    still.body.place.rotate.reset();
    EXPECT_NO_THROW(Simulation(still, threads(1)));
}

TEST(WorldScenes, a_stack_comes_to_rest_and_bears_its_weight) {
    const std::string text = body("bed", "[8, 3, 8]") +
                             body("cube", "[4, 4, 4]",
                                  "place = {translate = [0.02, 0.031, 0.02], "
                                  "rotate = {axis = \"y\", degrees = 30}}\n") +
                             "[material]\n" + kMaterial +
                             "[[contact]]\nbetween = [\"bed\", \"cube\"]\nfriction = 0.5\n"
                             "[[fix]]\nbody = \"bed\"\nwhere = \"y-min\"\n"
                             "[gravity]\nacceleration = [0, -9.81, 0]\n[damping]\nmass = 15\n" +
                             solver(4, "tolerance = 1e-2\n");
    WorldSimulation world(world_of(text), threads(2));
    const WorldSummary summary = world.run();
    EXPECT_EQ(summary.failure, "");
    EXPECT_TRUE(summary.converged);
    EXPECT_LT(summary.time, 4);
    const double weight = 0.064 * 9.81;
    EXPECT_NEAR(summary.contacts[0].reading.force[1], -weight, 1e-2 * weight);
    EXPECT_EQ(summary.contacts[0].first, "bed");
    EXPECT_GT(summary.bodies[1].settlement.residual, 0);
}

TEST(WorldScenes, nodes_are_welded_to_a_turned_body_and_hang_by_springs) {
    // A bar hangs on a block that is upside down and fixed; the block's own x-min is up then.
    const std::string text =
        body("block", "[4, 4, 4]", "place = {translate = [0, 0.04, 0], rotate = {axis = \"z\", degrees = 180}}\n") +
        body("bar", "[2, 4, 2]", "place = {translate = [0.013, 0, 0.013]}\n") +
        body("ball", "[1, 1, 1]", "place = {translate = [0.1, 0, 0]}\n") + "[material]\n" + kMaterial +
        "[[fix]]\nbody = \"block\"\nwhere = {of = {box = [[-1, -1, -1], [1, 1, 1]]}, without = [{node = 0}]}\n"
        "[[attach]]\nfrom = {body = \"bar\", where = \"y-max\"}\nto = {body = \"block\"}\n"
        "[[attach]]\nfrom = {body = \"ball\", where = \"y-max\"}\nto = {}\nstiffness = 100\n"
        "[gravity]\nacceleration = [0, -9.81, 0]\n[damping]\nmass = 20\n" +
        solver(2);
    WorldSimulation world(world_of(text), threads(1));
    const WorldSummary summary = world.run();
    EXPECT_EQ(summary.failure, "");
    ASSERT_EQ(summary.attachments.size(), 2u);
    EXPECT_EQ(summary.attachments[0].ties, 9u);
    EXPECT_NEAR(summary.attachments[0].force[1], 0.016 * 9.81, 1e-6);
    EXPECT_EQ(summary.attachments[1].to, "");
    EXPECT_NEAR(summary.attachments[1].force[1], 0.001 * 9.81, 1e-8);
    const std::vector<Vector3> ball = world.body(2).displacements();
    EXPECT_NEAR((ball[2][1] + ball[3][1] + ball[6][1] + ball[7][1]) / 4, -0.001 * 9.81 / 100, 1e-8);
    const std::vector<Vector3> bar = world.body(1).displacements();
    EXPECT_NEAR(bar[12][1], 0, 1e-9); // welded to nodes that do not move
}

TEST(WorldScenes, nothing_touches_cells_that_are_cut_away) {
    const std::string text = body("bed", "[4, 2, 4]") +
                             body("cube", "[2, 2, 2]", "place = {translate = [0.01, 0.02, 0.01]}\n") + "[material]\n" +
                             kMaterial +
                             "[[contact]]\nbetween = [\"bed\", \"cube\"]\n"
                             "[[fix]]\nbody = \"bed\"\nwhere = {box = [[-1, -1, -1], [1, 0.011, 1]]}\n"
                             "[[cut]]\nbody = \"bed\"\nbox = [[0, 0, 0], [1, 1, 1]]\nat = 0.05\n"
                             "[gravity]\nacceleration = [0, -9.81, 0]\n" +
                             solver(0.15);
    WorldSimulation world(world_of(text), threads(1));
    const WorldSummary summary = world.run();
    EXPECT_EQ(summary.bodies[0].removed_cells, 32u);
    EXPECT_LT(world.body(1).displacements()[0][1], -0.03);
}

/// A ball between two cubes, named by no body: one motion, which takes what both get; written body by body it is the
/// same still.
TEST(WorldScenes, a_free_obstacle_is_one_for_all_its_bodies) {
    const WorldScene scene =
        world_of(body("a", "[3, 3, 3]") + body("b", "[3, 3, 3]", "place = {translate = [0.06, 0, 0]}\n") +
                 "[material]\n" + kMaterial + solver(0.1) +
                 "[[obstacle]]\nbody = \"a\"\nplane = {point = [0, -1, 0], normal = [0, 1, 0]}\n"
                 "[[obstacle]]\nname = \"ball\"\nsphere = {center = [0.045, 0.015, 0.015], radius = 0.0142}\n"
                 "mass = 0.01\nvelocity = [1, 0, 0]\n");
    const WorldScene again = world_of(to_toml(scene));
    for (const WorldScene& one : {scene, again}) {
        WorldSimulation world(one, threads(2));
        world.step(static_cast<long>(0.1 / world.time_step()));
        const RigidPose ball = world.body(0).obstacle_poses().at(1);
        EXPECT_EQ(ball.position, world.body(1).obstacle_poses().at(0).position);
        double momentum = 0.01 * ball.velocity[0];
        for (const std::size_t b : {0u, 1u}) {
            EXPECT_GT(std::abs(world.body(b).obstacles().at(1 - b).reading.impulse[0]), 1e-3);
            const std::vector<Vector3> v = world.body(b).velocities();
            for (std::size_t n = 0; n < v.size(); ++n) {
                momentum += world.body(b).masses()[n] * v[n][0];
            }
        }
        EXPECT_NEAR(momentum, 0.01, 1e-12);
    }
}

TEST(WorldScenes, one_that_diverges_says_which_body_did) {
    std::string text = body("a", "[2, 2, 2]") + body("b", "[3, 1, 1]", "place = {translate = [1, 0, 0]}\n") +
                       "[material]\n" + kMaterial +
                       "[[start]]\nbody = \"b\"\nwhere = \"x-max\"\nvelocity = [4e3, 0, 0]\n" + solver(1);
    WorldSimulation world(world_of(text), threads(1));
    const WorldSummary summary = world.run();
    EXPECT_EQ(summary.failure.find("body b diverged by step "), 0u) << summary.failure;
    for (const Vector3& u : world.body(1).displacements()) {
        EXPECT_TRUE(std::isfinite(u[0]));
    }
    EXPECT_THROW(world.step(1), std::runtime_error);
}

TEST(WorldScenes, what_is_wrong_is_told_in_its_line) {
    const std::string two = body("a", "[2, 2, 2]") + body("b", "[2, 2, 2]") + "[material]\n" + kMaterial + solver(1);
    const auto told = [&](const std::string& more) { return refusal(two + more); };
    EXPECT_EQ(told(""), "");
    EXPECT_EQ(refusal(body("a", "[2, 2, 2]") + body("a", "[2, 2, 2]") + "[material]\n" + kMaterial + solver(1)),
              "w.toml:6:8: body.name = \"a\": another [[body]] has this name; each must have its own");
    EXPECT_EQ(refusal("[[body]]\ncells = [1, 1, 1]\ncell_size = 1\n[material]\n" + kMaterial + solver(1)),
              "w.toml:1:1: body.name: missing; it must be letters, digits, _ and -; different for each body");
    EXPECT_EQ(told("[[fix]]\nwhere = \"x-min\"\n"), "w.toml:15:1: fix.body: missing; it must name one of a and b");
    EXPECT_EQ(told("[[fix]]\nbody = \"c\"\nwhere = \"x-min\"\n"),
              "w.toml:16:8: fix.body = \"c\": no [[body]] has this name; there are a and b");
    EXPECT_EQ(told("[[fix]]\nbody = \"b\"\nwhere = \"q\"\n").find("w.toml:17:9: fix.where = \"q\": it must be"), 0u);
    EXPECT_EQ(told("[[fix]]\nbody = \"b\"\nwhere = {node = 27}\n").find("w.toml:17:9: fix.where = {node = 27}: "), 0u);
    EXPECT_EQ(told("[[contact]]\nbetween = [\"a\"]\n"),
              "w.toml:16:11: contact.between = [\"a\"]: a body alone touches nothing, unless self = true; two or more "
              "must be named");
    EXPECT_EQ(told("[[contact]]\nbetween = [\"a\", \"c\"]\n"),
              "w.toml:16:11: contact.between = [\"a\", \"c\"]: no [[body]] is named c; there are a and b");
    EXPECT_EQ(told("[[contact]]\nbetween = [\"a\", \"b\"]\n[[contact]]\nbetween = [\"b\", \"a\"]\n"),
              "w.toml:18:11: contact.between = [\"b\", \"a\"]: another [[contact]] tells already how b and a touch");
    EXPECT_EQ(told("[[attach]]\nfrom = {body = \"a\", where = \"x-min\"}\nto = {body = \"a\"}\n"),
              "w.toml:17:14: attach.to.body = \"a\": it must be another body than that of from");
    EXPECT_NE(told("[[attach]]\nfrom = {body = \"a\", where = {sphere = {center = [9, 9, 9], radius = 0.1}}}\n"
                   "to = {}\n")
                  .find(": no node of a lies in it"),
              std::string::npos);
    EXPECT_EQ(refusal(body("a", "[2, 2, 2]") + body("b", "[2, 2, 2]", "place = {translate = [0.005, 0, 0]}\n") +
                      "[material]\n" + kMaterial + solver(1) +
                      "[[attach]]\nfrom = {body = \"a\", where = \"x-min\"}\nto = {body = \"b\"}\n"),
              "w.toml:18:14: attach.to.body = \"b\": node 0 of a begins at (0, 0, 0) m, where b has no cell");
    const std::string ball = "[[obstacle]]\nsphere = {center = [0, 9, 0], radius = 2}\nmass = 1\n";
    EXPECT_EQ(told(ball), "w.toml:15:1: obstacle.name: missing; a free obstacle that several bodies touch has one");
    EXPECT_EQ(told(ball + "name = \"ball\"\n"), "");
    EXPECT_NE(
        told(ball + "name = \"ball\"\nbody = \"a\"\n" + ball + "name = \"ball\"\nbody = \"b\"\ninertia = [1, 1, 1]\n")
            .find("free obstacles of the same name are one: ball must have one shape"),
        std::string::npos);
    EXPECT_NE(refusal(two + "method = \"leapfrog\"\n" + ball + "name = \"ball\"\n")
                  .find("a free obstacle that several bodies touch moves with \"symplectic-euler\" only"),
              std::string::npos);
    EXPECT_EQ(told("[output]\nenergy_balance = true\n").find("w.toml:16:18: output.energy_balance = true: "), 0u);
    EXPECT_EQ(
        refusal(body("a", "[2, 2, 2]") + body("b", "[2, 2, 2]") + "[material]\n" + kMaterial +
                "[solver]\nmethod = \"static\"\n"),
        "w.toml:14:10: solver.method = \"static\": scenes of [[body]] tables move by symplectic-euler or leapfrog");
    EXPECT_THROW(parse_scene(two, "w.toml"), SceneError);
    EXPECT_THROW(WorldSimulation(WorldScene{}), SceneError);
    WorldScene by_hand = world_of(two);
    by_hand.contacts.push_back({.between = {"a", "b"}, .friction = -1});
    EXPECT_THROW(WorldSimulation(by_hand, threads(1)), SceneError);
}

TEST(WorldScenes, each_body_has_a_directory_of_results) {
    const test::TemporaryDirectory directory;
    const std::string text = body("a", "[2, 2, 2]") + body("b", "[2, 2, 2]", "place = {translate = [0, 0.03, 0]}\n") +
                             "[material]\n" + kMaterial + "[[contact]]\nbetween = [\"a\", \"b\"]\n" + solver(0.02) +
                             "[output]\nevery = 0.01\n[[probe]]\nbody = \"b\"\nname = \"p\"\nwhere = \"y-max\"\n";
    WorldSimulation world(world_of(text), threads(1));
    {
        WorldResults results(directory.path() / "out", world);
        RunCallbacks callbacks;
        callbacks.output = [&] { results.record(); };
        results.finish(world.run(callbacks));
    }
    const nlohmann::json summary = nlohmann::json::parse(test::read_text(directory.path() / "out/summary.json"));
    EXPECT_EQ(summary["contacts"][0]["between"], (std::vector<std::string>{"a", "b"}));
    const nlohmann::json b = nlohmann::json::parse(test::read_text(directory.path() / "out/b/summary.json"));
    EXPECT_TRUE(b["probes"].contains("p"));
    const std::string list = test::read_text(directory.path() / "out/bodies.pvd");
    for (const char* file : {"part=\"0\" file=\"a/body_0002.vtu\"", "part=\"1\" file=\"b/body_0002.vtu\""}) {
        EXPECT_NE(list.find(file), std::string::npos) << list;
    }
    EXPECT_TRUE(std::filesystem::exists(directory.path() / "out/b/body_0002.vtu"));
}

} // namespace
} // namespace hybmss
