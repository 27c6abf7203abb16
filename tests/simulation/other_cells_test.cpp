/// Scenes of bodies whose cells are no cubes: beside the networks that they stand for, and by exact moduli.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/polyhedra.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "simulation/results/results.hpp"
#include "tests/program.hpp"
#include "tests/simulation/files.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

namespace hybmss {
namespace {

namespace fs = std::filesystem;
using V = std::array<double, 3>;

constexpr double kModulus = 1e4, kRatio = 0.3, kDensity = 1000, kEdge = 0.5;

std::string body_text(const std::string& shape, const std::string& more = "") {
    return "[body]\ncells = [3, 4, 2]\ncell_size = 0.5\nshape = \"" + shape + "\"\n" + more +
           "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n";
}

Material material() {
    Material made;
    made.young_modulus = kModulus;
    made.poisson_ratio = kRatio;
    made.density = kDensity;
    return made;
}

Network network_of(const std::string& shape) {
    if (shape == "tetrahedra") {
        Network made = tetrahedron_lattice({3, 4, 2}, kEdge, material());
        made.nodal_volumes = true;
        return made;
    }
    return shape == "pyramids" ? pyramid_lattice({3, 4, 2}, kEdge, material())
                               : prism_lattice({3, 4, 2}, kEdge, kEdge, material());
}

constexpr const char* kShapes[] = {"tetrahedra", "pyramids", "prisms"};

/// The cells of a box of tetrahedra and pyramids, as VTK's legacy format has them; nodes off their places by some.
std::string mixed_mesh(double off, double stretch = 1) {
    const Network lattice = tetrahedron_lattice({4, 4, 4}, kEdge, material());
    std::string text = "# vtk DataFile Version 3.0\nmixed\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                       std::to_string(lattice.rest_positions.size()) + " double\n";
    for (std::size_t n = 0; n < lattice.rest_positions.size(); ++n) {
        const V& x = lattice.rest_positions[n];
        const bool inside = x[0] > 0.1 && x[0] < 1.9 && x[1] > 0.1 && x[1] < 1.9 && x[2] > 0.1 && x[2] < 1.9;
        for (std::size_t a = 0; a < 3; ++a) {
            const double by = inside ? off * std::sin(1.7 * static_cast<double>(3 * n + a)) : 0;
            char word[32];
            std::snprintf(word, sizeof word, "%.17g ", (a == 0 ? stretch : 1) * (x[a] + by));
            text += word;
        }
        text += "\n";
    }
    std::string cells, types;
    std::size_t numbers = 0;
    for (const Network::Polyhedron& cell : lattice.polyhedra) {
        cells += std::to_string(cell.node_count());
        for (std::size_t c = 0; c < cell.node_count(); ++c) {
            cells.append(" ").append(std::to_string(cell.nodes[c]));
        }
        cells += "\n";
        numbers += 1 + cell.node_count();
        types += cell.shape == CellShape::tetrahedron ? "10\n" : "14\n";
    }
    const std::string count = std::to_string(lattice.polyhedra.size());
    return text + "CELLS " + count + " " + std::to_string(numbers) + "\n" + cells + "CELL_TYPES " + count + "\n" +
           types;
}

/// Free, turning and falling: displacements and velocities after some steps are those of the network by itself.
void expect_the_motion_of(const Network& network, Simulation& simulation) {
    ASSERT_EQ(simulation.node_count(), network.masses.size());
    constexpr long kSteps = 40;
    std::vector<double> u(3 * network.masses.size(), 0.0), v = u;
    V middle{};
    const double mass = std::accumulate(network.masses.begin(), network.masses.end(), 0.0);
    for (std::size_t n = 0; n < network.masses.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            middle[a] += network.masses[n] * network.rest_positions[n][a];
        }
    }
    for (std::size_t n = 0; n < network.masses.size(); ++n) { // about z, by 2 rad/s
        v[3 * n] = 1 - 2 * (network.rest_positions[n][1] - middle[1] / mass);
        v[3 * n + 1] = 2 * (network.rest_positions[n][0] - middle[0] / mass);
    }
    ExplicitDynamics<double> dynamics(network);
    const std::size_t nodes = network.masses.size();
    dynamics.set_displacements(VectorField<const double>::aos(u.data(), nodes));
    dynamics.set_velocities(VectorField<const double>::aos(v.data(), nodes));
    dynamics.step({simulation.time_step(), {0, 0, -9.81}, 0.1, Integrator::symplectic_euler}, kSteps);
    dynamics.get_displacements(VectorField<double>::aos(u.data(), nodes));
    dynamics.get_velocities(VectorField<double>::aos(v.data(), nodes));
    simulation.step(kSteps);
    const std::vector<V> own = simulation.displacements(), speed = simulation.velocities();
    double greatest = 0;
    for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            ASSERT_EQ(own[n][a], u[3 * n + a]) << n;
            ASSERT_EQ(speed[n][a], v[3 * n + a]) << n;
            greatest = std::max(greatest, std::abs(u[3 * n + a]));
        }
    }
    EXPECT_GT(greatest, 1e-3);
}

