#pragma once

/// \file
/// What CalculiX is asked, by hand or for a scene, on a lattice's cells as hexahedral finite elements, and what it
/// answers.

#include "hybmss/equilibrium.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/simulation/scene.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace hybmss::calculix {

enum class ElementType {
    c3d8i, ///< 8 nodes, trilinear with incompatible bending modes
    c3d20  ///< 20 nodes, quadratic
};

/// "C3D8I" or "C3D20", as CalculiX and Abaqus call them.
std::string_view name(ElementType type);

/// One element a cell. The first nodes are the lattice's, in its order; those in the middle of edges follow.
struct BrickMesh {
    ElementType type = ElementType::c3d8i;
    std::vector<std::array<double, 3>> rest; ///< m
    std::size_t lattice_nodes = 0;
    /// nodes_per_element() a cell, numbered from 0, in the order of Abaqus: the corners of the low z face and of the
    /// high one, counterclockwise seen from above; then the middles of the edges below, above and upright.
    std::vector<std::uint32_t> elements;
    std::vector<float> scales; ///< one an element: of the stiffness
    double cell_size = 1;      ///< m

    std::size_t nodes_per_element() const { return type == ElementType::c3d8i ? 8 : 20; }
    std::size_t element_count() const { return scales.size(); }
    /// The part of an element's weight that its nodes carry under uniform acceleration: the integral of their shape
    /// functions, 1/8 or, of the quadratic element, -1/8 at corners and 1/6 at edges.
    double weight_share(std::size_t node_of_element) const;
};

/// `origin` in m: where the grid's low corner lies.
BrickMesh brick_mesh(const Lattice& lattice, ElementType type, const std::array<double, 3>& origin = {0, 0, 0});

/// Which strain the law takes.
enum class Geometry {
    linear,   ///< the small strain tensor: forces in proportion to the loading
    nonlinear ///< Green's strain: *STEP, NLGEOM
};

/// "linear" or "NLGEOM".
std::string_view name(Geometry geometry);

/// The stress that belongs to a strain.
enum class Law {
    linear,   ///< *ELASTIC: stress in proportion to strain; with Green's strain that of St Venant and Kirchhoff
    neo_hooke ///< *HYPERELASTIC: G/2 (J^(-2/3) tr F^T F - 3) + K/2 (J - 1)^2; with Geometry::nonlinear only
};

/// A static problem.
struct Problem {
    BrickMesh mesh;
    Material material; ///< Young's modulus, Poisson's ratio and density; what belongs to springs alone is not used
    Loading loading;   ///< by the mesh's nodes; forces, where there are any, one a node
    Geometry geometry = Geometry::linear;
    Law law = Law::linear;
    bool stresses = false; ///< wanted of the solution
};

struct Solution {
    std::vector<std::array<double, 3>> displacements; ///< m, one a node of the mesh
    std::vector<std::array<double, 3>> support;       ///< N: what supports exert; zero on nodes that are free
    /// Pa, where wanted one an element: the mean of the Cauchy stress over its points of integration; xx, yy, zz, xy,
    /// yz, xz.
    std::vector<std::array<double, 6>> stresses;
    int iterations = 0; ///< of Newton's method, over all increments
    double seconds = 0; ///< of the whole program
};

/// The scene's cells, material, supports at the end of their motions, loads and gravity; damping and the solver's
/// choices do not matter at rest. Regions hold the nodes in the middle of edges as they do corners, but loads act on
/// corners alone. Throws SceneError as a Simulation does.
Problem scene_problem(const Scene& scene, ElementType type, Geometry geometry, Law law = Law::linear);

} // namespace hybmss::calculix
