/// Velocities at the start, loads and pressures of every kind, and how they change in time.

#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/world_simulation.hpp"
#include "simulation/run/boundary_conditions.hpp"
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

/// Stopped at every check, and so in the midst of the tables; goes on from a checkpoint in `file`.
Summary run_in_parts(Simulation& parts, const std::string& file) {
    int stops = 0;
    RunCallbacks callbacks;
    callbacks.checkpoint = [&] {
        parts.write_checkpoint(file);
        ++stops;
        return false;
    };
    Summary end = parts.run(callbacks);
    for (; end.interrupted; end = parts.run(callbacks)) {
        parts = Simulation::restarted(Scene(parts.scene()), {}, file);
    }
    EXPECT_GT(stops, 5);
    return end;
}

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
        const Summary end = run_in_parts(parts, file);
        EXPECT_EQ(parts.displacements(), whole.displacements());
        EXPECT_EQ(parts.velocities(), whole.velocities());
        if (all.balance) {
            EXPECT_EQ(end.balance.value().loads, all.balance->loads);
            EXPECT_EQ(end.balance.value().gravity, all.balance->gravity);
        }
    }
}

// -- Kinds of loads

/// The sums of a scene's nodal forces and of their moments about a point.
std::pair<Vector3, Vector3> sums(const Scene& scene, const Vector3& about, double time = 0) {
    const Lattice lattice = scene_lattice(scene);
    const std::vector<Vector3> rest = rest_positions(lattice, scene.body.origin);
    Vector3 sum{}, moment{};
    const std::vector<Vector3> forces = nodal_loads(scene, loaded_nodes(scene, lattice, rest), rest.size(), time);
    for (std::size_t n = 0; n < forces.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t i = (a + 1) % 3, j = (a + 2) % 3;
            sum[a] += forces[n][a];
            moment[a] += (rest[n][i] - about[i]) * forces[n][j] - (rest[n][j] - about[j]) * forces[n][i];
        }
    }
    return {sum, moment};
}
void expect_near(const Vector3& a, const Vector3& b, double tolerance) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(a[axis], b[axis], tolerance) << axis;
    }
}

/// Whatever the region, and about every point: its forces have no sum.
TEST(Moment, is_what_its_forces_add_up_to) {
    for (const std::string where :
         {"\"y-max\"", "{box = [[0, 0, 0], [0.1, 0.1, 0.4]]}", "{sphere = {center = [0, 0, 0], radius = 0.15}}"}) {
        const Scene scene = parse_scene(
            kBlock + "[[load]]\nwhere = " + where + "\nmoment = [[0, 1, -2, 3], [1, 4, 0, 0]]\n" + kInTime, "s.toml");
        for (const Vector3& about : {Vector3{0, 0, 0}, Vector3{3, -1, 2}}) {
            const auto [force, moment] = sums(scene, about);
            expect_near(force, {0, 0, 0}, 1e-12);
            expect_near(moment, {1, -2, 3}, 1e-12);
            expect_near(sums(scene, about, 2).second, {4, 0, 0}, 1e-12);
        }
    }
    EXPECT_NE(refusal(kBlock + "[[load]]\nwhere = {box = [[0, 0, 0], [0, 0, 1]]}\nmoment = [1, 0, 0]\n" + kInTime)
                  .find("s.toml:9:9: load.where = {box = [[0, 0, 0], [0, 0, 1]]}: its nodes lie on one line"),
              std::string::npos);
    EXPECT_NE(refusal(kBlock + "[[load]]\nwhere = {node = 3}\nmoment = [1, 0, 0]\n" + kInTime).find("on one line"),
              std::string::npos);
}

/// A free body is turned by it and goes nowhere: I w' = M; and what holds a face bears it.
TEST(Moment, turns_a_body_and_is_borne_by_its_support) {
    Simulation simulation(parse_scene(
        kBlock + "[[load]]\nwhere = {box = [[0, 0, 0], [9, 9, 9]]}\nmoment = [0, 0, 0.5]\n" + kInTime, "s.toml"));
    simulation.step(40);
    const auto [linear, angular] = momenta(simulation, {0.1, 0.15, 0.2});
    expect_near(linear, {0, 0, 0}, 1e-12);
    expect_near(angular, {0, 0, 0.5 * 0.04}, 1e-6);
    Simulation still(parse_scene(kBlock +
                                     "[[fix]]\nwhere = \"z-min\"\n[[load]]\nwhere = \"z-max\"\nmoment = [0, 0, 0.01]\n"
                                     "[[probe]]\nname = \"foot\"\nwhere = \"z-min\"\n[solver]\nmethod = \"static\"\n",
                                 "s.toml"));
    const Summary summary = still.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    expect_near(summary.probes.at(0).force, {0, 0, 0}, 1e-8);
    expect_near(summary.probes.at(0).torque, {0, 0, -0.01}, 1e-6);
}