constexpr const char* kFall = "[[start]]\nvelocity = [1, 0, 0]\nangular_velocity = [0, 0, 2]\n"
                              "[gravity]\nacceleration = [0, 0, -9.81]\n[damping]\nmass = 0.1\n"
                              "[solver]\nduration = 1\n";

TEST(OtherCells, MoveAsTheirNetworkDoesToTheBit) {
    for (const char* shape : kShapes) {
        SCOPED_TRACE(shape);
        Simulation simulation(parse_scene(body_text(shape) + kFall, "s.toml"));
        const Network network = network_of(shape);
        expect_the_motion_of(network, simulation);
        EXPECT_EQ(simulation.cell_count(), network.polyhedra.size());
        EXPECT_TRUE(simulation.cell_nodes().empty());
        EXPECT_THROW((void)simulation.lattice(), std::invalid_argument);
        EXPECT_THROW(simulation.remove_cells(std::array{0u}), std::invalid_argument);
    }
}

TEST(OtherCells, OfAMeshMoveAsTheirFittedNetwork) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "mixed.vtk", mixed_mesh(0.03));
    const std::string text = "[body]\nmesh = \"mixed.vtk\"\nplace = {translate = [0, 0, 0]}\n" +
                             body_text("").substr(body_text("").find("[material]")) + kFall;
    Simulation simulation(parse_scene(text, directory.path() / "s.toml"));
    const FittedCells fitted = fit_springs(read_cells(directory.path() / "mixed.vtk"), material());
    expect_the_motion_of(fitted.network, simulation);
    const FittedCells& own = *simulation.other_cells();
    EXPECT_EQ(own.anisotropy, fitted.anisotropy);
    EXPECT_GT(own.anisotropy, 0);
    EXPECT_EQ(own.modulus_error, fitted.modulus_error);
    const double mass = std::accumulate(simulation.masses().begin(), simulation.masses().end(), 0.0);
    EXPECT_NEAR(mass, kDensity * 8, 1e-9 * mass); // a cube of 2 m
    const Scene& scene = simulation.scene();
    EXPECT_NEAR(scene.body.cell_size, std::cbrt(8.0 / static_cast<double>(simulation.node_count())), 1e-12);
    const Scene again = parse_scene(to_toml(scene), directory.path() / "s.toml");
    EXPECT_EQ(again.body, scene.body);
    Scene by_hand = scene;
    by_hand.body.mesh_file.clear();
    EXPECT_THROW(to_toml(by_hand), SceneError);
    EXPECT_EQ(Simulation(by_hand).describe().springs, simulation.describe().springs);
}

TEST(OtherCells, OfABadMeshAreRefusedInOneLine) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "flat.vtk", mixed_mesh(0, 4));
    const std::string rest = body_text("").substr(body_text("").find("[material]")) + kFall;
    const auto refusal = [&](const std::string& body) {
        try {
            Simulation(parse_scene("[body]\n" + body + rest, directory.path() / "s.toml"));
        } catch (const SceneError& error) {
            return std::string(error.what()).substr((directory.path() / "s.toml").string().size());
        }
        return std::string("accepted");
    };
    const std::string far = refusal("mesh = \"flat.vtk\"\n");
    EXPECT_TRUE(far.starts_with(":2:8: body.mesh = \"flat.vtk\": a mesh whose springs are far from isotropic given: "
                                "anisotropy "))
        << far;
    EXPECT_NE(far.find("at most 0.1 allowed"), std::string::npos) << far;
    EXPECT_EQ(refusal("mesh = \"flat.vtk\"\nmost_anisotropy = 1\n"), "accepted");
    const std::string none = refusal("mesh = \"none.vtk\"\n");
    EXPECT_TRUE(none.starts_with(":2:8: body.mesh = \"none.vtk\": ")) << none;
    EXPECT_EQ(refusal("mesh = \"flat.vtk\"\ncell_size = 1\n"),
              ":3:13: body.cell_size = 1: the cells of a mesh have the sizes that its file tells");
}

