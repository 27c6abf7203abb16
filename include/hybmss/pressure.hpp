#pragma once

/// \file
/// Pressure on the faces of a body's cells, which follows them as they move and turn.

#include "hybmss/export.h"
#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// A face of a cell: its nodes, counter-clockwise seen from outside of the cell.
struct SurfaceFace {
    std::array<std::uint32_t, 4> nodes = {0, 0, 0, 0};
    std::array<std::array<double, 3>, 4> rest_positions = {}; ///< m

    /// m: the mean of its corners at rest.
    std::array<double, 3> middle() const {
        std::array<double, 3> mean = {0, 0, 0};
        for (const auto& x : rest_positions) {
            for (std::size_t a = 0; a < 3; ++a) {
                mean[a] += x[a] / 4;
            }
        }
        return mean;
    }
};

/// The faces of cells that no other cell shares, those around hollows too, cell by cell. `origin`: the low corner of
/// the grid, m. O(cells).
HYBMSS_EXPORT std::vector<SurfaceFace> surface_faces(const Lattice& lattice,
                                                     const std::array<double, 3>& origin = {0, 0, 0});
/// Likewise, as far as the network has cells.
HYBMSS_EXPORT std::vector<SurfaceFace> surface_faces(const Network& network);

/// Sets the rest positions of faces whose nodes are known. Throws std::invalid_argument for a node that is not there.
HYBMSS_EXPORT void set_rest_positions(const Lattice& lattice, std::span<SurfaceFace> faces,
                                      const std::array<double, 3>& origin = {0, 0, 0});
HYBMSS_EXPORT void set_rest_positions(const Network& network, std::span<SurfaceFace> faces);

} // namespace hybmss
