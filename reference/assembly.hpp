#pragma once

/// \file
/// From a lattice or a network to a body.

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "reference/body.hpp"

namespace hybmss::reference {

/// What `automatic` means: quadratic where kappa > 0, mean stretch where kappa < 0; `none` wherever kappa = 0.
VolumeEnergy resolve_volume_energy(const Material& material);

/// The lattice cell by cell, each adding its share to its springs and nodes. Nodes are numbered as in Lattice::nodes();
/// springs are sorted by (a, b) with a < b; cells are in index order. The arguments must be valid.
Body assemble(const Lattice& lattice, const Material& material);

/// The network as it stands: nodes, springs and cells in the same order. It must be valid.
Body assemble(const Network& network);

} // namespace hybmss::reference
