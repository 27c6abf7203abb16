#pragma once

/// \file
/// The body of a scene as a lattice.

#include "hybmss/simulation/scene.hpp"

#include <string>

namespace hybmss {

/// The lattice: where cells have labels, each with the stiffness of its label. Throws SceneError where no cell is
/// filled, or where it is not clear what a label stands for.
Lattice scene_lattice(const Scene& scene);

/// The key that gives the body: "body.cells", "body.voxels" or "body.surface".
std::string body_key(const SceneBody& body);

} // namespace hybmss
