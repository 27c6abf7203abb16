// The layout active-rows: every cell finds its corners, with the numbers that flat rows hold.

#include "layouts/lattice/lattice_arrays.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace hybmss {
namespace {

using Place = std::array<std::size_t, 3>; ///< along the layout's axes

Lattice scattered(int nx, int ny, int nz, unsigned percent, unsigned seed) {
    std::mt19937 engine(seed);
    std::vector<float> scales(static_cast<std::size_t>(nx * ny * nz));
    for (float& scale : scales) {
        scale = engine() % 100 < percent ? 0.1f + static_cast<float>(engine() % 1000) / 400 : 0.0f;
    }
    return Lattice::from_cells(nx, ny, nz, 0.5, std::move(scales));
}

/// The layout's index of each of the body's nodes.
template <class T>
std::map<Place, std::size_t> indices(const Lattice& lattice, const LatticeArrays<T>& layout) {
    std::map<Place, std::size_t> all;
    const auto nx = static_cast<std::size_t>(lattice.cells()[0]) + 1;
    const auto ny = static_cast<std::size_t>(lattice.cells()[1]) + 1;
    std::size_t node = 0;
    for (const std::uint32_t n : lattice.nodes()) {
        const std::size_t at[3] = {n % nx, n / nx % ny, n / nx / ny};
        all[{at[layout.axes[0]], at[layout.axes[1]], at[layout.axes[2]]}] = index_in(layout.runs, node++);
    }
    return all;
}

double scale_at(const Lattice& lattice, const LatticeAxes& axes, const Place& cell) {
    std::array<int, 3> at{};
    for (std::size_t c = 0; c < 3; ++c) {
        if (cell[c] >= static_cast<std::size_t>(lattice.cells()[axes[c]])) {
            return 0;
        }
        at[axes[c]] = static_cast<int>(cell[c]);
    }
    return static_cast<double>(lattice.cell_scale(at[0], at[1], at[2]));
}

void expect_corners_found(const Lattice& lattice, int width) {
    const auto layout = active_rows<double>(lattice, Material{}, width);
    const auto index = indices(lattice, layout);
    const auto w = static_cast<std::size_t>(width);
    ASSERT_EQ(layout.masses.size(), index.size());
    std::size_t filled = 0;
    for (const auto& [place, n] : index) {
        EXPECT_GT(layout.inverse_mass[n], 0.0);
        if (!(scale_at(lattice, layout.axes, place) > 0)) {
            continue;
        }
        ++filled;
        const std::size_t k = place[2], lane = (n - layout.begin[k]) % w;
        const VectorNeighbors& neighbors = layout.neighbors[n / w - k - 1];
        const std::size_t rows[4] = {n, layout.begin[k] + static_cast<std::size_t>(neighbors.low_y) + lane,
                                     layout.begin[k + 1] + static_cast<std::size_t>(neighbors.high) + lane,
                                     layout.begin[k + 1] + static_cast<std::size_t>(neighbors.high_y) + lane};
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const Place there = {place[0] + (corner & 1), place[1] + (corner >> 1 & 1), place[2] + (corner >> 2)};
            EXPECT_EQ(rows[corner >> 1] + (corner & 1), index.at(there)) << "corner " << corner;
        }
    }
    EXPECT_EQ(filled, lattice.cell_count());
}

TEST(ActiveRowsLayout, EveryCellFindsItsCorners) {
    for (const int width : {2, 4, 8, 16}) {
        SCOPED_TRACE(width);
        expect_corners_found(Lattice::box(1, 1, 1, 0.5), width);
        expect_corners_found(Lattice::box(16, 3, 2, 0.5), width);
        expect_corners_found(Lattice::box(3, 2, 31, 0.5), width);
        for (const unsigned percent : {3u, 20u, 60u}) {
            expect_corners_found(scattered(35, 6, 7, percent, percent), width);
            expect_corners_found(scattered(4, 40, 5, percent, percent), width);
        }
    }
}

TEST(ActiveRowsLayout, HoldsTheNumbersOfFlatRows) {
    const Lattice lattice = scattered(20, 7, 9, 40, 1);
    const auto active = active_rows<double>(lattice, Material{}, 8);
    const auto flat = flat_rows<double>(lattice, Material{}, plain_axes(lattice));
    ASSERT_EQ(active.axes, flat.axes); // else kinds would have to be matched
    EXPECT_EQ(active.masses, flat.masses);
    EXPECT_EQ(active.volume_ratio, flat.volume_ratio);
    const auto index = indices(lattice, active), expected = indices(lattice, flat);
    double stored[2] = {0, 0};
    for (const auto& [place, n] : index) {
        const std::size_t m = expected.at(place);
        EXPECT_EQ(active.inverse_mass[n], flat.inverse_mass[m]);
        for (std::size_t kind = 0; kind < 7; ++kind) {
            EXPECT_EQ(active.stiffness[kind][n], flat.stiffness[kind][m]);
        }
    }
    // And nothing but zeros elsewhere.
    for (const LatticeArrays<double>* layout : {&active, &flat}) {
        for (const auto& array : layout->stiffness) {
            for (std::size_t n = 0; n < layout->size(); ++n) {
                stored[layout == &flat] += array[n];
            }
        }
    }
    EXPECT_NEAR(stored[0], stored[1], 1e-12 * stored[1]);
}

TEST(ActiveRowsLayout, RowsLieWhereTheyAreFullest) {
    // A bar along z: rows of 3 nodes waste vectors of 16, rows of 49 do not.
    EXPECT_EQ(count_active_lanes(Lattice::box(2, 2, 48, 1.0), 16).axes[0], 2u);
    EXPECT_EQ(count_active_lanes(Lattice::box(47, 9, 9, 1.0), 16).axes[0], 0u);
    // Equal sides: along x, whose nodes make the longest runs.
    EXPECT_EQ(count_active_lanes(Lattice::box(15, 15, 15, 1.0), 16).axes[0], 0u);
    // 3 vectors a row of 48 nodes, 10 x 10 rows, and a void one a plane.
    EXPECT_EQ(count_active_lanes(Lattice::box(47, 9, 9, 1.0), 16).lanes, 16u * (3 * 100 + 10));
}

} // namespace
} // namespace hybmss
