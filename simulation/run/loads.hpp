#pragma once

/// \file
/// A scene's loads as forces on nodes.

#include "hybmss/simulation/scene.hpp"
#include "simulation/run/motion.hpp"

#include <span>
#include <vector>

namespace hybmss {

/// The sum of all [[load]]s on each node, N; nothing at all where the scene has none. Throws SceneError where a region
/// is empty.
std::vector<Vector3> nodal_loads(const Scene& scene, const Lattice& lattice, std::span<const Vector3> rest);

} // namespace hybmss
