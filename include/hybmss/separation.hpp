#pragma once

/// \file
/// Cuts along the faces of cells, and tears: nodes are doubled, and nothing is lost.

#include "hybmss/network.hpp"
#include "hybmss/vector_field.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// A body cut along faces, and where its nodes come from.
struct SeparatedNetwork {
    Network network;
    std::vector<std::uint32_t> lattice_nodes; ///< of each node: its number in the lattice's order
    /// Of each cell that is there, in the order of Lattice::cell_index(): its nodes, by the bits of a corner's number.
    std::vector<std::array<std::uint32_t, 8>> corners;
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
/// The faces that tear: those that hold still, and across which the mean of their two cells is stretched by more than
/// `tear_strain`, |F n| - 1 with F of the cells' mean edges and n the face's normal at rest. In ascending order, as
/// separate() takes them beside those that parted before. With displacements as they are, copies where their node is,
/// a parted body has the energy it had: each cell keeps its own. What it stored moves it from then on.
/// `displacement` (m) has a vector for each node of `body`. Throws std::invalid_argument for another size, or a
/// tear_strain that is not finite and above 0. O(cells).
HYBMSS_EXPORT std::vector<std::array<std::uint32_t, 2>> torn_faces(const Lattice& lattice, const SeparatedNetwork& body,
                                                                   VectorField<const double> displacement,
                                                                   double tear_strain);

/// For each node of `after`, the node of `before` that it comes from: `after` has more parted faces of the same
/// lattice. What a node has, its displacement and velocity, goes to its copies. Throws std::invalid_argument for bodies
/// of different cells.
HYBMSS_EXPORT std::vector<std::uint32_t> nodes_before(const SeparatedNetwork& before, const SeparatedNetwork& after);

} // namespace hybmss
