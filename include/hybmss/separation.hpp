#pragma once

/// \file
/// Cuts along the faces of cells: nodes are doubled, and nothing is lost.

#include "hybmss/network.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// A body cut along faces, and where its nodes come from.
struct SeparatedNetwork {
    Network network;
    std::vector<std::uint32_t> lattice_nodes; ///< of each node: its number in the lattice's order
};

/// The network of a lattice whose cells have parted along faces. `faces`: two cells that share one, as
/// Lattice::cell_index() gives them, in either order. Around a grid node cells keep one node where a way from cell to
/// cell leads through faces that hold, and have each their own where none does: a slit opens up to its rim. Each side
/// keeps its cells' shares of springs and masses (section 5.4 of the paper), so that the sum of the masses is the
/// lattice's. Nodes stand in the lattice's order, copies behind each other.
///
/// Without faces that is Network::from_lattice(), up to the order of the springs; cells that touch along an edge or in
/// a corner alone share no node here. A state is carried over by `lattice_nodes`: copies begin where their node is.
/// Throws std::invalid_argument as from_lattice() does, and for cells that are not there or share no face.
HYBMSS_EXPORT SeparatedNetwork separate(const Lattice& lattice, const Material& material,
                                        std::span<const std::array<std::uint32_t, 2>> faces);

} // namespace hybmss
