#pragma once

/// \file
/// Lattices of tetrahedra, pyramids and triangular prisms whose springs are exactly isotropic, and any mesh of such
/// cells with springs that are as near to it as they can be.

#include "hybmss/export.h"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hybmss {

/// A box of so many cubes, a node in the middle of each, and tetrahedra around the faces between two of them: between
/// both middles and each of the face's edges. Faces of the box are closed by pyramids. With the shear modulus G and the
/// cube's edge a, springs of the length a have G a, those from middles to corners 3 G a / 2, a quarter and a sixth of
/// that by tetrahedron. Network::nodal_volumes keeps it from locking near nu = 1/2.
///
/// The low corner is the origin; corners come first, x fastest, then middles. Each cell gives its nodes equal parts of
/// its mass. The ratio of face to cube diagonals does nothing. Throws std::invalid_argument as Network::from_lattice()
/// does, and for springs on means and crush resistance.
HYBMSS_EXPORT Network tetrahedron_lattice(const std::array<int, 3>& cells, double edge, const Material& material);

/// Likewise of six pyramids a cube, on its faces: edges have 2 G a, springs from middles to corners 3 G a / 2.
HYBMSS_EXPORT Network pyramid_lattice(const std::array<int, 3>& cells, double edge, const Material& material);

/// Triangular prisms of the height h on equilateral triangles of the edge a, 2 cells[0] cells[1] a layer: a
/// parallelogram, whose second side leans by 60 degrees from x in the plane of x and y. With l^2 = a^2 + h^2 and V =
/// sqrt(3)/2 a^2 h, diagonals of rectangles have G l^2 V / (3 a^2 h^2), edges of triangles (8 G V / (3 a^2)) (1 - a^2 /
/// (4 h^2)), edges along z (G V / h^2) (3 - 2 h^2 / a^2): none is negative for a/2 <= h <= sqrt(3/2) a, which is
/// required.
HYBMSS_EXPORT Network prism_lattice(const std::array<int, 3>& cells, double edge, double height,
                                    const Material& material);

struct HYBMSS_EXPORT CellMesh {
    std::vector<std::array<double, 3>> nodes; ///< m
    std::vector<Network::Polyhedron> cells;   ///< whose kappa does nothing

    bool operator==(const CellMesh& other) const;
};

/// The tetrahedra of a file, those of all its parts, and the nodes that these have: Gmsh's .msh of version 2.2 or 4.1,
/// or VTK's legacy .vtk with an unstructured grid, both as plain text. Other cells than tetrahedra are passed over.
/// Throws std::invalid_argument that names file and place for what cannot be read, and for a file without tetrahedra.
HYBMSS_EXPORT CellMesh read_tetrahedra(const std::string& path);

/// Likewise with pyramids and prisms; points, lines and surfaces are passed over, other solid cells refused.
HYBMSS_EXPORT CellMesh read_cells(const std::string& path);

/// A mesh with springs between all nodes of each cell, and how good they are. Springs around a node, by half of each,
/// should have the tensor C_ijkl = G (d_ij d_kl + d_ik d_jl + d_il d_jk) of the volume around it; in general no
/// stiffnesses do so. They are the least squares of all nodes' misfits that are not negative.
struct FittedCells {
    Network network;          ///< with volumes of nodes where there are tetrahedra
    double misfit = 0;        ///< |C - wanted| / |wanted| around nodes, root mean square by volume
    double anisotropy = 0;    ///< the same of the mean of C over the body
    double modulus_error = 0; ///< of the mean of the shear modulus, relative, while nodes go with a homogeneous strain
    std::size_t without = 0;  ///< pairs of nodes that got no stiffness, and have no spring
};

/// `most_anisotropy`, above 0: what anisotropy and modulus error may be. What nodes do within a homogeneous strain
/// softens the body besides: measure what matters. Cells may have either orientation. Throws
/// std::invalid_argument for a mesh that is none, as the lattices do, and where the fit is worse than allowed, with its
/// figures.
HYBMSS_EXPORT FittedCells fit_springs(const CellMesh& mesh, const Material& material, double most_anisotropy = 0.1);

} // namespace hybmss
