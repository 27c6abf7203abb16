#pragma once

/// \file
/// The files that a scene's body comes from.

#include "hybmss/simulation/scene.hpp"

namespace hybmss {

/// Reads the voxels or the surface that the body names, if any, into its cells and labels. Throws SceneError with the
/// line of the key, the file's name and what is wrong.
void read_body_files(Scene& scene);

} // namespace hybmss
