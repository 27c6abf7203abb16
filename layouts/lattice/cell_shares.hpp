#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"

#include <array>

namespace hybmss {

/// A layout's axes as the body's: along a row, along a plane, and normal to the planes.
using LatticeAxes = std::array<std::size_t, 3>;

/// What the cells around a grid node give to it and to the springs that start there: k = (k_e/4) * the sum of the
/// scales of the cells around an edge, and so on; a mass of rho h^3/8 a cell. The same numbers in every layout.
class CellShares {
public:
    CellShares(const Lattice& lattice, const Material& material, const LatticeAxes& axes);

    struct Node {
        std::array<double, 7> stiffness; ///< k h, N; in the order of kernels::LatticeLayer
        int cells;                       ///< that touch the node: nonzero makes it a node of the body
    };
    /// Of the grid node at this place along the layout's axes.
    Node at(const std::array<std::size_t, 3>& place) const;

    double mass(int cells) const { return cell_mass_ * cells; }
    double inverse_mass(int cells) const { return 1 / (mass(cells) * lattice_.cell_size()); } ///< 1 / (m h)
    double volume_ratio() const { return volume_ratio_; } ///< kappa h^2 / (32 k_c h)

private:
    double scale_at(const std::array<int, 3>& place) const;

    const Lattice& lattice_;
    LatticeAxes axes_;
    double edge_, face_, cube_, cell_mass_, volume_ratio_;
};

} // namespace hybmss
