/// Scenes whose cells part along faces: tears, and cuts that separate. What has to stay: mass, momentum, energy, bits.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/separation.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"
#include "tests/simulation/files.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace hybmss {
namespace {

using V = std::array<double, 3>;

std::string scene_text(const std::string& of_material, const std::string& more) {
    return "[body]\ncells = [8, 3, 2]\ncell_size = 0.1\nplace = {translate = [0.3, 0, -0.1]}\n"
           "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n" +
           of_material + more;
}

/// Turns so fast about z that the middle does not hold.
const std::string kTurning =
    "[[start]]\nvelocity = [0, 1, 0]\nangular_velocity = [0, 0, 12]\n[solver]\nduration = 0.5\n";

struct Totals {
    double mass = 0;
    V momentum{}, angular{};
};
Totals totals(const Simulation& simulation) {
    Totals sums;
    const std::vector<V> u = simulation.displacements(), v = simulation.velocities();
    for (std::size_t n = 0; n < u.size(); ++n) {
        const double m = simulation.masses()[n];
        V x = simulation.rest_positions()[n];
        sums.mass += m;
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] += u[n][a];
        }
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t i = (a + 1) % 3, j = (a + 2) % 3;
            sums.momentum[a] += m * v[n][a];
            sums.angular[a] += m * (x[i] * v[n][j] - x[j] * v[n][i]);
        }
    }
    return sums;
}

TEST(Parting, UntilTheFirstTearABodyIsItsNetworkToTheBit) {
    Simulation simulation(parse_scene(scene_text("tear_strain = 50\n", kTurning), "s.toml"));
    const SeparatedNetwork body = separate(simulation.lattice(), simulation.scene().material, {});
    const std::size_t nodes = body.network.masses.size();
    ASSERT_EQ(simulation.node_count(), nodes);
    Network network = body.network;
    for (V& x : network.rest_positions) {
        x[0] += 0.3;
        x[2] -= 0.1;
    }
    ExplicitDynamics<double> dynamics(network);
    std::vector<V> v = simulation.velocities(), u(nodes, V{});
    dynamics.set_velocities(VectorField<const double>::aos(v.data()->data(), nodes));
    dynamics.step({simulation.time_step(), {0, 0, 0}, 0, Integrator::symplectic_euler}, 100);
    dynamics.get_displacements(VectorField<double>::aos(u.data()->data(), nodes));
    simulation.step(100);
    EXPECT_EQ(simulation.displacements(), u);
    EXPECT_EQ(simulation.parted_face_count(), 0u);
}

TEST(Parting, TearsKeepMassMomentumAndEnergy) {
    const Scene scene = parse_scene(scene_text("tear_strain = 0.15\n", kTurning), "s.toml");
    Simulation simulation(scene);
    const Totals before = totals(simulation);
    const std::size_t nodes = simulation.node_count();
    const Summary summary = simulation.run();
    EXPECT_EQ(summary.failure, "");
    EXPECT_GT(summary.parted_faces, 4u);
    EXPECT_EQ(simulation.parted_faces().size(), summary.parted_faces);
    EXPECT_GT(simulation.node_count(), nodes);
    const Totals after = totals(simulation);
    EXPECT_NEAR(after.mass, before.mass, 1e-12 * before.mass);
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(after.momentum[a], before.momentum[a], 1e-10 * std::abs(before.momentum[1]));
        EXPECT_NEAR(after.angular[a], before.angular[a], 1e-9 * std::abs(before.angular[2]));
    }
    EXPECT_NEAR(summary.parting_energy, 0, 1e-10 * summary.energies.kinetic);
    // The scene without tears holds together.
    Scene whole = scene;
    whole.tear_strain.reset();
    EXPECT_EQ(Simulation(whole).run().parted_faces, 0u);
    // The same for any number of threads.
    SimulationOptions options;
    options.plan.threads = 2;
    Simulation again(scene, options);
    again.run();
    EXPECT_EQ(again.displacements(), simulation.displacements());
    // And for one that goes on.
    const test::TemporaryDirectory directory;
    const std::string path = directory.path() / "checkpoint";
    Simulation begun(scene);
    begun.step(simulation.steps() / 2);
    ASSERT_GT(begun.parted_face_count(), 0u);
    begun.write_checkpoint(path);
    Simulation gone_on = Simulation::restarted(scene, {}, path);
    EXPECT_EQ(gone_on.parted_face_count(), begun.parted_face_count());
    gone_on.step(simulation.steps() - begun.steps());
    EXPECT_EQ(gone_on.displacements(), simulation.displacements());
    EXPECT_EQ(gone_on.velocities(), simulation.velocities());
}

/// A bar that hangs, and a blade through it at the time 0.1: a box around the faces between the fourth and the fifth
/// layer of cells.
const std::string kHanging = "[[fix]]\nwhere = \"x-min\"\n[gravity]\nacceleration = [1, 0, 0]\n"
                             "[[cut]]\nbox = [[0.69, -1, -1], [0.73, 1, 1]]\nat = 0.1\nmode = \"separate\"\n"
                             "[[probe]]\nname = \"root\"\nwhere = \"x-min\"\n[damping]\nstiffness = 1e-3\n";

