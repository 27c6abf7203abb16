// Matrices of merged cells by patterns are those that Galerkin's products make of each cell, where cells deform alike.
#include "solvers/multigrid/cell_patterns.hpp"
#include "tests/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybmss::testing {
namespace {

/// Cells in a box of up to two along each axis, by bits of the corners held in each; some may be missing.
struct Box {
    unsigned axes;           ///< merged along
    std::array<int, 8> held; ///< -1: no cell
};

void expect_galerkin(InstructionSet set, const Material& material, const Box& box, bool twice, Random& random) {
    const CellStiffness stiffness(Lattice::box(1, 1, 1, 0.5), material);
    float gradient[9];
    Lanes lanes[9];
    for (std::size_t e = 0; e < 9; ++e) {
        gradient[e] = static_cast<float>((e % 4 == 0 ? 0.9 : 0) + random.between(-0.2, 0.2));
        lanes[e] = in_every_lane(gradient[e]);
    }
    double u[8][3];
    for (std::size_t corner = 0; corner < 8; ++corner) {
        for (std::size_t c = 0; c < 3; ++c) {
            u[corner][c] = 0;
            for (std::size_t e = 0; e < 3; ++e) {
                const double side = corner >> e & 1 ? 0.5 : -0.5;
                u[corner][c] += (static_cast<double>(gradient[3 * c + e]) - (c == e ? 1 : 0)) * side;
            }
        }
    }
    const double scale = 1.7, pull = 0.3;
    CellPatterns patterns(stiffness.on_means());
    std::array<int, 8> cells{};
    CellMatrix expected{};
    const auto spread = [&](CellMatrix& matrix, std::size_t place) {
        for (unsigned axis = 0; axis < 3; ++axis) {
            if (box.axes >> axis & 1u) {
                spread_half(matrix, axis, place >> axis & 1);
            }
        }
    };
    for (std::size_t place = 0; place < 8; ++place) {
        if (box.held[place] < 0 || (place & ~static_cast<std::size_t>(box.axes)) != 0) {
            continue;
        }
        const auto held = static_cast<unsigned>(box.held[place]);
        cells[place] = patterns.cell(held);
        CellMatrix matrix;
        stiffness.evaluate(u, scale, 0, matrix);
        for (std::size_t a = 0; a < 8; ++a) {
            for (std::size_t e : {0u, 4u, 8u}) {
                matrix.block[a][a][e] += static_cast<float>(pull);
            }
            for (std::size_t b = 0; b < 8; ++b) {
                if ((held >> a & 1u) != 0 || (held >> b & 1u) != 0) {
                    std::fill_n(matrix.block[a][b], 9, 0.0f);
                }
            }
        }
        spread(matrix, place);
        add(matrix, expected);
    }
    int pattern = patterns.merged(box.axes, cells);
    ASSERT_GT(pattern, CellPatterns::kVoid);
    if (twice) {
        std::array<int, 8> merged{};
        CellMatrix sum{};
        for (std::size_t place = 0; place < 8; place += 3) {
            if ((place & ~static_cast<std::size_t>(box.axes)) == 0) {
                merged[place] = pattern;
                CellMatrix matrix = expected;
                spread(matrix, place);
                add(matrix, sum);
            }
        }
        pattern = patterns.merged(box.axes, merged);
        expected = sum;
    }
    EXPECT_EQ(patterns.merged(box.axes, cells), twice ? pattern - 1 : pattern) << "each once";
    CellTangents tangents;
    CellMatrices matrices;
    const std::uint8_t tissue[kLanes] = {};
    stiffness.evaluate(lanes, in_every_lane(static_cast<float>(scale)), tissue, tangents);
    TangentRow row;
    const std::size_t last = kCellsTogether - 1;
    for (std::size_t first = 0; first < kCellsTogether; first += kLanes) {
        row.set(first, tangents, in_every_lane(static_cast<float>(pull)));
    }
    const kernels::KernelTable<float>& table = kernels::kernel_table<float>(set);
    patterns[pattern].evaluate(table, row, kCellsTogether, matrices);
    float largest = 0;
    for (std::size_t a = 0; a < 8; ++a) {
        for (float entry : expected.block[a][a]) {
            largest = std::max(largest, std::abs(entry));
        }
    }
    for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
        for (std::size_t e = 0; e < 9; ++e) {
            // Sums of some hundred terms in float.
            ASSERT_NEAR(matrices.block[pair][e][last], expected.block[a][b][e], 3e-5f * largest)
                << a << " " << b << " " << e;
        }
    });
}

TEST(CellPatterns, AreGalerkinsProductsOfCellsThatDeformAlike) {
    Random random(7);
    const std::vector<InstructionSet> sets = available_instruction_sets();
    std::size_t next = 0;
    for (const double nu : {-0.3, 0.25, 0.49}) {
        for (const double crush : {0.0, 20.0}) {
            Material material{.poisson_ratio = nu};
            material.crush = {.stiffness = crush, .ratio = 0.95};
            for (const int kind : {0, 1, 2, 3}) {
                const bool twice = kind % 2 == 1;
                const InstructionSet set = sets[next++ % sets.size()];
                material.springs = kind < 2 ? SpringForm::nodes : SpringForm::means;
                expect_galerkin(set, material, {7, {0, 0, 0, 0, 0, 0, 0, 0}}, twice, random);
                expect_galerkin(set, material, {7, {0x33, 0x33, 0, 0, 0x33, 0x33, 0, 0}}, twice, random);
                expect_galerkin(set, material, {7, {0, -1, 1, 0, -1, 0, 0, 0x80}}, twice, random);
                expect_galerkin(set, material, {5, {0, 0, 0, 0, 0, 0x0f, 0, 0}}, twice, random);
            }
        }
    }
}

TEST(CellPatterns, AreNotForCellsOfTheirOwnKind) {
    CellPatterns patterns;
    const int cell = patterns.cell(0);
    EXPECT_EQ(patterns.merged(7, {}), CellPatterns::kVoid);
    EXPECT_EQ(patterns.merged(7, {cell, CellPatterns::kNone}), CellPatterns::kNone);
    int last = cell;
    for (unsigned held = 0; held < 256 && last != CellPatterns::kNone; ++held) {
        for (unsigned other = 0; other < 256 && last != CellPatterns::kNone; ++other) {
            last = patterns.merged(7, {patterns.cell(held), patterns.cell(other)});
        }
    }
    EXPECT_EQ(last, CellPatterns::kNone) << "not ever more of them";
}

} // namespace
} // namespace hybmss::testing
