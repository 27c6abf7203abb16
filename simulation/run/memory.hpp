#pragma once

/// \file
/// Refuses bodies that the machine cannot hold, before anything is allocated.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/geometry/voxel_grid.hpp" // available_bytes

namespace hybmss {

/// Bytes that a run of these cells takes at most, about: plan, state, and copies for results.
double estimated_bytes(const SceneBody& body, const SimulationOptions& options);

/// Throws SceneError at the body where the body needs more than `available`, or more nodes than can be numbered.
void check_size(const Scene& scene, const SimulationOptions& options, double available);

} // namespace hybmss
