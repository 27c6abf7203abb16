#pragma once

#include "solvers/multigrid/padded_grid.hpp"

#include <array>
#include <vector>

namespace hybmss {

/// The deformation gradient F = dx/dX at the centre of each cell of a padded grid, unity where nothing has set it.
class CellGradients {
public:
    explicit CellGradients(const PaddedGrid& grid);

    const PaddedGrid& grid() const { return grid_; }
    /// By rows.
    const std::array<std::vector<float>, 9>& entries() const { return entries_; }
    /// Where there is a cell. Set it before all else.
    std::vector<unsigned char>& present() { return present_; }
    const std::vector<unsigned char>& present() const { return present_; }

    /// From the displacements of the nodes, times `unit` in edges of the cells.
    void take(const GridVector& displacement, double unit, const Workers& workers);
    /// The mean of the cells that each of these is merged of.
    void merge(const CellGradients& fine);
    /// Gives void cells next to present ones the mean gradient of those; all others unity.
    void spread();

private:
    PaddedGrid grid_;
    std::array<std::vector<float>, 9> entries_;
    std::vector<unsigned char> present_;
};

} // namespace hybmss