TEST(Parting, ABladeLetsWhatIsBelowFall) {
    const Scene scene = parse_scene(scene_text("", kHanging + "[solver]\nduration = 0.6\n"), "s.toml");
    Simulation simulation(scene);
    const std::size_t nodes = simulation.node_count();
    const Summary summary = simulation.run();
    EXPECT_EQ(summary.parted_faces, 6u);
    EXPECT_EQ(simulation.node_count(), nodes + 12);
    EXPECT_NEAR(summary.parting_energy, 0, 1e-12);
    ASSERT_EQ(summary.energies.effects.size(), 1u);
    EXPECT_GT(summary.energies.effects[0].dissipated, 0);
    // The mean velocity of the lower half grows by g alone.
    const auto mean = [](const Simulation& s) {
        double sum = 0, mass = 0;
        const std::vector<V> v = s.velocities();
        const auto cells = s.cell_nodes();
        std::vector<bool> lower(s.node_count(), false);
        for (std::size_t c = 0; c < cells.size(); ++c) {
            for (const std::uint32_t n : cells[c]) {
                lower[n] = lower[n] || c % 8 >= 4;
            }
        }
        for (std::size_t n = 0; n < v.size(); ++n) {
            sum += lower[n] ? s.masses()[n] * v[n][0] : 0;
            mass += lower[n] ? s.masses()[n] : 0;
        }
        EXPECT_NEAR(mass, 1000 * 0.4 * 0.3 * 0.2, 1e-9);
        return sum / mass;
    };
    Simulation steps(scene);
    while (steps.parted_face_count() == 0) {
        steps.step(1);
    }
    EXPECT_NEAR(steps.time(), 0.1, 1.01 * steps.time_step());
    const double begun = mean(steps), since = steps.time();
    steps.step(200);
    EXPECT_NEAR(mean(steps) - begun, steps.time() - since, 1e-9);
}

TEST(Parting, ResultsHoldTheNodesThatAreThere) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml",
                     scene_text("", kHanging + "[output]\nevery = 0.2\nmass = true\n[solver]\nduration = 0.4\n"));
    const test::ProgramResult run = test::run_program("run s.toml --out out", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_NE(run.output.find("6 faces between cells; energy changed by"), std::string::npos) << run.output;
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "out" / "summary.json"));
    EXPECT_EQ(json["parted_faces"], 6);
    std::size_t points[2] = {};
    for (const std::size_t frame : {0u, 2u}) {
        const std::string vtu =
            test::read_text(directory.path() / "out" / ("body_000" + std::to_string(frame) + ".vtu"));
        const auto mass = test::vtu_array<double>(vtu, "mass");
        points[frame / 2] = mass.size();
        EXPECT_NEAR(std::accumulate(mass.begin(), mass.end(), 0.0), 1000 * 0.8 * 0.3 * 0.2, 1e-9);
        for (const std::int32_t n : test::vtu_array<std::int32_t>(vtu, "connectivity")) {
            EXPECT_LT(static_cast<std::size_t>(n), mass.size());
        }
    }
    EXPECT_EQ(points[1], points[0] + 12);
    const test::ProgramResult told = test::run_program("explain s.toml", directory.path());
    EXPECT_EQ(told.exit_code, 0) << told.errors;
    EXPECT_NE(told.output.find("along faces, as a network from the start; by [[cut]] alone"), std::string::npos);
}

struct Refused {
    const char *of_material, *more, *message;
};
constexpr Refused kRefused[] = {
    {"tear_strain = 0\n", "", "material.tear_strain = 0: it must be above 0 and at most 100"},
    {"tear_strain = 1\ncrush_resistance = 20\n", "", "material.crush_resistance = 20: the body may part: "},
    {"tear_strain = 1\n", "[[pressure]]\nwhere = \"z-max\"\npressure = 1\n",
     "pressure.where = \"z-max\": the body may part"},
    {"tear_strain = 1\n", "[[cut]]\nbox = [[0, 0, 0], [1, 1, 1]]\nat = 0\n",
     "cut.at = 0: the body parts elsewhere: its cuts must have mode = \"separate\""},
    {"tear_strain = 1\n", "[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 0, 1]}\n",
     "obstacle.friction: the body may part"},
    {"tear_strain = 1\n", "[[fix]]\nwhere = {node = 3}\n", "fix.where = {node = 3}: the body may part, and its nodes"},
    {"tear_strain = 1\n", "[[move]]\nwhere = \"x-max\"\nrotate = {axis = \"x\", degrees = 5}\n",
     "move.rotate = {axis = \"x\", degrees = 5}: the body may part"},
    {"tear_strain = 1\n", "[output]\nenergy_balance = true\n", "output.energy_balance = true: the body may part"},
};

TEST(Parting, RefusesWhatItCannotBringOver) {
    for (const Refused& refused : kRefused) {
        SCOPED_TRACE(refused.message);
        try {
            Simulation simulation(parse_scene(scene_text(refused.of_material, refused.more + kTurning), "s.toml"));
            ADD_FAILURE() << "accepted";
        } catch (const SceneError& error) {
            EXPECT_NE(std::string(error.what()).find(refused.message), std::string::npos) << error.what();
        }
    }
    Scene scene = parse_scene(scene_text("tear_strain = 0.2\n", kTurning), "s.toml");
    EXPECT_EQ(parse_scene(to_toml(scene), "s.toml").tear_strain, scene.tear_strain);
    scene.starts.clear();
    scene.solver.method = SolverMethod::leapfrog;
    EXPECT_THROW(Simulation{scene}, SceneError);
    Simulation parting(parse_scene(scene_text("tear_strain = 0.2\n", kTurning), "s.toml"));
    EXPECT_THROW(parting.remove_cells(std::array{0u}), std::invalid_argument);
}

} // namespace
} // namespace hybmss
