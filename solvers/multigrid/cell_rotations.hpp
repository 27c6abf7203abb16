#pragma once

#include "plan/threads/workers.hpp"
#include "solvers/multigrid/padded_grid.hpp"

#include <array>
#include <vector>

namespace hybmss {

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
    explicit CellRotations(const PaddedGrid& grid);

    /// F by rows at each cell of the padded grid: set where there is a cell, then spread() to those that touch one.
    std::array<std::vector<float>, 9>& gradient() { return gradient_; }
    const std::array<std::vector<float>, 9>& gradient() const { return gradient_; }
    std::vector<unsigned char>& present() { return present_; }
    const std::vector<unsigned char>& present() const { return present_; }
    /// Gives void cells next to present ones the mean gradient of those; all others unity.
    void spread();
    /// The inverse of a cell's stiffness against its three rotations: xx, xy, xz, yy, yz, zz.
    std::array<std::vector<float>, 6>& inverse() { return inverse_; }

    /// z += sum over cells of C_c inverse_c C_c^T r
    void add_correction(const GridVector& r, GridVector& z, const Workers& workers) const;

private:
    PaddedGrid grid_;
    std::array<std::vector<float>, 9> gradient_;
    std::array<std::vector<float>, 6> inverse_;
    std::vector<unsigned char> present_;
};

} // namespace hybmss
