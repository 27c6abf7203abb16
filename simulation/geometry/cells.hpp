#pragma once

/// \file
/// A body's cells: their corners and labels, the parts that they make up, and their volumes where they are deformed.

#include "hybmss/lattice.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "layouts/node_numbers.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// Of values of the grid's cells those of the body's, in their order; none where there are none.
template <class T>
std::vector<T> values_of_cells(const Lattice& lattice, std::span<const T> of_grid) {
    std::vector<T> values;
    const std::span<const float> scales = lattice.cell_scales();
    for (std::size_t cell = 0; cell < of_grid.size(); ++cell) {
        if (scales[cell] > 0) {
            values.push_back(of_grid[cell]);
        }
    }
    return values;
}

/// J - 1 of one cell with edge h: H = grad u from the means of its four parallel edges (5.14), and
///   J - 1 = tr H + I2(H) + det H,
/// which loses no digits at small strain.
double volume_ratio_minus_one(std::span<const std::array<double, 3>> displacement,
                              const std::array<std::uint32_t, 8>& corners, double cell_size);

/// `fills`: of the cells, or none where all are whole.
VolumeChange measure_volume_change(std::span<const std::array<double, 3>> displacement,
                                   std::span<const std::array<std::uint32_t, 8>> cells, double cell_size,
                                   std::span<const float> fills = {});

/// The numbers of cells of the body's parts, largest first. Cells are of one part where a path through shared faces
/// leads from one to the other; cells that share only an edge or a corner hang together as by a hinge, so they count
/// as apart. Time in proportion to the grid's cells, memory to the runs of filled cells along x.
std::vector<std::size_t> cell_parts(const Lattice& lattice);

} // namespace hybmss
