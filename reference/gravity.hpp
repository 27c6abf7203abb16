#pragma once

/// \file
/// A uniform acceleration g, m/s^2.

#include "reference/body.hpp"

#include <span>
#include <vector>

namespace hybmss::reference {

/// The weights of the nodes, N.
std::vector<Vector3d> gravity_forces(const Body& body, const Vector3d& g);

/// J, zero at rest.
double gravity_energy(const Body& body, std::span<const Vector3d> u, const Vector3d& g);

} // namespace hybmss::reference
