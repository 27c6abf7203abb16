#pragma once

// What the kernels of multigrid's cycles are called with (kernels/grid_kernels.cpp), beside kernels/arguments.hpp.

#include "kernels/arguments.hpp"

namespace hybmss::kernels {

/// A term of a polynomial smoother over the nodes' blocks, for three arrays of a component each:
///
///     r = from - (product + weight v),   d = keep d + add B r,   x = x + d
///
/// with v what `product` was made of: x at `restart`, d at `next`; see BlockUse.
template <class T>
struct NodeBlocks {
    const T* inverse[kBlockEntries]; ///< B: xx, xy, xz, yy, yz, zz; zero where there is no node
    const T* from[3];
    const T* product[3];
    const T* weight[3]; ///< diagonal that the product is without; where pulled
    T* rest[3];         ///< r; may be `from`
    T* direction[3];    ///< d
    T* solution[3];     ///< x
    T keep, add;
};

/// A matrix over the nodes of a grid with a layer of nodes around it that belongs to nobody.
template <class T>
struct GridStencil {
    /// Of the node itself and of the 13 neighbours that come after it, 9 entries each, `stride` apart. The neighbours
    /// before see the node as it sees them.
    const T* entries;
    std::ptrdiff_t stride;
    std::ptrdiff_t ahead[13]; ///< how far those neighbours are
    const T* in[3];           ///< v
    const T* from[3];         ///< b; for residuals
    T* out[3];                ///< K v, or b - K v
};

/// The pairs a <= b of a cell's corners, and the directions of its springs.
inline constexpr int kCornerPairs = 36, kSpringDirections = 13;

/// Neighbouring cells of one pattern, whose matrices are to be made (CellPattern, solvers/multigrid/cell_patterns.hpp).
/// Arrays have kMaxWidth values a line, one a cell.
template <class T>
struct PatternedCells {
    /// By pair and term, `terms` a pair: those of the springs, of the area vectors e and f, of the pull, of the
    /// patterns i and k, and of the fourth pattern.
    const T* factor;
    int terms;
    const T* springs;          ///< A_d: 13 blocks of xx, xy, xz, yy, yz, zz
    const T* areas;            ///< a_e, 9 lines; where there is a volume energy
    const T* volume_stiffness; ///< c, likewise
    const T* pull;
    const T* patterns; ///< B_ik, 9 blocks of 9 lines; where springs are on means
    const T* fourth;   ///< k_4, likewise
    T* blocks;         ///< a 3x3 block by rows for each pair, 9 lines; set
};

/// A row of cells whose rotations are corrected: with C_c the fields that turn the corners of the cell c about its
/// middle (solvers/multigrid/cell_rotations.hpp), C_c inverse_c C_c^T r, as what it gives to its corners by their
/// signs.
template <class T>
struct CellTurns {
    const T* residual[3]; ///< r at the cells' low corners; the other corners follow by these distances:
    std::ptrdiff_t corner[8];
    const T* gradient[9];            ///< F by rows
    const T* inverse[kBlockEntries]; ///< xx, xy, xz, yy, yz, zz
    T* turned[9];                    ///< sx X + sy Y + sz Z at a corner with these signs: X x y z, Y, Z
};

/// What rows of turned cells give to the row of nodes between them, one beside the other.
template <class T>
struct TurnedRows {
    const T* before[9]; ///< CellTurns::turned of the row of lower y; a cell more than there are nodes
    const T* now[9];    ///< of the other
    T* below[3];        ///< added to: the nodes below the cells, and those above; null where they are not wanted
    T* above[3];
};

} // namespace hybmss::kernels
