#pragma once

/// \file
/// A body of explicit springs and explicit cells, hexahedra or others: any assembly of cells, any extra spring.

#include "hybmss/export.h"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The shapes of cells that are no hexahedra; the value is the number of their nodes.
enum class CellShape : std::uint8_t { tetrahedron = 4, pyramid = 5, prism = 6 };

/// Explicit springs, cells and nodal masses, made from a lattice or filled by hand.
struct HYBMSS_EXPORT Network {
    struct Spring {
        std::int32_t a, b;                 ///< node indices, a != b
        double stiffness;                  ///< N/m, >= 0
        std::array<double, 3> rest_vector; ///< X_b - X_a in m; its length is the rest length, > 0
    };
    /// A hexahedron whose volume is a . (b x c), a, b, c the means of its four parallel edges (5.13, 5.14).
    struct Cell {
        std::array<std::int32_t, 8> nodes; ///< bit 0 of the corner number: high side in x, bit 1: y, bit 2: z
        double kappa;                      ///< Pa; energy kappa V0 phi(V'/V0), V0 > 0 from the rest positions
        /// Above 0: the cell has springs on its means (SpringForm::means), so many times those of Network::means, and
        /// is at rest a cube with edges along x, y, z. 0: it has a volume alone.
        double scale = 0;
    };
    /// A tetrahedron, a pyramid on four nodes or a triangular prism, with the exact volume between its faces, bilinear
    /// where they have four nodes; energy kappa V0 phi(V'/V0), V0 > 0.
    ///
    ///        3              4               5
    ///       /|\           /|\             /|\       Seen from node 3 of a tetrahedron, 4 of a pyramid or the
    ///      0-|-2         3-|-2           3---4      triangle 3 4 5 of a prism, the other nodes stand
    ///       \|/          |/ \|           | 2 |      counter-clockwise.
    ///        1           0---1           0---1
    struct Polyhedron {
        CellShape shape;
        std::array<std::int32_t, 6> nodes; ///< the first 4, 5 or 6 count
        double kappa;                      ///< Pa

        std::size_t node_count() const { return static_cast<std::size_t>(shape); }
    };
    /// Of a cell of scale 1, N/m: its springs, whole ones, cube diagonals among them, and what holds its patterns. A
    /// cube of a material has spring_constants() and pattern_constants(), which grow as its edge.
    struct Means {
        SpringConstants springs = {};
        PatternConstants patterns = {};
    };

    std::vector<std::array<double, 3>> rest_positions; ///< m, one a node
    std::vector<double> masses;                        ///< kg, one a node, > 0
    std::vector<Spring> springs;
    std::vector<Cell> cells;
    std::vector<Polyhedron> polyhedra;
    /// Of polyhedra, in place of each one's own volume: nodes resist the change of the volume around them, with the
    /// energy sum over nodes of kappa_a V_a phi(J_a), where each polyhedron gives its nodes equal parts of its volume,
    /// and kappa_a is the mean of theirs by volume. Tetrahedra lock near nu = 1/2 with volumes of their own.
    bool nodal_volumes = false;
    VolumeEnergy volume_energy = VolumeEnergy::quadratic; ///< of all cells; `none` only where each has kappa = 0
    SpringStiffening stiffening = {};                     ///< of all springs
    Means means = {};                                     ///< of cells that have a scale

    /// The lattice's body with shared springs merged; nodes in the lattice's order, springs with zero stiffness left
    /// out. On means, cells share no springs, and the network has cells alone.
    static Network from_lattice(const Lattice& lattice, const Material& material);
};

/// Throws std::invalid_argument that names the entry, the value and what is allowed.
HYBMSS_EXPORT void validate(const Network& network);

} // namespace hybmss
