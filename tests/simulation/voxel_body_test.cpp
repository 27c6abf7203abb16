/// Scenes whose cells come from voxel files: the same body as a box of cells, labels, parts, and what is refused.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/geometry/cells.hpp"
#include "tests/program.hpp"
#include "tests/simulation/files.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

using namespace test;

/// A static scene: `body` is compressed along y by a hundredth of a metre, and the plate is read.
std::string scene_text(const std::string& body, const std::string& poisson_ratio = "0.3",
                       const std::string& tables = "") {
    return "[body]\n" + body + "\n[material]\nyoung_modulus = 1e4\npoisson_ratio = " + poisson_ratio +
           "\ndensity = 1000\n[[fix]]\nwhere = \"y-min\"\n[[move]]\nwhere = \"y-max\"\ntranslate = [0, -0.01, 0]\n"
           "[solver]\nmethod = \"static\"\n[[probe]]\nname = \"plate\"\nwhere = \"y-max\"\n" +
           tables;
}

class VoxelBody : public testing::Test {
protected:
    void write(const std::string& file, const std::string& bytes) { write_text(directory.path() / file, bytes); }
    /// As read from a file in the directory, so that relative paths start there.
    Scene scene(const std::string& text) const { return parse_scene(text, (directory.path() / "s.toml").string()); }
    /// "" where the scene is fine.
    std::string error_of(const std::string& text) const {
        try {
            const Simulation simulation(scene(text));
            return "";
        } catch (const SceneError& error) {
            const std::string message = error.what(), folder = directory.path().string() + "/";
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            EXPECT_EQ(message.rfind(folder, 0), 0u) << message;
            return message.substr(folder.size());
        }
    }
    void expect_error(const std::string& text, const std::string& start) const {
        EXPECT_EQ(error_of(text).substr(0, start.size()), start);
    }
    TemporaryDirectory directory;
};

const auto kFull = [](int, int, int) { return 7; };

TEST_F(VoxelBody, full_box_is_the_box_of_cells) {
    write("box.npy", npy({2, 3, 4}, kFull));
    Simulation box(scene(scene_text("cells = [2, 3, 4]\ncell_size = 0.5")));
    Simulation voxels(scene(scene_text("voxels = \"box.npy\"\ncell_size = 0.5")));
    const Summary expected = box.run(), summary = voxels.run();
    ASSERT_TRUE(summary.converged) << summary.failure;
    EXPECT_EQ(voxels.displacements(), box.displacements());
    EXPECT_EQ(summary.probes.at(0).force, expected.probes.at(0).force);
    EXPECT_LT(summary.probes.at(0).force[1], -1);
}

/// The faces of the bounding box, the numbers of nodes and the loads are those of the filled cells.
TEST_F(VoxelBody, empty_cells_around_it_change_nothing) {
    write("box.npy", npy({2, 3, 4}, kFull));
    write("padded.npy", npy({5, 6, 6}, [](int i, int j, int k) {
              return i >= 1 && i < 3 && j >= 2 && j < 5 && k >= 1 && k < 5 ? 1 : 0;
          }));
    const std::string load = "[[load]]\nwhere = \"x-max\"\nforce = [3, 0, 1]\n[[fix]]\nwhere = {node = 20}\n";
    Simulation box(scene(scene_text("voxels = \"box.npy\"\ncell_size = 0.5", "0.3", load)));
    Simulation padded(scene(scene_text("voxels = \"padded.npy\"\ncell_size = 0.5", "0.3", load)));
    const Summary expected = box.run(), summary = padded.run();
    ASSERT_TRUE(summary.converged) << summary.failure;
    ASSERT_EQ(padded.node_count(), 3u * 4 * 5);
    EXPECT_EQ(padded.lattice().cell_count(), 24u);
    const auto u = box.displacements(), v = padded.displacements();
    for (std::size_t n = 0; n < u.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(u[n][a], v[n][a], 1e-8) << n; // 1e-6 of the motion: both solved to a residual of 1e-8
        }
    }
    EXPECT_NEAR(summary.probes.at(0).force[1], expected.probes.at(0).force[1], 1e-4);
    // A region in coordinates: voxel (i, j, k) begins at (i, j, k) times the cell size.
    EXPECT_EQ(error_of(scene_text("voxels = \"padded.npy\"\ncell_size = 0.5", "0.3",
                                  "[[fix]]\nwhere = {box = [[0.5, 1, 0.5], [0.5, 1, 0.5]]}\n")),
              "");
    expect_error(scene_text("voxels = \"padded.npy\"\ncell_size = 0.5", "0.3",
                            "[[fix]]\nwhere = {box = [[0, 0, 0], [0.4, 3, 3]]}\n"),
                 "s.toml:19:9: fix.where = {box = [[0, 0, 0], [0.4, 3, 3]]}: no node");
}

