#pragma once

/// \file
/// What is read of a body's state: what its supports carry and what is left unbalanced.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/scene/scene_body.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// Forces on nodes at one moment, one entry a node.
struct NodalForces {
    std::span<const Vector3> internal;   ///< N
    std::span<const double> masses;      ///< kg
    Vector3 gravity = {0, 0, 0};         ///< m/s^2
    double mass_damping = 0;             ///< 1/s
    std::span<const Vector3> loads = {}; ///< N; or none at all
    double part = 1;                     ///< of the loads that is there

    double load(std::size_t node, std::size_t axis) const { return loads.empty() ? 0 : part * loads[node][axis]; }
};

/// Support forces, one vector a node: zero on free axes, on held ones
///   R = m (a + c v) - f - m g - load.
std::vector<Vector3> support_forces(const NodalForces& forces, std::span<const PrescribedNode> held,
                                    std::span<const Vector3> accelerations);

/// Largest |f + m g + load| on a free axis over the largest one on a held axis or the largest weight or load of a node.
/// `floor` (N) bounds the denominator below, so that a body at rest without loads is in balance.
double relative_residual(const NodalForces& forces, std::span<const PrescribedNode> held, double floor);

/// A probe's nodes.
struct ProbeNodes {
    std::string name;
    std::vector<std::uint32_t> nodes;
    Vector3 centroid = {0, 0, 0}; ///< m, at rest
};

ProbeReading read_probe(const ProbeNodes& probe, std::span<const Vector3> rest, std::span<const Vector3> displacements,
                        std::span<const Vector3> support);

} // namespace hybmss
