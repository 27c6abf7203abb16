#pragma once

#include "hybmss/simulation/scene.hpp"

namespace hybmss {

/// The scene itself; for one that was filled by hand what the parser has seen to otherwise: every number in the range
/// of its key. Throws SceneError.
Scene within_ranges(Scene scene);

} // namespace hybmss