/// J of a homogeneous strain along an axis: every layer of nodes is led to its place, each node held across.
double energy_of_strain(const std::string& shape, std::size_t axis) {
    constexpr double kStrain = 1e-6;
    const bool leans = shape == "prisms" && axis == 1;
    const double apart = shape == "prisms" && axis == 2 ? kEdge : leans ? kEdge * std::sqrt(0.75) : kEdge / 2;
    const double high = kEdge * (leans ? 3 * std::sqrt(0.75) : shape == "prisms" && axis == 0 ? 4.5 : 3);
    const std::string letter(1, "xyz"[axis]);
    std::string text = body_text(shape);
    text.replace(text.find("[3, 4, 2]"), 9, "[3, 3, 3]"); // tetrahedra's sides are isotropic together alone
    text +=
        "[[fix]]\nwhere = {box = [[-9, -9, -9], [9, 9, 9]]}\naxes = \"" + std::string("xyz").erase(axis, 1) + "\"\n";
    for (int layer = 0; layer * apart < high + 1e-6; ++layer) {
        std::array<std::string, 3> low = {"-9", "-9", "-9"}, top = {"9", "9", "9"}, by = {"0", "0", "0"};
        const auto number = [](double x) {
            char word[32];
            std::snprintf(word, sizeof word, "%.17g", x);
            return std::string(word);
        };
        low[axis] = number(layer * apart - 1e-3);
        top[axis] = number(layer * apart + 1e-3);
        by[axis] = number(kStrain * layer * apart);
        const auto vector = [](const std::array<std::string, 3>& x) {
            return std::string("[").append(x[0]).append(", ").append(x[1]).append(", ").append(x[2]).append("]");
        };
        text += "[[move]]\nwhere = {box = [" + vector(low) + ", " + vector(top) + "]}\naxes = \"" + letter +
                "\"\ntranslate = " + vector(by) + "\n";
    }
    Simulation simulation(parse_scene(text + "[solver]\nmethod = \"static\"\n", "s.toml"));
    EXPECT_EQ(simulation.moved_node_count(), simulation.node_count());
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(summary.volume.max_cell_volume_ratio, summary.volume.min_cell_volume_ratio, 1e-12);
    EXPECT_NEAR(summary.volume.relative_volume_change, kStrain, 1e-12);
    return (summary.energies.springs + summary.energies.volume) / (kStrain * kStrain);
}

TEST(OtherCells, OfALatticeHaveTheModuliAskedForAlongEachAxis) {
    const double G = kModulus / (2 * (1 + kRatio)), axial = 2 * G * (1 - kRatio) / (1 - 2 * kRatio); // lambda + 2 G
    for (const std::string shape : kShapes) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            SCOPED_TRACE(shape + " " + std::to_string(axis));
            const double expected = axial / 2 * 3.375 * (shape == "prisms" ? std::sqrt(0.75) : 1);
            EXPECT_NEAR(energy_of_strain(shape, axis), expected, 1e-5 * expected);
        }
    }
}

TEST(OtherCells, BearTheirWeightAndLoadsExactly) {
    for (const char* shape : kShapes) {
        SCOPED_TRACE(shape);
        const std::string text = body_text(shape) + "[[fix]]\nwhere = \"z-min\"\n[gravity]\nacceleration = [0, 0, -1]\n"
                                                    "[[load]]\nwhere = \"z-max\"\nforce = [30, 0, -10]\n"
                                                    "[[probe]]\nname = \"foot\"\nwhere = \"z-min\"\n"
                                                    "[solver]\nmethod = \"static\"\n";
        Simulation simulation(parse_scene(text, "s.toml"));
        const Summary summary = simulation.run();
        ASSERT_TRUE(summary.converged) << summary.failure;
        const double volume = 3 * (shape == kShapes[2] ? std::sqrt(0.75) : 1);
        EXPECT_NEAR(summary.probes.at(0).force[2], kDensity * volume + 10, 1e-3);
        EXPECT_NEAR(summary.probes.at(0).force[0], -30, 1e-3);
        EXPECT_LT(summary.volume.min_cell_volume_ratio, 1);
        const double mass = std::accumulate(simulation.masses().begin(), simulation.masses().end(), 0.0);
        EXPECT_NEAR(mass, kDensity * volume, 1e-9 * mass);
    }
}