/// A column of two materials at nu = 0: L / E adds up along it.
TEST_F(VoxelBody, labels_have_their_own_stiffness) {
    write("column.npy", npy({2, 4, 2}, [](int, int j, int) { return j < 1 ? 3 : 9; }));
    const std::string labels = "[[label]]\nvalue = 3\nyoung_modulus = 2e3\n[[label]]\nvalue = 9\nyoung_modulus = 5e4\n";
    const Simulation unsolved(scene(scene_text("voxels = \"column.npy\"\ncell_size = 1", "0", labels)));
    EXPECT_EQ(unsolved.lattice().cell_scale(0, 0, 1), 0.2f);
    EXPECT_EQ(unsolved.lattice().cell_scale(1, 3, 0), 5.0f);
    Simulation column(scene(scene_text("voxels = \"column.npy\"\ncell_size = 1", "0", labels)));
    const Summary summary = column.run();
    ASSERT_TRUE(summary.converged) << summary.failure;
    const double force = 4 * 0.01 / (1 / 2e3 + 3 / 5e4);
    EXPECT_NEAR(summary.probes.at(0).force[1], -force, 0.02 * force); // the strain is 1 %: that far it is not linear

    const std::string without = "[[label]]\nvalue = 3\nyoung_modulus = 0\n[[label]]\nvalue = 9\nyoung_modulus = 5e4\n";
    EXPECT_EQ(
        Simulation(scene(scene_text("voxels = \"column.npy\"\ncell_size = 1", "0", without))).lattice().cell_count(),
        12u);
}

/// The ratio of shear moduli is what springs go by; what a label does not tell is the scene's.
TEST_F(VoxelBody, labels_have_their_own_ratio_and_density) {
    write("two.npy", npy({2, 2, 2}, [](int i, int, int) { return 1 + 2 * i; }));
    const auto labels = [](const std::string& more) {
        return scene_text("voxels = \"two.npy\"\ncell_size = 1", "0.3",
                          "[[label]]\nvalue = 1\nyoung_modulus = 1e4\n[[label]]\nvalue = 3\nyoung_modulus = 2e4\n" +
                              more);
    };
    const Simulation simulation(scene(labels("poisson_ratio = 0.1\ndensity = 3000\n")));
    const Lattice& lattice = simulation.lattice();
    EXPECT_NEAR(lattice.cell_scale(1, 0, 0), 2 * 1.3 / 1.1, 1e-6);
    EXPECT_EQ(lattice.cell_scale(0, 0, 0), 1.0f);
    ASSERT_EQ(lattice.tissues().size(), 1u);
    EXPECT_TRUE((lattice.tissues()[0] == Tissue{0.1, 3000}));
    EXPECT_EQ(lattice.cell_tissue(0), 0u);
    EXPECT_EQ(lattice.cell_tissue(1), 1u);
    EXPECT_TRUE(Simulation(scene(labels("poisson_ratio = 0.3\n"))).lattice().tissues().empty());
    expect_error(labels("poisson_ratio = 0.5\n"),
                 "s.toml:24:17: label.poisson_ratio = 0.5: it must be inside (-1, 0.5)");
    expect_error(labels("density = 0\n"), "s.toml:24:11: label.density = 0: it must be at least 1e-9");
}

