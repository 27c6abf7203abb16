/// Velocities at the start, and loads and gravity that change in time.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"

#include <cmath>

namespace hybmss {
namespace {

using Vector3 = std::array<double, 3>;

/// Without [solver]; of 0.024 m^3, its centre at (0.1, 0.15, 0.2).
const std::string kBlock = "[body]\ncells = [2, 3, 4]\ncell_size = 0.1\n"
                           "[material]\nyoung_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n";
const std::string kInTime = "[solver]\nduration = 0.5\ntime_step = 0.001\n";
const std::string kImplicit = "[solver]\nmethod = \"backward-euler\"\nduration = 0.5\ntime_step = 0.02\n";

Scene by_leapfrog(const std::string& text) {
    Scene scene = parse_scene(text, "s.toml");
    scene.solver.method = SolverMethod::leapfrog;
    return scene;
}

std::string refusal(const std::string& text) {
    try {
        Simulation simulation(parse_scene(text, "s.toml"));
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

// -- [[start]]

/// kg m/s and kg m^2/s about a point, by the masses of a block's nodes.
std::pair<Vector3, Vector3> momenta(const Simulation& simulation, const Vector3& about) {
    const std::vector<Vector3> u = simulation.displacements(), v = simulation.velocities();
    const auto rest = simulation.rest_positions();
    std::vector<double> mass(rest.size(), 0);
    for (const auto& cell : simulation.cell_nodes()) {
        for (const std::uint32_t n : cell) {
            mass[n] += 1.0 / 8; // a cell has 1 kg
        }
    }
    Vector3 linear{}, angular{};
    for (std::size_t n = 0; n < rest.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t i = (a + 1) % 3, j = (a + 2) % 3;
            linear[a] += mass[n] * v[n][a];
            angular[a] +=
                mass[n] * ((rest[n][i] + u[n][i] - about[i]) * v[n][j] - (rest[n][j] + u[n][j] - about[j]) * v[n][i]);
        }
    }
    return {linear, angular};
}

TEST(Start, gives_the_whole_body_its_momenta_and_it_keeps_them) {
    for (const std::string& solver : {kInTime, kImplicit}) {
        Simulation simulation(parse_scene(
            kBlock + "[[start]]\nvelocity = [1, -2, 0.5]\nangular_velocity = [0, 0, 3]\n" + solver, "s.toml"));
        const auto [linear, angular] = momenta(simulation, {0.1, 0.15, 0.2});
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(linear[a], 24 * (Vector3{1, -2, 0.5})[a], 1e-12);
        }
        // A node in the plane through the axis moves at right angles to it.
        const std::vector<Vector3> v = simulation.velocities();
        EXPECT_NEAR(v[0][0], 1 + 3 * 0.15, 1e-14);
        EXPECT_NEAR(v[0][1], -2 - 3 * 0.1, 1e-14);
        EXPECT_NEAR(v[0][2], 0.5, 1e-14);
        EXPECT_GT(angular[2], 0.5);
        const auto [linear_at_0, about_0] = momenta(simulation, {0, 0, 0});
        simulation.step(20);
        const auto [linear_later, later] = momenta(simulation, {0, 0, 0});
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(linear_later[a], linear_at_0[a], 1e-9);
            if (solver == kInTime) { // backward Euler slows turns down
                EXPECT_NEAR(later[a], about_0[a], 1e-9);
            }
        }
    }
}

/// Of two layers the nodes at the bottom have half the mass: a turn about their mean place would have a momentum.
TEST(Start, turns_about_the_centre_of_mass) {
    Simulation simulation(parse_scene(
        kBlock + "[[start]]\nwhere = {box = [[0, 0, 0], [9, 9, 0.1]]}\nangular_velocity = [2, 0, 0]\n" + kInTime,
        "s.toml"));
    const auto [linear, angular] = momenta(simulation, {0, 0, 0});
    EXPECT_NEAR(linear[1], 0, 1e-13);
    EXPECT_GT(angular[0], 0.1);
}

TEST(Start, of_several_that_hold_a_node_the_last_one_counts) {
    Simulation simulation(parse_scene(kBlock +
                                          "[[start]]\nvelocity = [1, 0, 0]\n"
                                          "[[start]]\nwhere = \"z-max\"\nvelocity = [0, 2, 0]\n"
                                          "[[start]]\nwhere = {node = 59}\nangular_velocity = [9, 9, 9]\n" +
                                          kInTime,
                                      "s.toml"));
    const std::vector<Vector3> v = simulation.velocities();
    EXPECT_EQ(v[0], (Vector3{1, 0, 0}));
    EXPECT_EQ(v[58], (Vector3{0, 2, 0}));
    EXPECT_EQ(v[59], (Vector3{0, 0, 0})); // it is its own centre
}

TEST(Start, held_nodes_are_left_out_or_it_is_refused) {
    const std::string fixed = kBlock + "[[fix]]\nwhere = \"y-min\"\naxes = \"xy\"\n[[start]]\n";
    EXPECT_EQ(refusal(fixed + "velocity = [1, 0, 0]\n" + kInTime),
              "s.toml:12:12: start.velocity = [1, 0, 0]: node 0 would begin with 1 m/s along x, where line 9 holds it; "
              "{of = ..., without = [...]} leaves nodes out of where");
    EXPECT_EQ(refusal(fixed + "velocity = [0, 0, 1]\n" + kInTime), ""); // along a free axis
    EXPECT_EQ(refusal(fixed + "angular_velocity = [0, 1, 0]\n" + kInTime).find("s.toml:12:20: start.angular"), 0u);
    Simulation simulation(parse_scene(
        fixed + "where = {of = {box = [[0, 0, 0], [9, 9, 9]]}, without = [\"y-min\"]}\nvelocity = [1, 0, 0]\n" +
            kInTime,
        "s.toml"));
    EXPECT_EQ(simulation.velocities()[0], (Vector3{0, 0, 0}));
    EXPECT_EQ(simulation.velocities()[3], (Vector3{1, 0, 0}));
    EXPECT_NE(refusal(kBlock + "[[start]]\nvelocity = [1, 0, 0]\n[solver]\nmethod = \"static\"\n")
                  .find("solver.method = \"static\": a scene with [[start]] must be solved in time"),
              std::string::npos);
}

// -- Tables

TEST(TimeTable, is_linear_between_its_rows_and_held_outside) {
    const TimeTable table = {{1, 0, 0, 4}, {3, 2, -4, 4}, {4, 0, 0, 0}};
    const auto at = [&](double time) { return value_at({7, 7, 7}, table, time); };
    EXPECT_EQ(at(-5), (Vector3{0, 0, 4}));
    EXPECT_EQ(at(1.5), (Vector3{0.5, -1, 4}));
    EXPECT_EQ(at(3), (Vector3{2, -4, 4}));
    EXPECT_EQ(at(3.5), (Vector3{1, -2, 2}));
    EXPECT_EQ(at(HUGE_VAL), (Vector3{0, 0, 0}));
    EXPECT_EQ(value_at({7, 7, 7}, {}, 3), (Vector3{7, 7, 7}));
}

/// The load is on all nodes by the cells around them, as their masses: nothing is deformed.
TEST(TimeTable, a_free_body_gains_the_sum_of_the_steps) {
    const std::string tables = "[gravity]\nacceleration = [[0, 0, 0, 0], [0.2, 0, -10, 0], [0.3, 0, 0, 4]]\n"
                               "[[load]]\nwhere = {box = [[0, 0, 0], [9, 9, 9]]}\n"
                               "force = [[0.05, 24, 0, 0], [0.4, 0, 0, 240]]\n";
    for (const std::string& solver : {kInTime, kImplicit}) {
        Simulation simulation(parse_scene(kBlock + tables + solver, "s.toml"));
        const Scene& scene = simulation.scene();
        const double dt = simulation.time_step();
        const bool implicit = solver == kImplicit;
        Vector3 v{};
        for (int step = 0; step < 24; ++step) {
            simulation.step();
            const double time = (step + (implicit ? 1 : 0)) * dt; // the explicit step has the force at its beginning
            const Vector3 g = value_at({}, scene.gravity.acceleration_in_time, time),
                          f = value_at({}, scene.loads[0].force_in_time, time);
            for (std::size_t a = 0; a < 3; ++a) {
                v[a] += dt * (g[a] + f[a] / 24);
            }
        }
        for (const Vector3& nodal : simulation.velocities()) {
            for (std::size_t a = 0; a < 3; ++a) {
                EXPECT_NEAR(nodal[a], v[a], (implicit ? 1e-7 : 1e-13) * std::hypot(v[0], v[1], v[2])) << solver;
            }
        }
    }
}

std::string hung(const std::string& gravity, const std::string& force) {
    return kBlock + "[[fix]]\nwhere = \"y-max\"\n[gravity]\nacceleration = " + gravity +
           "\n[[load]]\nwhere = \"y-min\"\nforce = " + force + "\n";
}
const std::string kConstant = hung("[1, -10, 0]", "[30, 0, 60]");
const std::string kChanging =
    hung("[[0, 0, 0, 0], [0.2, 3, -10, 0], [0.3, 1, -10, 0]]", "[[0.1, 0, 0, 0], [0.4, 30, 0, 60]]");

TEST(TimeTable, of_one_value_is_that_value_to_the_bit) {
    const std::string rows = hung("[[0.1, 1, -10, 0], [0.2, 1, -10, 0]]", "[[0, 30, 0, 60]]");
    for (const std::string& solver : {kInTime, kImplicit}) {
        Simulation constant(parse_scene(kConstant + solver, "s.toml")), table(parse_scene(rows + solver, "s.toml"));
        const Summary one = constant.run(), other = table.run();
        EXPECT_EQ(table.displacements(), constant.displacements());
        EXPECT_EQ(table.velocities(), constant.velocities());
        EXPECT_EQ(other.energies.external, one.energies.external);
    }
}

TEST(TimeTable, static_scenes_take_the_end_value) {
    const std::string solver = "[solver]\nmethod = \"static\"\n";
    Simulation constant(parse_scene(kConstant + solver, "s.toml")), table(parse_scene(kChanging + solver, "s.toml"));
    EXPECT_TRUE(constant.run().converged && table.run().converged);
    EXPECT_EQ(table.displacements(), constant.displacements());
}

TEST(TimeTable, nothing_has_settled_before_its_end) {
    Scene scene = parse_scene(hung("[0, 0, 0]", "[[1, 0, 0, 0], [1.5, 0, 0, 20]]") +
                                  "[damping]\nmass = 20\n[solver]\nduration = 9\ntolerance = 1e-3\n",
                              "s.toml");
    const Summary settled = Simulation(scene).run();
    EXPECT_TRUE(settled.converged) << settled.failure;
    EXPECT_GE(settled.time, 1.5);
    scene.solver.duration = 1;
    EXPECT_NE(Simulation(scene).run().failure.find("a load has not come to its end"), std::string::npos);
}

/// A changing force has no potential: its work is that of every step.
TEST(TimeTable, works_are_in_the_energy_balance) {
    const std::string metered = "[output]\nenergy_balance = true\n";
    const std::string free_fall = kBlock + metered +
                                  "[gravity]\nacceleration = [[0, 0, 0, 0], [0.2, 5, -10, 0], [0.3, 0, 0, 0]]\n"
                                  "[[start]]\nvelocity = [1, 1, 0]\n" +
                                  kInTime;
    EXPECT_LT(Simulation(by_leapfrog(free_fall)).run().balance.value().relative_imbalance(), 1e-3);
    const EnergyBalance rigid = Simulation(parse_scene(free_fall, "s.toml")).run().balance.value();
    EXPECT_LT(rigid.relative_imbalance(), 1e-11);
    EXPECT_GT(rigid.gravity, 1);
    EXPECT_EQ(rigid.loads, 0);

    const std::string damped = metered + "[damping]\nmass = 3\n" + kInTime;
    const EnergyBalance constant = Simulation(parse_scene(kConstant + damped, "s.toml")).run().balance.value(),
                        changing = Simulation(parse_scene(kChanging + damped, "s.toml")).run().balance.value();
    EXPECT_GT(constant.gravity, 0.1);
    EXPECT_GT(changing.gravity, 0.1);
    EXPECT_GT(changing.loads, 0.1);
    // The step's own error in both.
    EXPECT_LT(changing.relative_imbalance(), 1e-5);
    EXPECT_LT(constant.relative_imbalance(), 1e-5);
}

/// Under g = -10 t/s a body falls by 10 t^3 / 6.
TEST(TimeTable, leapfrog_follows_it_by_the_second_order) {
    double errors[2];
    for (const int halving : {0, 1}) {
        Scene scene = by_leapfrog(kBlock + "[gravity]\nacceleration = [[0, 0, 0, 0], [1, 0, -10, 0]]\n" + kInTime);
        scene.solver.time_step = 0.001 / (1 << halving);
        Simulation simulation(scene);
        simulation.run();
        errors[halving] = simulation.displacements()[0][1] + 10 * std::pow(0.5, 3) / 6;
    }
    EXPECT_NEAR(errors[0] / errors[1], 4, 0.01);
}

/// Stopped at every check, and so in the midst of the tables.
TEST(TimeTable, goes_on_from_a_checkpoint_with_the_same_bits) {
    const test::TemporaryDirectory directory;
    const std::string file = directory.path() / "checkpoint";
    const std::string kStarted = kChanging + "[[start]]\nwhere = \"y-min\"\nvelocity = [0, 0, 0.3]\n",
                      kInSteps = kStarted + "[output]\nenergy_balance = true\n" + kInTime;
    for (const Scene& scene :
         {parse_scene(kInSteps, "s.toml"), by_leapfrog(kInSteps), parse_scene(kStarted + kImplicit, "s.toml")}) {
        Simulation whole(scene);
        const Summary all = whole.run();
        Simulation parts(scene);
        int stops = 0;
        RunCallbacks callbacks;
        callbacks.checkpoint = [&] {
            parts.write_checkpoint(file);
            ++stops;
            return false;
        };
        Summary end = parts.run(callbacks);
        for (; end.interrupted; end = parts.run(callbacks)) {
            parts = Simulation::restarted(scene, {}, file);
        }
        EXPECT_GT(stops, 5);
        EXPECT_EQ(parts.displacements(), whole.displacements());
        EXPECT_EQ(parts.velocities(), whole.velocities());
        if (all.balance) {
            EXPECT_EQ(end.balance.value().loads, all.balance->loads);
            EXPECT_EQ(end.balance.value().gravity, all.balance->gravity);
        }
    }
}

} // namespace
} // namespace hybmss
