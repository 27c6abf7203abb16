#pragma once

/// \file
/// A scene as a finite element problem.

#include "hybmss/simulation/scene.hpp"
#include "studies/calculix/problem.hpp"

namespace hybmss::calculix {

/// The scene's cells, material, supports at the end of their motions, loads and gravity; damping and the solver's
/// choices do not matter at rest. Regions hold the nodes in the middle of edges as they do corners, but loads act on
/// corners alone. Throws SceneError as a Simulation does.
Problem scene_problem(const Scene& scene, ElementType type, Geometry geometry, Law law = Law::linear);

} // namespace hybmss::calculix