TEST(OtherCells, RestOnAFloorAndKeepTheirEnergy) {
    const std::string text =
        body_text("pyramids", "place = {translate = [0, 0, 0.01]}\n") +
        "[gravity]\nacceleration = [0, 0, -5]\n[[obstacle]]\nplane = {point = [0, 0, 0], normal = [0, 0, 1]}\n"
        "[damping]\nmass = 3\nstiffness = 1e-3\n[solver]\nduration = 20\ntolerance = 1e-4\n"
        "[output]\nenergy_balance = true\n";
    Simulation simulation(parse_scene(text, "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_TRUE(summary.converged) << summary.failure;
    EXPECT_NEAR(std::abs(summary.obstacles.at(0).reading.force[2]), kDensity * 3 * 5, 2);
    EXPECT_LT(summary.balance->relative_imbalance(), 0.02);
}

TEST(OtherCells, GoOnFromACheckpointWithTheSameBits) {
    const test::TemporaryDirectory directory;
    const std::string path = directory.path() / "checkpoint", text = body_text("prisms") + kFall;
    Simulation simulation(parse_scene(text, "s.toml"));
    simulation.step(30);
    simulation.write_checkpoint(path);
    simulation.step(30);
    Simulation again = Simulation::restarted(parse_scene(text, "s.toml"), {}, path);
    again.step(30);
    EXPECT_EQ(again.displacements(), simulation.displacements());
    EXPECT_EQ(again.velocities(), simulation.velocities());
}

TEST(OtherCells, AreWrittenAsVtkHasThem) {
    for (const char* shape : kShapes) {
        SCOPED_TRACE(shape);
        const test::TemporaryDirectory directory;
        test::write_text(directory.path() / "s.toml",
                         body_text(shape) + "[[fix]]\nwhere = \"z-min\"\n[gravity]\nacceleration = [0, 0, -1]\n"
                                            "[output]\nmass = true\nreaction = true\n[solver]\nmethod = \"static\"\n");
        const test::ProgramResult run = test::run_program("run s.toml --out out", directory.path());
        ASSERT_EQ(run.exit_code, 0) << run.errors;
        const std::string vtu = test::read_text(directory.path() / "out" / "body_0001.vtu");
        const auto points = test::vtu_array<V>(vtu, "Points");
        const auto nodes = test::vtu_array<std::int32_t>(vtu, "connectivity");
        const auto ends = test::vtu_array<std::int64_t>(vtu, "offsets");
        const auto types = test::vtu_array<std::uint8_t>(vtu, "types");
        const auto ratios = test::vtu_array<double>(vtu, "volume_ratio");
        const Network network = network_of(shape);
        ASSERT_EQ(types.size(), network.polyhedra.size());
        ASSERT_EQ(ends.size(), types.size());
        ASSERT_EQ(ratios.size(), types.size());
        EXPECT_EQ(test::vtu_array<double>(vtu, "mass"), network.masses);
        std::size_t begin = 0;
        for (std::size_t c = 0; c < types.size(); ++c) {
            const auto end = static_cast<std::size_t>(ends[c]);
            const std::vector<std::int32_t> cell(nodes.begin() + static_cast<std::ptrdiff_t>(begin),
                                                 nodes.begin() + static_cast<std::ptrdiff_t>(end));
            begin = end;
            const CellShape is = network.polyhedra[c].shape;
            EXPECT_EQ(types[c], is == CellShape::tetrahedron ? 10 : is == CellShape::pyramid ? 14 : 13);
            ASSERT_EQ(cell.size(), network.polyhedra[c].node_count());
            // Of its first triangle VTK sees a prism's from outside, others' from within: from node 3 or 4.
            const auto edge = [&](std::size_t to, std::size_t a) {
                return points[static_cast<std::size_t>(cell[to])][a] - points[static_cast<std::size_t>(cell[0])][a];
            };
            const std::size_t top = types[c] == 14 ? 4 : 3;
            double volume = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                volume += edge(top, a) *
                          (edge(1, (a + 1) % 3) * edge(2, (a + 2) % 3) - edge(1, (a + 2) % 3) * edge(2, (a + 1) % 3));
            }
            EXPECT_GT(types[c] == 13 ? -volume : volume, 0);
        }
        EXPECT_LT(*std::min_element(ratios.begin(), ratios.end()), 0.999);
        // Where the program draws or needs cubes, one line says so.
        for (const char* command : {"forces s.toml --displacements none.csv", "tune s.toml", "record s.toml --out r"}) {
            const test::ProgramResult refused = test::run_program(command, directory.path());
            EXPECT_EQ(refused.exit_code, 2) << command << refused.output;
            EXPECT_EQ(std::count(refused.errors.begin(), refused.errors.end(), '\n'), 1) << refused.errors;
        }
        const test::ProgramResult told = test::run_program("explain s.toml", directory.path());
        EXPECT_EQ(told.exit_code, 0) << told.errors;
        EXPECT_NE(told.output.find(shape), std::string::npos) << told.output;
        EXPECT_NE(told.output.find("none needed: these springs are isotropic"), std::string::npos) << told.output;
    }
}

TEST(OtherCells, TellTheirFit) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "mixed.vtk", mixed_mesh(0.03));
    test::write_text(directory.path() / "s.toml", "[body]\nmesh = \"mixed.vtk\"\n" +
                                                      body_text("").substr(body_text("").find("[material]")) +
                                                      "[[fix]]\nwhere = \"z-min\"\n[gravity]\n"
                                                      "acceleration = [0, 0, -1]\n[solver]\nmethod = \"static\"\n");
    const test::ProgramResult run = test::run_program("run s.toml --out out", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_NE(run.output.find("fitted: anisotropy "), std::string::npos) << run.output;
    const auto json = nlohmann::json::parse(test::read_text(directory.path() / "out" / "summary.json"));
    const FittedCells fitted = fit_springs(read_cells(directory.path() / "mixed.vtk"), material());
    EXPECT_EQ(json["fit"]["anisotropy"], fitted.anisotropy);
    EXPECT_EQ(json["fit"]["modulus_error"], fitted.modulus_error);
    EXPECT_EQ(json["fit"]["without_spring"], fitted.without);
    const test::ProgramResult told = test::run_program("explain s.toml --json e.json", directory.path());
    EXPECT_NE(told.output.find("error of the shear modulus"), std::string::npos) << told.output;
    EXPECT_EQ(nlohmann::json::parse(test::read_text(directory.path() / "e.json"))["body"]["anisotropy"],
              fitted.anisotropy);
}

