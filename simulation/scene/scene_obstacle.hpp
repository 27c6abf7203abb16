#pragma once

#include "simulation/scene/scene_table.hpp"

namespace hybmss {

/// Appends the obstacle of one [[obstacle]]. Throws SceneError.
void read_obstacle(Scene& scene, const SceneTable& table);

} // namespace hybmss