/// On the whole body it is gravity; on a part it is the weight of that part, by its own density.
TEST(BodyForce, is_that_of_the_chosen_cells) {
    const std::string whole = "where = {box = [[0, 0, 0], [9, 9, 9]]}\n";
    const std::string held = kBlock + "[[fix]]\nwhere = \"z-min\"\n";
    const std::string still = "[solver]\nmethod = \"static\"\n";
    Simulation falls(parse_scene(held + "[gravity]\nacceleration = [1, 2, -10]\n" + still, "s.toml")),
        pulled(parse_scene(held + "[[load]]\n" + whole + "acceleration = [1, 2, -10]\n" + still, "s.toml")),
        dense(parse_scene(held + "[[load]]\n" + whole + "force_density = [1e3, 2e3, -1e4]\n" + still, "s.toml"));
    for (Simulation* each : {&falls, &pulled, &dense}) {
        EXPECT_TRUE(each->run().converged);
        for (std::size_t n = 0; n < falls.node_count(); ++n) {
            expect_near(each->displacements()[n], falls.displacements()[n], 1e-7 * 0.01);
        }
    }
    Scene scene = parse_scene(kBlock + "[[load]]\nwhere = \"z-max\"\nacceleration = [0, 0, -10]\n" + kInTime, "s.toml");
    expect_near(sums(scene, {}).first, {0, 0, -10 * 6}, 1e-12); // the uppermost layer of cells, 1 kg each
    scene.body.labels.assign(24, 1);
    scene.body.labels[23] = 2;
    scene.labels = {{1, 1e5, {}, {}}, {2, 2e5, {}, 3000}};
    expect_near(sums(scene, {}).first, {0, 0, -10 * (5 + 3)}, 1e-12);
    scene.loads[0].kind = LoadKind::force_density;
    expect_near(sums(scene, {}).first, {0, 0, -10 * 6e-3}, 1e-12);
    EXPECT_NE(refusal(kBlock + "[[load]]\nwhere = {node = 3}\nacceleration = [1, 0, 0]\n" + kInTime)
                  .find("load.where = {node = 3}: no cell's centre lies in it"),
              std::string::npos);
}

// -- [[pressure]]

const std::string kAllOver = "[[pressure]]\nwhere = {box = [[-1, -1, -1], [9, 9, 9]]}\n";

/// By its bulk modulus, at rest and where backward Euler and damped explicit steps come to.
TEST(PressureScene, a_block_shrinks_by_its_bulk_modulus) {
    const double pressure = 10, bulk = 1e5 / (3 * (1 - 2 * 0.3));
    const std::string solvers[] = {
        "[solver]\nmethod = \"static\"\n",
        "[damping]\nmass = 30\n[solver]\nmethod = \"backward-euler\"\nduration = 3\ntime_step = 0.02\n",
        "[damping]\nmass = 30\n[solver]\nmethod = \"leapfrog\"\nduration = 3\n",
        "[damping]\nmass = 30\n[solver]\nduration = 3\n"};
    for (const std::string& solver : solvers) {
        for (const std::string value : {"10", "[[0, 0], [0.5, 10]]"}) {
            Simulation simulation(parse_scene(
                kBlock + kAllOver + "pressure = " + value + "\n" + "[[fix]]\nwhere = {node = 0}\n" + solver, "s.toml"));
            const Summary summary = simulation.run();
            EXPECT_EQ(summary.failure, "");
            EXPECT_NEAR(summary.volume.relative_volume_change, pressure / bulk, 2e-3 * pressure / bulk)
                << solver << value;
            const EffectEnergy& effect = summary.energies.effects.at(0);
            EXPECT_EQ(effect.name, "pressure");
            if (value == "10") { // else it was pressed at less
                EXPECT_NEAR(effect.stored, -pressure * 0.024 * pressure / bulk, 0.02 * 0.024 * 100 / bulk) << solver;
            }
        }
    }
}