TEST_F(VoxelBody, cell_size_may_come_from_the_file) {
    write("b.nrrd", nrrd_header("uchar", {2, 2, 2}, "raw", "spacings: 5 5 5\nunits: \"cm\" \"cm\" \"cm\"\n") +
                        std::string(8, '\x01'));
    EXPECT_DOUBLE_EQ(scene(scene_text("voxels = \"b.nrrd\"")).body.cell_size, 0.05);
    EXPECT_DOUBLE_EQ(scene(scene_text("voxels = \"b.nrrd\"\ncell_size = 2")).body.cell_size, 2);
}

TEST_F(VoxelBody, bad_bodies_are_one_line) {
    write("empty.npy", npy({2, 2, 2}, [](int, int, int) { return 0; }));
    write("two.npy", npy({2, 2, 2}, [](int i, int, int) { return 1 + 2 * i; }));
    const std::string whole = npy({2, 2, 2}, kFull);
    write("cut.npy", whole.substr(0, whole.size() - 1));
    write("text.npy", "not an array");
    write("small.nrrd",
          nrrd_header("uchar", {1, 1, 1}, "raw", "spacings: 0.5 0.5 0.5\nunits: \"um\" \"um\" \"um\"\n") + "1");
    const auto with = [](const std::string& file) { return scene_text("voxels = \"" + file + "\"\ncell_size = 1"); };
    expect_error(with("absent.npy"), "s.toml:2:10: body.voxels = \"absent.npy\": it cannot be read: No such file");
    expect_error(with("."), "s.toml:2:10: body.voxels = \".\": it is a directory");
    expect_error(with("text.npy"), "s.toml:2:10: body.voxels = \"text.npy\": by its first bytes it is neither");
    expect_error(with("cut.npy"), "s.toml:2:10: body.voxels = \"cut.npy\": it is cut short");
    expect_error(with("empty.npy"), "s.toml:2:10: body.voxels = \"empty.npy\": the body is empty");
    expect_error(with("two.npy"),
                 "s.toml:2:10: body.voxels = \"two.npy\": it has the labels 1, 3; where there is more");
    const auto labels = [](const std::string& tables) {
        return scene_text("voxels = \"two.npy\"\ncell_size = 1", "0.3", "[[label]]\n" + tables);
    };
    expect_error(labels("value = 1\nyoung_modulus = 1e4"),
                 "s.toml:2:10: body.voxels = \"two.npy\": label 3 (4 cells) has no [[label]]; it has the labels 1, 3");
    expect_error(labels("value = 1\nyoung_modulus = 0\n[[label]]\nvalue = 3\nyoung_modulus = 0"),
                 "s.toml:2:10: body.voxels = \"two.npy\": the body is empty");
    expect_error(labels("value = 1\nyoung_modulus = 1e12"),
                 "s.toml:20:17: label.young_modulus = 1e12: it must be 0, or from 1e-6 to 1e6 times");
    expect_error(labels("value = 1\nyoung_modulus = -1"), "s.toml:20:17: label.young_modulus = -1: it must be");
    expect_error(labels("value = 0\nyoung_modulus = 1"), "s.toml:19:9: label.value = 0: it must be an integer");
    expect_error(labels("value = 1\nyoung_modulus = 1\n[[label]]\nvalue = 1\nyoung_modulus = 1"),
                 "s.toml:22:9: label.value = 1: it must be an integer from 1 to 255, different");
    expect_error(scene_text("cells = [2, 2, 2]\ncell_size = 1", "0.3", "[[label]]\nvalue = 1\nyoung_modulus = 1e4"),
                 "s.toml:19:9: label.value = 1: the cells of a box have no labels");
    expect_error(scene_text("voxels = \"two.npy\""),
                 "s.toml:2:10: body.voxels = \"two.npy\": it tells no size of its voxels");
    expect_error(scene_text("voxels = \"small.nrrd\""),
                 "s.toml:2:10: body.voxels = \"small.nrrd\": its voxels have edges of");
}

