#pragma once

/// \file
/// The bodies that timings and checks are made on, each once.

#include "hybmss/lattice.hpp"

#include <array>
#include <cmath>

namespace hybmss {

/// Cells of the meshes of Golec et al.'s Table 6: cubes, then bars, each list by rising number of cells.
inline constexpr std::array<std::array<int, 3>, 8> kTable6 = {
    {{10, 10, 10}, {15, 15, 15}, {20, 20, 20}, {30, 30, 30}, {4, 4, 24}, {8, 8, 48}, {10, 10, 60}, {16, 16, 96}}};

/// A ball of voxels that touches all sides of its grid of edge^3 cells, empty but for a wall of so many cells. With 64
/// and 4, a sixth of the grid is filled.
inline Lattice hollow_ball(int edge, int wall, double cell_size) {
    Lattice lattice = Lattice::box(edge, edge, edge, cell_size);
    const double outside = edge / 2.0, inside = outside - wall;
    for (int k = 0; k < edge; ++k) {
        for (int j = 0; j < edge; ++j) {
            for (int i = 0; i < edge; ++i) {
                const double radius = std::hypot(i + 0.5 - outside, j + 0.5 - outside, k + 0.5 - outside);
                if (radius > outside || radius < inside) {
                    lattice.set_cell_scale(i, j, k, 0.0f);
                }
            }
        }
    }
    return lattice;
}

} // namespace hybmss