/// Its work, with a table and where the surface does not close, by both explicit methods; and cuts and checkpoints.
TEST(PressureScene, its_work_is_in_the_energy_balance) {
    const std::string text = kBlock + "[[fix]]\nwhere = \"x-min\"\n[[pressure]]\nwhere = \"y-max\"\n" +
                             "pressure = [[0, 0], [0.1, 4e3], [0.2, -1e3], [0.4, 2e3]]\n[[pressure]]\n"
                             "where = {of = {box = [[0, 0, 0], [9, 9, 9]]}, without = [\"x-min\"]}\npressure = 500\n"
                             "[output]\nenergy_balance = true\n" +
                             kInTime;
    for (const Scene& scene : {parse_scene(text, "s.toml"), by_leapfrog(text)}) {
        const EnergyBalance balance = Simulation(scene).run().balance.value();
        EXPECT_LT(balance.relative_imbalance(), 1e-3); // the step's own, as without pressure
        EXPECT_GT(std::abs(balance.effects), 0.05);
        EXPECT_GT(balance.elastic, 0.05);
        EXPECT_EQ(balance.effects_dissipated, 0);
    }
}

TEST(PressureScene, goes_on_from_a_checkpoint_with_the_same_bits) {
    const test::TemporaryDirectory directory;
    const std::string file = directory.path() / "checkpoint";
    const std::string text = kBlock + kAllOver + "pressure = [[0, 0], [0.3, 9e3]]\n[[fix]]\nwhere = \"y-min\"\n",
                      cut = "[[cut]]\nbox = [[0.1, 0.2, 0.3], [9, 9, 9]]\nat = 0.2\n";
    for (const Scene& scene : {parse_scene(text + cut + kInTime, "s.toml"), by_leapfrog(text + cut + kInTime),
                               parse_scene(text + kImplicit, "s.toml")}) {
        Simulation whole(scene);
        const Summary all = whole.run();
        EXPECT_EQ(all.failure, "");
        Simulation parts(scene);
        const Summary end = run_in_parts(parts, file);
        EXPECT_EQ(parts.displacements(), whole.displacements());
        EXPECT_EQ(end.energies.effects.at(0).stored, all.energies.effects.at(0).stored);
        EXPECT_NE(all.energies.effects.at(0).stored, 0);
    }
}

/// A plate that holds the pressed face reads what presses on it; two pressures on a face add up.
TEST(PressureScene, supports_bear_it) {
    const std::string text = kBlock + "[[fix]]\nwhere = \"z-min\"\n[[fix]]\nwhere = \"z-max\"\n"
                                      "[[pressure]]\nwhere = \"z-max\"\npressure = 100\n"
                                      "[[pressure]]\nwhere = \"z-max\"\npressure = -30\n"
                                      "[[probe]]\nname = \"plate\"\nwhere = \"z-max\"\n";
    for (const std::string& solver : {std::string("[solver]\nmethod = \"static\"\n"), kInTime, kImplicit}) {
        Simulation simulation(parse_scene(text + solver, "s.toml"));
        simulation.step();
        expect_near(simulation.probes().at(0).force, {0, 0, 70 * 0.06}, 1e-12);
    }
}

TEST(PressureScene, what_it_cannot_be_is_refused) {
    const std::string top = kBlock + "[[fix]]\nwhere = \"z-min\"\n[[pressure]]\nwhere = \"z-max\"\npressure = 1\n";
    EXPECT_EQ(refusal(top + kInTime), "");
    EXPECT_NE(refusal(top + kImplicit)
                  .find("s.toml:11:9: pressure.where = \"z-max\": with method = \"backward-euler\" pressed faces must "
                        "close, or end where they are held: they end at the nodes"),
              std::string::npos);
    EXPECT_NE(
        refusal(kBlock + "[[pressure]]\nwhere = {box = [[0.1, 0.1, 0.1], [0.1, 0.2, 0.3]]}\npressure = 1\n" + kInTime)
            .find("pressure.where = {box = [[0.1, 0.1, 0.1], [0.1, 0.2, 0.3]]}: the middle of no outer face"),
        std::string::npos);
}

/// Of several bodies each has its own, and moves as it would alone.
TEST(PressureScene, a_body_of_several_is_pressed_alone) {
    const std::string block = "cells = [2, 3, 4]\ncell_size = 0.1\n";
    const std::string material = "[material]\nyoung_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n";
    const std::string value = "where = {box = [[-1, -1, -1], [9, 9, 9]]}\npressure = [[0, 0], [0.3, 9e3]]\n";
    const std::string moment = "where = \"z-max\"\nmoment = [0.1, 0, 0]\n";
    const WorldScene scene = std::get<WorldScene>(
        parse_any_scene("[[body]]\nname = \"a\"\n" + block + "[[body]]\nname = \"b\"\n" + block + material +
                            "[[pressure]]\nbody = \"a\"\n" + value + "[[load]]\nbody = \"b\"\n" + moment + kInTime,
                        "w.toml"));
    WorldSimulation world(scene);
    Simulation pressed(parse_scene("[body]\n" + block + material + "[[pressure]]\n" + value + kInTime, "s.toml")),
        turned(parse_scene("[body]\n" + block + material + "[[load]]\n" + moment + kInTime, "s.toml"));
    world.step(100);
    pressed.step(100);
    turned.step(100);
    EXPECT_EQ(world.body(0).displacements(), pressed.displacements());
    EXPECT_EQ(world.body(1).displacements(), turned.displacements());
    EXPECT_LT(pressed.energies().effects.at(0).stored, 0);
}

