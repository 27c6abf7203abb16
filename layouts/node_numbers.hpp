#pragma once

#include "hybmss/lattice.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybmss {

// Where the nodes of a body are: in the grid, and in a layout.

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

/// The corners of the body's cells as node indices; cells in grid order, corners by the bits of their number.
std::vector<std::array<std::uint32_t, 8>> cell_corners(const Lattice& lattice);
/// Likewise of a body that has been cut since its nodes were numbered.
std::vector<std::array<std::uint32_t, 8>> cell_corners(const Lattice& lattice, const NodeNumbers& numbers);

/// The faces of cells that no other cell shares, cell by cell: grid nodes, counter-clockwise seen from outside.
std::vector<std::array<std::size_t, 4>> boundary_faces(const Lattice& lattice);

/// A run of consecutive nodes of the body that lie at even distances in the layout.
struct NodeRun {
    std::size_t node;
    std::size_t index;
    std::size_t length;
    std::size_t stride = 1;
};

/// Adds the body's next node, which lies at `index`, to the last run where that goes on there; the second of a run says
/// by which stride.
void append_node(std::vector<NodeRun>& runs, std::size_t index);

/// The layout index of a node that one of the runs holds; they ascend by node.
std::size_t index_in(const std::vector<NodeRun>& runs, std::size_t node);

} // namespace hybmss
