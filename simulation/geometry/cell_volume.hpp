#pragma once

/// \file
/// Volumes of deformed cells.

#include "hybmss/simulation/simulation.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// The corners of the body's cells as node indices; cells in grid order, corners by the bits of their number.
std::vector<std::array<std::uint32_t, 8>> cell_corners(const Lattice& lattice);

/// The labels of the same cells, in the same order; none where the body has none.
std::vector<std::uint8_t> cell_labels(const Lattice& lattice, std::span<const std::uint8_t> grid_labels);

/// J - 1 of one cell with edge h: H = grad u from the means of its four parallel edges (5.14), and
///   J - 1 = tr H + I2(H) + det H,
/// which loses no digits at small strain.
double volume_ratio_minus_one(std::span<const std::array<double, 3>> displacement,
                              const std::array<std::uint32_t, 8>& corners, double cell_size);

VolumeChange measure_volume_change(std::span<const std::array<double, 3>> displacement,
                                   std::span<const std::array<std::uint32_t, 8>> cells, double cell_size);

} // namespace hybmss