struct Refused {
    const char* more;
    const char* message;
};
constexpr Refused kRefused[] = {
    {"springs = \"means\"\n", "s.toml:9:11: material.springs = \"means\": the body's cells are no cubes: their"},
    {"crush_resistance = 20\n", "material.crush_resistance = 20: the body's cells are no cubes: "},
    {"relaxation = [[0.5, 1]]\n", "material.relaxation = [[0.5, 1]]: the body's cells are no cubes: "},
    {"[[label]]\nvalue = 1\nyoung_modulus = 1e4\n", "label.value = 1: the body's cells are no cubes: "},
    {"[[pressure]]\nwhere = \"z-max\"\npressure = 1\n", "pressure.where = \"z-max\": the body's cells are no cubes: "},
    {"[[actuate]]\nwhere = {box = [[-9, -9, -9], [9, 9, 9]]}\nstretch = [1, 1, 2]\n",
     "actuate.stretch = [1, 1, 2]: the body's cells are no cubes: "},
    {"[[cut]]\nbox = [[0, 0, 0], [1, 1, 1]]\nat = 0\n", "cut.at = 0: the body's cells are no cubes: "},
    {"[[load]]\nwhere = \"z-max\"\ntraction = [0, 0, 1]\n", "load.where = \"z-max\": the body's cells are no cubes: "},
    {"[output]\nskin = true\n", "output.skin = true: the body's cells are no cubes: "},
    {"[output]\nstress = true\n", "output.stress = true: the body's cells are no cubes: "},
};

TEST(OtherCells, RefuseWhatOnlyCubesHave) {
    for (const Refused& refused : kRefused) {
        SCOPED_TRACE(refused.more);
        std::string text = body_text("tetrahedra") + refused.more + kFall;
        try {
            Simulation simulation(parse_scene(text, "s.toml"));
            ADD_FAILURE() << "accepted";
        } catch (const SceneError& error) {
            EXPECT_NE(std::string(error.what()).find(refused.message), std::string::npos) << error.what();
        }
    }
    SimulationOptions options;
    options.plan.layout = "flat-rows";
    EXPECT_THROW(Simulation(parse_scene(body_text("prisms") + kFall, "s.toml"), options), std::invalid_argument);
}

} // namespace
} // namespace hybmss
