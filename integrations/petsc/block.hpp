#pragma once

/// \file
/// How a grid of cells is cut into boxes, the one that a rank computes, and which of its nodes are held.

#include "integrations/petsc/petsc.hpp"

#include "hybmss/lattice.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace hybmss::distributed {

/// How many boxes of nodes a grid is cut into along each axis.
using ProcessGrid = std::array<long, 3>;

/// The cut into `ranks` boxes by which a rank has the fewest ghosts. Where several have as few, x is cut the least,
/// then y: the kernels run along x. Throws std::invalid_argument where no cut gives every rank a node.
ProcessGrid choose_process_grid(const std::array<long, 3>& nodes, long ranks);

/// Where `parts` boxes of at least one cell begin along an axis of `cells` cells, at multiples of a power of two: the
/// largest by which no box has more than 1.25 times the mean, so that cells can be merged two by two, again and again,
/// with none across a cut. Throws std::invalid_argument where there are fewer cells than parts.
std::vector<long> even_cuts(long cells, long parts);

/// The most ghosts that a rank has where `nodes` are cut so, one layer thick: those of a box of ceil(nodes/processes)
/// nodes along each axis that stands between others.
double most_ghosts(const std::array<long, 3>& nodes, const ProcessGrid& processes);

/// The whole body: a grid of cells that no rank holds all of.
struct Grid {
    std::array<PetscInt, 3> cells = {1, 1, 1};
    double cell_size = 1; ///< m
    /// The stiffness scale of the cell (i, j, k), 0 = no cell; empty: 1 everywhere. Asked on every rank, for its block.
    std::function<float(PetscInt, PetscInt, PetscInt)> scale;
};

/// A box of grid nodes, x fastest.
struct NodeBox {
    std::array<PetscInt, 3> low = {0, 0, 0}, size = {0, 0, 0};
    std::size_t count() const;
    PetscInt end(std::size_t axis) const { return low[axis] + size[axis]; }
    bool holds(PetscInt i, PetscInt j, PetscInt k) const;
    std::size_t index(PetscInt i, PetscInt j, PetscInt k) const;
    /// The inverse of index().
    std::array<PetscInt, 3> place(std::size_t index) const;
};

/// The part of a grid that one rank computes. A DMDA with a box stencil of width one gives each rank a box of nodes to
/// own, and with the ghosts one node more on every side that has a neighbour:
///
///     g g g g g     o  owned: this rank integrates it
///     g o o o g     g  ghost: a neighbour's, which sends its displacement
///     g o o o g
///     g g g g g
///
/// The rank's cells are all those between the nodes of both kinds. Every cell and spring at an owned node is one of
/// them, so the forces on owned nodes are complete, and displacements are all that ranks exchange: cells across a
/// border are computed on both sides. Adding up forces instead would save that, at the price of a second exchange that
/// waits for the first.
class Block {
public:
    /// Collective. Throws std::invalid_argument for a grid that the lattice refuses, that cannot be cut into so many
    /// boxes, or with more unknowns than PETSc can count.
    /// `cut_evenly`: by even_cuts(), which multigrid asks for; else as evenly as nodes go.
    Block(MPI_Comm communicator, const Grid& grid, bool cut_evenly = false);

    MPI_Comm communicator() const { return communicator_; }
    int rank() const { return rank_; }
    int ranks() const { return ranks_; }
    const Grid& grid() const { return grid_; }
    /// Three components a node, in the order of the ranks' boxes: one displacement or force field.
    DM nodes() const { return dm_; }
    const NodeBox& owned() const { return owned_; }
    const NodeBox& ghosted() const { return ghosted_; }

    /// This rank's cells; none where all of them are empty.
    const std::optional<Lattice>& lattice() const { return lattice_; }
    /// The same grid with the cells alone whose low corner is owned: over all ranks every cell once.
    std::optional<Lattice> counted_cells() const { return cells_between(true); }
    /// Of every node of lattice(): its index in ghosted().
    const std::vector<std::uint32_t>& lattice_nodes() const { return lattice_nodes_; }
    /// Whether lattice() has all nodes of ghosted(): the arrays of both are then one and the same.
    bool full() const { return lattice_nodes_.size() == ghosted_.count(); }

    /// How often cells can be merged two by two with none across a cut.
    int halvings() const;
    /// The rank whose box meets this one's along an axis, on the low or the high side; MPI_PROC_NULL: none.
    int neighbour(std::size_t axis, bool high) const;
    /// As owned() and ghosted(), of any rank.
    NodeBox owned_by(int rank) const;
    NodeBox ghosted_of(int rank) const;
    /// The rank that owns a node.
    int owner(PetscInt i, PetscInt j, PetscInt k) const;

private:
    std::optional<Lattice> cells_between(bool counted_once) const;

    MPI_Comm communicator_;
    int rank_ = 0, ranks_ = 1;
    Grid grid_;
    OwnedDm dm_;
    std::array<PetscInt, 3> processes_ = {1, 1, 1};
    std::array<std::vector<PetscInt>, 3> first_; ///< node of each process along an axis, and the end
    NodeBox owned_, ghosted_;
    std::optional<Lattice> lattice_;
    std::vector<std::uint32_t> lattice_nodes_;
};

/// Which nodes are held, and where: displacements in m by the node's place in the grid, nothing for a free node. All
/// three components are held.
using Supports = std::function<std::optional<std::array<double, 3>>(PetscInt i, PetscInt j, PetscInt k)>;

/// A held component among the owned ones: its index in a rank's array of Block::nodes(), and its displacement.
struct HeldComponent {
    std::size_t index;
    double displacement;
};

std::vector<HeldComponent> held_components(const Block& block, const Supports& supports);

/// Sets the held components of a rank's vector: to their displacements, or to zero.
void set_held(Vec vector, const std::vector<HeldComponent>& held);
void clear_held(Vec vector, const std::vector<HeldComponent>& held);

} // namespace hybmss::distributed
