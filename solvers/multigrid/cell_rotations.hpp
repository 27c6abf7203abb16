#pragma once

#include "kernels/kernel_table.hpp"
#include "plan/threads/workers.hpp"
#include "solvers/multigrid/cell_gradients.hpp"
#include "solvers/multigrid/lanes.hpp"

#include <array>
#include <vector>

namespace hybmss {

/// visit(place, count) for a layer of cells and of those outside around it, up to kLanes neighbours at a time.
template <class Visit>
void for_each_lanes(const PaddedGrid& grid, int k, const Visit& visit) {
    const auto row = static_cast<std::size_t>(grid.cells[0] + 2);
    for (int j = -1; j <= grid.cells[1]; ++j) {
        const std::size_t first = grid.index(-1, j, k);
        for (std::size_t i = 0; i < row; i += kLanes) {
            visit(first + i, row - i < kLanes ? row - i : kLanes);
        }
    }
}

/// A correction in the space of the cells' rotations: fields that turn the corners of one cell about its centre,
///
///     v_a = F (w x s_a),  s_a = (+-1, +-1, +-1),  F the deformation gradient near the cell,
///
/// change no cell's volume, neither that cell's nor a neighbour's, and with the cells outside that touch the surface
/// they span nearly all fields that do not. Where the volume is stiff, these are the stiff matrix's soft directions,
/// which a smoother that looks at one node at a time cannot see (the idea of Hiptmair's smoother for curl-curl, SIAM J.
/// Numer. Anal. 36, 1998, and of Schoeberl's for nearly incompressible solids, Numer. Math. 84, 1999).
class CellRotations {
public:
    /// About these gradients, spread() to void cells, which are kept by reference. `shared`: of the grid, or null.
    CellRotations(const CellGradients& gradients, const kernels::KernelTable<float>& table, const SharedGrid* shared);

    /// Takes what turning the cells costs, `count` of them from a place on: xx, xy, xz, yy, yz, zz. Directions below
    /// `smallest` of the stiffest are left alone.
    void invert(std::size_t cell, std::size_t count, const Lanes (&stiffness)[6], double smallest);
    /// After all cells: of a rank, where what others have of its cells counts too.
    void finish(double smallest);

    /// z += sum over cells of C_c inverse_c C_c^T r; of a rank, of its own cells.
    void add_correction(const GridVector& r, GridVector& z, const Workers& workers) const;

private:
    const CellGradients* gradients_;
    const kernels::KernelTable<float>* table_;
    const SharedGrid* shared_;
    std::array<std::vector<float>, 6> inverse_; ///< of a rank, before finish(), what is to be inverted
};

} // namespace hybmss
