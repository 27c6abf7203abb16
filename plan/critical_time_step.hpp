#pragma once

#include "hybmss/contact.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"

#include <span>

namespace hybmss {

/// 2 / omega with omega^2 the largest eigenvalue of one cell's stiffness by its share of the masses: no assembly of
/// cells has a larger one (Irons and Treharne's theorem on element eigenvalues), so the step is stable near rest.
double lattice_critical_time_step(const Lattice& lattice, const Material& material);

/// 2 / omega with omega^2 bounded by the largest row sum of M^-1 K (Gershgorin), each 3x3 block by its norm.
double network_critical_time_step(const Network& network);

/// 2 / sqrt(4/dt^2 + sum of the obstacles' stiffnesses): a node's own stiffness by its mass joins the body's largest
/// eigenvalue, for every obstacle that it may be in at the same time. dt: the body's own critical time step.
double contact_time_step(double body_time_step, std::span<const Obstacle> obstacles);

} // namespace hybmss
