#pragma once

#include "dynamics/contact/obstacle_geometry.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The cells of a body as others touch them: corners by the bits of their number, faces in the order -x +x -y +y -z +z
/// of the cell's own axes.
struct BodyCells {
    /// More layers than that are told as so many.
    static constexpr std::uint8_t kDeep = 255;

    std::vector<std::array<std::uint32_t, 8>> corners;
    /// How many cells lie between this one and the surface, through each face and on: 0 where the face is free.
    std::vector<std::array<std::uint8_t, 6>> layers;
    std::vector<std::uint32_t> outer;         ///< cells of the two layers next to the surface, ascending
    std::vector<std::uint32_t> surface;       ///< nodes of free faces, ascending; all nodes where there are no cells
    std::vector<std::uint32_t> first_cell_of; ///< by node, and one more: into cells_of
    std::vector<std::uint32_t> cells_of;      ///< ascending for each node
    double edge = 0;                          ///< m: the longest edge of a cell at rest

    BodyCells() = default;
    BodyCells(std::vector<std::array<std::uint32_t, 8>> cells, const std::vector<Point>& rest);
};

/// Weights of a cell's corners at a place in it, 0 .. 1 along its axes.
inline std::array<double, 8> trilinear_weights(const Point& xi) {
    std::array<double, 8> weights;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        double weight = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            weight *= corner >> a & 1 ? xi[a] : 1 - xi[a];
        }
        weights[corner] = weight;
    }
    return weights;
}

/// Where in a cell a point is. `gradient`: row a is that of the cell's coordinate a, 1/m.
struct PlaceInCell {
    Point xi;
    Matrix gradient;

    Point slope(std::size_t axis) const { return {gradient[3 * axis], gradient[3 * axis + 1], gradient[3 * axis + 2]}; }
};

/// The place of `x` in a cell with these corners, by Newton's method; it may lie somewhat beside the cell. Nothing
/// where the cell is inside out there, or where the place is far away.
std::optional<PlaceInCell> place_in_cell(const std::array<Point, 8>& corners, const Point& x);

} // namespace hybmss
