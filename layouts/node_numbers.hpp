#pragma once

#include "hybmss/lattice.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybmss {

/// The numbers of a body's nodes by their grid indices, as they were when the body was made: cuts do not renumber.
/// Nothing is stored for a full box, a number a node for other bodies.
class NodeNumbers {
public:
    /// \param body_nodes how many the body has: as many as the grid, and nothing needs to be looked up. Throws
    /// std::invalid_argument where the lattice has another number of nodes.
    NodeNumbers(const Lattice& lattice, std::size_t body_nodes);

    /// Of a grid index that belongs to a node.
    std::uint32_t of(std::size_t grid_node) const;
    /// The grid index of a node's number.
    std::size_t grid_node(std::uint32_t number) const { return nodes_.empty() ? number : nodes_[number]; }

private:
    std::vector<std::uint32_t> nodes_; ///< grid indices, ascending; empty where every grid node is one of the body
};

} // namespace hybmss
