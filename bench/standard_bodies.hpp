#pragma once

/// \file
/// The bodies that timings and checks are made on, each once.

#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

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

/// A ball of tissue that fills its grid of edge^3 cells: soft outside, a hundred times as stiff in an inner ball, with
/// a tube a fifth as stiff through both.
inline Lattice labelled_tissue(int edge, double cell_size) {
    Lattice lattice = Lattice::box(edge, edge, edge, cell_size);
    const double middle = edge / 2.0;
    for (int k = 0; k < edge; ++k) {
        for (int j = 0; j < edge; ++j) {
            for (int i = 0; i < edge; ++i) {
                const double x = i + 0.5 - middle, y = j + 0.5 - middle, z = k + 0.5 - middle;
                const double radius = std::hypot(x, y, z);
                lattice.set_cell_scale(i, j, k,
                                       radius > middle                   ? 0.0f
                                       : std::hypot(x, z) < 0.2 * middle ? 0.2f
                                       : radius < 0.5 * middle           ? 100.0f
                                                                         : 1.0f);
            }
        }
    }
    return lattice;
}

/// A box of which each cell is there with that probability.
inline Lattice scattered_cells(const std::array<int, 3>& cells, double share, double cell_size) {
    Lattice lattice = Lattice::box(cells[0], cells[1], cells[2], cell_size);
    std::mt19937 random(1);
    for (int k = 0; k < cells[2]; ++k) {
        for (int j = 0; j < cells[1]; ++j) {
            for (int i = 0; i < cells[0]; ++i) {
                if (static_cast<double>(random()) >= share * 4294967296.0) {
                    lattice.set_cell_scale(i, j, k, 0.0f);
                }
            }
        }
    }
    return lattice;
}

/// The same network with its nodes numbered, and its springs and cells listed, at random.
inline Network shuffled(const Network& network, unsigned seed) {
    std::mt19937 random(seed);
    const std::size_t nodes = network.masses.size();
    std::vector<std::int32_t> number(nodes);
    std::iota(number.begin(), number.end(), 0);
    std::shuffle(number.begin(), number.end(), random);
    const auto renumbered = [&](std::int32_t n) { return number[static_cast<std::size_t>(n)]; };

    Network result = network;
    for (std::size_t n = 0; n < nodes; ++n) {
        const auto to = static_cast<std::size_t>(number[n]);
        result.rest_positions[to] = network.rest_positions[n];
        result.masses[to] = network.masses[n];
    }
    for (Network::Spring& spring : result.springs) {
        spring.a = renumbered(spring.a);
        spring.b = renumbered(spring.b);
    }
    for (Network::Cell& cell : result.cells) {
        std::transform(cell.nodes.begin(), cell.nodes.end(), cell.nodes.begin(), renumbered);
    }
    std::shuffle(result.springs.begin(), result.springs.end(), random);
    std::shuffle(result.cells.begin(), result.cells.end(), random);
    return result;
}

/// Two networks as one, the second moved by `offset`; a spring of that stiffness joins every two nodes, one of each,
/// that are at most `reach` apart.
inline Network glued(const Network& first, const Network& second, const std::array<double, 3>& offset, double reach,
                     double stiffness) {
    Network both = first;
    const auto nodes = static_cast<std::int32_t>(first.masses.size());
    both.masses.insert(both.masses.end(), second.masses.begin(), second.masses.end());
    for (const auto& [x, y, z] : second.rest_positions) {
        both.rest_positions.push_back({x + offset[0], y + offset[1], z + offset[2]});
    }
    for (Network::Spring spring : second.springs) {
        spring.a += nodes;
        spring.b += nodes;
        both.springs.push_back(spring);
    }
    for (Network::Cell cell : second.cells) {
        for (std::int32_t& node : cell.nodes) {
            node += nodes;
        }
        both.cells.push_back(cell);
    }
    for (std::int32_t a = 0; a < nodes; ++a) {
        for (auto b = nodes; b < static_cast<std::int32_t>(both.masses.size()); ++b) {
            const auto &p = both.rest_positions[static_cast<std::size_t>(a)],
                       &q = both.rest_positions[static_cast<std::size_t>(b)];
            const std::array<double, 3> rest = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
            if (std::hypot(rest[0], rest[1], rest[2]) <= reach) {
                both.springs.push_back({a, b, stiffness, rest});
            }
        }
    }
    return both;
}

} // namespace hybmss
