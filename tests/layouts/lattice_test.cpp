#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"
#include "layouts/lattice/lattice_arrays.hpp"
#include "reference/body.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <span>

namespace hybmss::testing {
namespace {

TEST(Lattice, CountsOfThePapersTableSix) {
    struct Row {
        int nx, ny, nz;
        std::size_t without_face_diagonals, springs, vertices;
    };
    const Row rows[] = {
        {10, 10, 10, 7630, 19630, 1331},     {15, 15, 15, 25020, 65520, 4096},    {20, 20, 20, 58460, 154460, 9261},
        {30, 30, 30, 194490, 518490, 29791}, {4, 4, 24, 3136, 7744, 625},         {8, 8, 48, 23232, 60096, 3969},
        {10, 10, 60, 44680, 116680, 7381},   {16, 16, 96, 178816, 473728, 28033},
    };
    for (const Row& row : rows) {
        SCOPED_TRACE(row.springs);
        const Lattice lattice = Lattice::box(row.nx, row.ny, row.nz, 0.1);
        EXPECT_EQ(lattice.unmerged_springs(true).total(), row.springs);
        EXPECT_EQ(lattice.unmerged_springs(false).total(), row.without_face_diagonals);
        EXPECT_EQ(lattice.merged_springs(false).total(), row.without_face_diagonals);
        EXPECT_EQ(lattice.nodes().size(), row.vertices);
        EXPECT_EQ(lattice.grid_node_count(), row.vertices);
        EXPECT_EQ(lattice.cell_count(), static_cast<std::size_t>(row.nx * row.ny * row.nz));
    }
}

TEST(Lattice, MergedCountsOfTheTenCube) {
    const SpringCounts counts = Lattice::box(10, 10, 10, 0.5).merged_springs();
    EXPECT_EQ(counts.edges, 3630u);
    EXPECT_EQ(counts.face_diagonals, 6600u);
    EXPECT_EQ(counts.cube_diagonals, 4000u);
    EXPECT_EQ(counts.total(), 14230u);
}

TEST(Lattice, MergedCountsAreTheSpringsOfTheAssembledBody) {
    for (unsigned seed = 1; seed <= 8; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const int nx = 1 + static_cast<int>(random.below(5)), ny = 1 + static_cast<int>(random.below(5)),
                  nz = 1 + static_cast<int>(random.below(5));
        const Lattice lattice = random_lattice(nx, ny, nz, 0.5, random, 0.6);
        for (double ratio : {0.0, 1.0}) {
            const reference::Body body = reference::assemble(lattice, {1e4, 0.3, 1000, ratio});
            const SpringCounts counts = lattice.merged_springs(ratio > 0);
            EXPECT_EQ(counts.total(), body.springs.size());
            EXPECT_EQ(lattice.cell_count(), body.cells.size());
            EXPECT_EQ(lattice.nodes().size(), body.rest.size());
        }
    }
}

TEST(Lattice, NodesOfABoxAreAllGridNodesXFastest) {
    const Lattice lattice = Lattice::box(2, 3, 4, 0.25);
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    std::size_t n = 0;
    for (int k = 0; k <= 4; ++k) {
        for (int j = 0; j <= 3; ++j) {
            for (int i = 0; i <= 2; ++i, ++n) {
                EXPECT_EQ(nodes[n], n);
                EXPECT_EQ(lattice.grid_node_index(i, j, k), n);
                const std::array<double, 3> expected{0.25 * i, 0.25 * j, 0.25 * k};
                EXPECT_EQ(lattice.rest_position(n), expected);
            }
        }
    }
    EXPECT_EQ(nodes.size(), n);
    EXPECT_EQ(lattice.cell_index(1, 2, 3), 23u);
    EXPECT_EQ(lattice.cell_index(1, 0, 0), 1u);
    EXPECT_EQ(lattice.cell_index(0, 1, 0), 2u);
    EXPECT_EQ(lattice.cell_index(0, 0, 1), 6u);
}

TEST(Lattice, NodesOfAMaskTouchAFilledCell) {
    // Two cells at opposite corners of a 3 x 1 x 1 row: the middle one is empty, yet all its corners belong to a cell.
    Lattice row = Lattice::from_cells(3, 1, 1, 1, {1, 0, 2});
    EXPECT_EQ(row.nodes().size(), 16u);
    EXPECT_EQ(row.cell_count(), 2u);
    EXPECT_EQ(row.merged_springs().total(), 2 * (12u + 12u + 4u));
    row.set_cell_scale(2, 0, 0, 0);
    const std::vector<std::uint32_t> left{0, 1, 4, 5, 8, 9, 12, 13};
    EXPECT_EQ(row.nodes(), left);
    EXPECT_EQ(row.cell_scale(0, 0, 0), 1.0f);
    const std::array<int, 3> last{0, 0, 0};
    row.remove_cells({&last, 1});
    EXPECT_TRUE(row.nodes().empty());
    EXPECT_EQ(row.cell_count(), 0u);
    EXPECT_EQ(row.merged_springs().total(), 0u);
}

TEST(Lattice, RefusesWhatIsOutOfRange) {
    expect_refusal([] { Lattice::box(0, 1, 2, 1); }, {"cells = [0, 1, 2]", "at least 1"});
    expect_refusal([] { Lattice::box(1, 1, -2, 1); }, {"cells = [1, 1, -2]", "at least 1"});
    expect_refusal([] { Lattice::box(2000, 2000, 2000, 1); }, {"at most 1e9"});
    for (double h : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        expect_refusal([&] { Lattice::box(1, 1, 1, h); }, {"cell_size = ", "at least 1e-9"});
    }
    expect_refusal([] { Lattice::from_cells(2, 1, 1, 1, {1}); }, {"1 values given", "2 needed"});
    expect_refusal([] { Lattice::from_cells(1, 1, 1, 1, {-1}); }, {"cell scale = -1", "at least 0"});
    Lattice lattice = Lattice::box(2, 2, 2, 1);
    expect_refusal([&] { lattice.set_cell_scale(0, 0, 0, std::nanf("")); }, {"cell scale = ", "at least 0"});
    expect_refusal([&] { lattice.set_cell_scale(2, 0, 0, 1); }, {"cell (2, 0, 0)", "outside"});
    expect_refusal([&] { static_cast<void>(lattice.cell_scale(0, -1, 0)); }, {"cell (0, -1, 0)", "outside"});
}

/// What a cell holds of its material it has of both stiffness and mass; its stable step is a whole one's.
TEST(Lattice, FillsScaleStiffnessAndMass) {
    const Material body = {.young_modulus = 1e4, .poisson_ratio = 0.3, .density = 1000};
    Material other = body;
    other.young_modulus = 3e4;
    other.density = 500;
    const std::uint8_t labels[] = {1, 2, 0};
    const Material both[] = {body, other};
    const float fills[] = {0.5f, 1.25f, 0};
    const Lattice lattice = Lattice::from_materials(3, 1, 1, 0.1, labels, both, fills);
    EXPECT_EQ(lattice.cell_scale(0, 0, 0), 0.5f);
    EXPECT_EQ(lattice.cell_scale(1, 0, 0), 3.75f);
    EXPECT_EQ(lattice.cell_scale(2, 0, 0), 0.0f);
    const Network network = Network::from_lattice(lattice, body);
    EXPECT_NEAR(network.masses[0], 0.5 * 1000 * 1e-3 / 8, 1e-12);
    EXPECT_NEAR(network.masses[1], (0.5 * 1000 + 1.25 * 500) * 1e-3 / 8, 1e-12);
    for (const LatticeAxes& axes : {LatticeAxes{0, 1, 2}, LatticeAxes{2, 0, 1}}) {
        EXPECT_EQ(flat_rows<double>(lattice, body, axes).masses, network.masses);
    }
    EXPECT_EQ(active_rows<double>(lattice, body, 8).masses, network.masses);

    Lattice box = Lattice::box(2, 1, 1, 1);
    EXPECT_EQ(box.cell_fill(1), 1.0f);
    expect_refusal([&] { box.set_fills({1}); }, {"fills: 1 values given", "2 needed"});
    expect_refusal([&] { box.set_fills({1, 0}); }, {"fill = 0", "of cell 1", "above 0"});
    expect_refusal([&] { box.set_fills({1, std::nanf("")}); }, {"of cell 1", "finite"});
    box.set_cell_scale(1, 0, 0, 0);
    box.set_fills({1, 0});
    expect_refusal([&] { box.set_cell_scale(1, 0, 0, 1); }, {"fill = 0", "of cell 1"});
    expect_refusal([&] { Lattice::from_materials(3, 1, 1, 1, labels, both, std::span(fills).first(2)); }, {"fills: 2"});
}

} // namespace
} // namespace hybmss::testing
