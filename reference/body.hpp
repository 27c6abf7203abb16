#pragma once

/// \file
/// A body as the equations see it: nodes, springs, hexahedral cells. SI units.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "reference/constants.hpp"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace hybmss::reference {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Spring {
    int a, b;
    Vector3d rest_vector; ///< X_b - X_a, m; its length is the rest length
    double stiffness;     ///< N/m
};

/// A hexahedron. Corner number bits: bit 0 = high side in x, bit 1 = y, bit 2 = z.
struct Cell {
    std::array<int, 8> nodes;
    Matrix3d rest_edges;               ///< columns a0, b0, c0: the means of the four parallel edges at rest, m
    double kappa;                      ///< Pa
    double crush = 0, crush_ratio = 0; ///< G beta in Pa, and J0: of what resists being crushed
};

/// A tetrahedron, pyramid or prism as pieces of its exact volume: V' = sum of weight/6 (x_i - x_0) . [(x_j - x_0) x
/// (x_k - x_0)] over triangles i j k of its faces, counter-clockwise seen from outside; a face of four nodes is the
/// mean of its two divisions.
struct Polyhedron {
    struct Triangle {
        std::array<std::size_t, 3> corners;
        double weight;
    };
    std::vector<int> nodes;
    std::vector<Triangle> triangles;
    double rest_volume; ///< m^3
};

/// Volumes that are one to the energy kappa V0 phi(V'/V0): of a polyhedron; or the parts that polyhedra give a node.
struct VolumeSum {
    struct Part {
        std::size_t polyhedron;
        double share;
    };
    std::vector<Part> parts;
    double rest_volume, kappa;
};

/// The springs of a cube of HybMSS-M on its mean edges a, b, c, and what holds the patterns that these do not see.
struct MeanSprings {
    std::array<int, 8> nodes;
    double cell_size;                ///< m
    std::array<double, 3> stiffness; ///< N/m, of an edge, a face and a cube diagonal; whole ones, not shares
    HourglassStiffness hourglass;
};

struct Body {
    std::vector<Vector3d> rest; ///< rest positions X, m
    std::vector<double> mass;   ///< kg, one a node
    std::vector<Spring> springs;
    std::vector<MeanSprings> mean_springs; ///< of SpringForm::means
    std::vector<Cell> cells;               ///< those with a volume energy, or that resist being crushed
    std::vector<Polyhedron> polyhedra;
    std::vector<VolumeSum> volume_sums; ///< of polyhedra
    /// `automatic`: of every cell by itself, quadratic where its kappa is at least 0, mean stretch below.
    VolumeEnergy volume_energy = VolumeEnergy::none;
    SpringStiffening stiffening = {}; ///< of all springs
};

/// What `automatic` means: quadratic where kappa > 0, mean stretch where kappa < 0; `none` wherever kappa = 0.
VolumeEnergy resolve_volume_energy(const Material& material);

/// The lattice cell by cell, each adding its share to its springs and nodes. Nodes are numbered as in Lattice::nodes();
/// springs are sorted by (a, b) with a < b; cells are in index order. The arguments must be valid.
Body assemble(const Lattice& lattice, const Material& material);

/// The network as it stands: nodes, springs and cells in the same order. It must be valid.
Body assemble(const Network& network);

} // namespace hybmss::reference
