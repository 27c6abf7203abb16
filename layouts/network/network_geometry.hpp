#pragma once

#include "hybmss/network.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// The mean edges a0, b0, c0 of a cell at rest (5.14), x y z each, and its volume a0 . (b0 x c0).
struct RestShape {
    std::array<double, 9> edges;
    double volume;
};

RestShape rest_shape(const Network& network, const Network::Cell& cell);

/// What the volume of a polyhedron is made of, x y z each, linear in its nodes' places:
///
///     tetrahedron   V = 1/6 a . (b x c)                    the edges from node 0
///     pyramid       V = 1/6 a . (b x c)                    to the apex from the middle of the base; its diagonals
///     prism         V = 1/2 a . (b x c + 1/12 d x e)       the mean of its axial edges; the middle triangle's edges
///                                                          from node 0; how these differ between top and bottom
struct PolyhedronVectors {
    std::array<std::array<double, 3>, 5> vectors; ///< a, b, c, d, e
    double volume;
};
PolyhedronVectors polyhedron_vectors(const Network& network, const Network::Polyhedron& polyhedron);
/// The same of corners at these places, m.
PolyhedronVectors polyhedron_vectors(CellShape shape, const std::array<std::array<double, 3>, 6>& corners);
/// The derivatives of the volume by the corners' places, m^2.
std::array<std::array<double, 3>, 6> volume_gradient(CellShape shape,
                                                     const std::array<std::array<double, 3>, 6>& corners);

/// The numbers of the polyhedra of a shape that have a part in the energy: all, or none where it is.
std::vector<std::uint32_t> polyhedra_of(const Network& network, CellShape shape);
inline constexpr CellShape kPolyhedronShapes[] = {CellShape::tetrahedron, CellShape::pyramid, CellShape::prism};

/// Of nodal volumes, one a node: V_a, and kappa_a; 0 where a node has no polyhedron.
struct NodalVolumes {
    std::vector<double> volumes, kappas;
};
NodalVolumes nodal_volumes(const Network& network);

/// A polyhedron as a hexahedron some of whose corners are one node: its mean edges turn and grow with it, and span no
/// volume where it has none.
Network::Cell as_hexahedron(const Network::Polyhedron& polyhedron);

/// l^2 of a spring, m^2.
double rest_length2(const Network::Spring& spring);

/// visit(node, node, stiffness in N/m, rest length in m) of every spring. Of a cell with springs on its means: of some
/// of each kind, as if they joined corners.
template <class Visit>
void for_each_spring(const Network& network, const Visit& visit) {
    for (const Network::Spring& s : network.springs) {
        visit(s.a, s.b, s.stiffness, std::sqrt(rest_length2(s)));
    }
    const SpringConstants& k = network.means.springs;
    for (const Network::Cell& cell : network.cells) {
        if (cell.scale > 0) {
            const double h = rest_shape(network, cell).edges[0];
            const auto from_low = [&](std::size_t corner, double stiffness, double squares) {
                if (stiffness > 0) {
                    visit(cell.nodes[0], cell.nodes[corner], cell.scale * stiffness, std::sqrt(squares) * h);
                }
            };
            from_low(1, k.edge, 1);
            from_low(2, k.edge, 1);
            from_low(4, k.edge, 1);
            from_low(3, k.face_diagonal, 2);
            from_low(7, k.cube_diagonal, 3);
        }
    }
}

/// What a layout keeps of a cell with springs on its means: as in MeanBlock.
struct MeanCell {
    double stiffness, inverse_edge, volume_ratio;
};
MeanCell mean_cell(const Network& network, const Network::Cell& cell);

/// The cells that have springs on their means, or those that have a volume alone.
std::vector<const Network::Cell*> cells_of(const Network& network, bool on_means);

/// The points row by row and plane by plane, as a lattice numbers its nodes: entry i is the number of the i-th point.
///
///     slowest ^   4 - 5 - 6 - 7      Coordinates are rounded to multiples of `spacing` (m, > 0); the longest side of
///             |   0 - 1 - 2 - 3      the points' box counts slowest, the shortest fastest, so that a plane has few
///             +-------------->       points; among equal sides x is the fastest. Points with equal counts are sorted
///                      fastest       by the coordinate along the row.
///
/// A sweep along it works in a window of the points that lie within a spring's length of a plane.
std::vector<std::uint32_t> row_order(std::span<const std::array<double, 3>> points, double spacing);

} // namespace hybmss
