#pragma once

/// \file
/// What CalculiX is asked, by hand or for a scene, and what it answers.

#include "hybmss/equilibrium.hpp"
#include "hybmss/material.hpp"
#include "hybmss/simulation/scene.hpp"
#include "studies/calculix/brick_mesh.hpp"

#include <array>
#include <vector>

namespace hybmss::calculix {

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
};

struct Solution {
    std::vector<std::array<double, 3>> displacements; ///< m, one a node of the mesh
    std::vector<std::array<double, 3>> support;       ///< N: what supports exert; zero on nodes that are free
    int iterations = 0;                               ///< of Newton's method, over all increments
    double seconds = 0;                               ///< of the whole program
};

/// The scene's cells, material, supports at the end of their motions, loads and gravity; damping and the solver's
/// choices do not matter at rest. Regions hold the nodes in the middle of edges as they do corners, but loads act on
/// corners alone. Throws SceneError as a Simulation does.
Problem scene_problem(const Scene& scene, ElementType type, Geometry geometry, Law law = Law::linear);

} // namespace hybmss::calculix