/// Parts by shared faces: a pair, an L that two rows join late, and a cell that touches it along an edge only.
TEST(CellParts, are_counted_by_shared_faces) {
    const auto lattice = [](int nx, int ny, int nz, const std::vector<std::string>& rows) {
        std::vector<float> scales;
        for (const std::string& row : rows) {
            std::transform(row.begin(), row.end(), std::back_inserter(scales),
                           [](char c) { return c == '#' ? 1.0f : 0.0f; });
        }
        return Lattice::from_cells(nx, ny, nz, 1, scales);
    };
    using Sizes = std::vector<std::size_t>;
    EXPECT_EQ(cell_parts(lattice(5, 3, 1, {"##..#", "..#.#", "#####"})), (Sizes{8, 2}));
    EXPECT_EQ(cell_parts(lattice(5, 1, 2, {"#.#.#", "###.."})), (Sizes{5, 1}));
    EXPECT_EQ(cell_parts(lattice(2, 2, 2, {"#.", ".#", ".#", "#."})), (Sizes{1, 1, 1, 1}));
    EXPECT_EQ(cell_parts(lattice(1, 1, 1, {"."})), Sizes{});
    EXPECT_EQ(cell_parts(Lattice::box(4, 5, 6, 1)), (Sizes{120}));
}

TEST_F(VoxelBody, run_reports_the_body_and_warns_of_parts) {
    write("parts.npy", npy({5, 2, 1}, [](int i, int, int) { return i == 3 ? 0 : 1; }));
    write("s.toml", scene_text("voxels = \"parts.npy\"\ncell_size = 0.5"));
    const ProgramResult run = run_program("run s.toml", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_EQ(run.errors,
              "hybmss: warning: s.toml: the body has 2 parts that share no face with each other: 6 and 2 cells\n");
    EXPECT_EQ(run.output.rfind("body                     8 cells of a grid of 5 x 2 x 1, 36 nodes, ", 0), 0u)
        << run.output;
    const ProgramResult explain = run_program("explain s.toml", directory.path());
    for (const char* line : {"labels               1: 8 cells of 10000 Pa", "parts                2 parts",
                             "memory               about", "5 x 2 x 1 cells of 0.5 m"}) {
        EXPECT_NE(explain.output.find(line), std::string::npos) << line << "\n" << explain.output;
    }
}

TEST_F(VoxelBody, results_hold_the_labels_of_the_cells) {
    // Label 2 has no stiffness: its cells are not there.
    write("mixed.npy", npy({4, 1, 1}, [](int i, int, int) {
              return std::array{3, 2, 0, 1}[static_cast<std::size_t>(i)];
          }));
    write("s.toml", scene_text("voxels = \"mixed.npy\"\ncell_size = 0.5", "0.3",
                               "[[label]]\nvalue = 1\nyoung_modulus = 1e4\n[[label]]\nvalue = 2\nyoung_modulus = "
                               "0\n[[label]]\nvalue = 3\nyoung_modulus = 2e4\n"));
    const ProgramResult run = run_program("run s.toml --out made", directory.path());
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const std::string vtu = read_text(directory.path() / "made/body_0001.vtu");
    EXPECT_EQ(vtu_array<std::uint8_t>(vtu, "label"), (std::vector<std::uint8_t>{3, 1}));
    EXPECT_EQ(vtu_array<double>(vtu, "volume_ratio").size(), 2u);
}

/// The example, in which a liver hangs from the diaphragm; its file is what its script makes.
TEST(Liver, is_made_by_its_script_and_runs) {
    TemporaryDirectory directory;
    const std::string made = directory.path() / "made.npy";
    const std::string command = "python3 '" HYBMSS_SOURCE_DIR "/examples/scenes/liver.py' '" + made + "'";
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(made), read_text(HYBMSS_SOURCE_DIR "/examples/scenes/liver.npy"));

    Simulation simulation(load_scene(example("liver")));
    EXPECT_EQ(cell_parts(simulation.lattice()).size(), 1u);
    const Summary summary = simulation.run();
    ASSERT_TRUE(summary.converged) << summary.failure;
    const double weight = 1060 * 9.81 * static_cast<double>(simulation.lattice().cell_count()) * std::pow(0.008, 3);
    EXPECT_NEAR(summary.probes.at(0).force[1], weight, 1e-5 * weight);
    EXPECT_LT(summary.probes.at(1).mean_displacement[1], 0); // the tip sags
    EXPECT_GT(summary.volume.min_cell_volume_ratio, 0.5);
}

} // namespace
} // namespace hybmss