// -- [[actuate]]

/// All methods lead a free block to the size that its cells have at rest, by a table or at once, whole or by a label.
TEST(Actuate, grows_a_block_to_its_size_by_every_method) {
    const std::string grown = "[[actuate]]\nlabel = 1\nstretch = [1.1, 0.8, 0.9]\n";
    const std::string in_time = "[[actuate]]\nwhere = {box = [[-1, -1, -1], [1, 1, 1]]}\n"
                                "stretch = [[0, 1, 1, 1], [0.1, 1.1, 0.8, 0.9]]\n";
    const std::string damped = "[damping]\nmass = 40\nstiffness = 0.002\n";
    const std::string held = "[[fix]]\nwhere = {node = 0}\n[[fix]]\nwhere = {node = 2}\naxes = \"yz\"\n"
                             "[[fix]]\nwhere = {node = 9}\naxes = \"z\"\n";
    for (const std::string& text :
         {kBlock + grown + held + "[solver]\nmethod = \"static\"\n",
          kBlock + in_time + held + "[solver]\nmethod = \"static\"\n",
          kBlock + in_time + damped + "[solver]\nduration = 0.6\ntime_step = 0.0005\n",
          kBlock + in_time + damped + "[solver]\nmethod = \"leapfrog\"\nduration = 0.6\ntime_step = 0.0005\n",
          kBlock + in_time + damped + "[solver]\nmethod = \"backward-euler\"\nduration = 0.6\ntime_step = 0.02\n"}) {
        Simulation simulation(parse_scene(text, "s.toml"));
        const Summary result = simulation.run();
        EXPECT_TRUE(result.failure.empty()) << result.failure;
        const std::vector<Vector3> u = simulation.displacements();
        const auto rest = simulation.rest_positions();
        const Vector3 s = {1.1, 0.8, 0.9};
        for (std::size_t n = 0; n < rest.size(); ++n) {
            for (std::size_t a = 0; a < 3; ++a) {
                EXPECT_NEAR(u[n][a] - u[0][a], (s[a] - 1) * rest[n][a], 2e-4) << text;
            }
        }
    }
}

TEST(Actuate, a_step_that_larger_stretches_do_not_bear_is_refused) {
    const std::string at_rest = kBlock + "[[actuate]]\nlabel = 1\nstretch = [1, 1, 1]\n[solver]\nduration = 0.5\n";
    const std::string larger = kBlock + "[[actuate]]\nlabel = 1\nstretch = [[0, 1, 1, 1], [9, 1, 4, 4]]\n"
                                        "[solver]\nduration = 0.5\n";
    const double made = Simulation(parse_scene(at_rest, "s.toml")).critical_time_step();
    EXPECT_NEAR(Simulation(parse_scene(larger, "s.toml")).critical_time_step(), made / 4, 1e-12);
    EXPECT_NE(refusal(larger + "time_step = " + std::to_string(made)).find("stable time step"), std::string::npos);
}

TEST(Actuate, refusals_are_clear) {
    const std::string head = kBlock + "[[actuate]]\n";
    const auto told = [&](const std::string& text) {
        try {
            return refusal(head + text + "\n" + kInTime);
        } catch (const SceneError& error) {
            return std::string(error.what());
        }
    };
    for (const auto& [text, said] : std::initializer_list<std::pair<std::string, const char*>>{
             {"stretch = [1, 1, 1]", "label must be given"},
             {"label = 1\nstretch = [1, 0.01, 1]", "from 0.1 to 10"},
             {"label = 1\nstretch = [[0, 1, 1, 1], [1, 11, 1, 1]]", "from 0.1 to 10"},
             {"label = 7\nstretch = [1, 1, 1]", "no cell"},
             {"where = {sphere = {center = [9, 9, 9], radius = 1}}\nstretch = [1, 1, 1]", "no cell"},
             {"where = {node = 0}\nstretch = [1, 1, 1]", "no cell"},
             {"label = 1\nstretch = [1, 1, 1]\n[[actuate]]\nlabel = 1\nstretch = [1, 1, 1]", "in actuate[0] too"},
             {"label = 1\nstretch = [1, 1, 1]\n[output]\nstress = true", "as they were made"}}) {
        const std::string message = told(text);
        EXPECT_NE(message.find(said), std::string::npos) << text << ": " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

} // namespace
} // namespace hybmss
