#pragma once

/// \file
/// Displacements on the nodes of a box of cells, carried to finer grids and compared there.

#include "studies/calculix/problem.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace hybmss::price {

/// One vector a node of a full box, x fastest, then y, then z.
struct GridField {
    std::array<int, 3> cells = {0, 0, 0};
    double cell_size = 1; ///< m
    std::vector<std::array<double, 3>> values;

    std::size_t node(int i, int j, int k) const;
    /// Trilinear inside each cell; on a grid `factor` times as fine, >= 1.
    GridField refined(int factor) const;
    /// Its values on every `factor`-th node; `factor` divides the cells.
    GridField coarsened(int factor) const;
};

/// The field of 20-node elements, by their own shape functions, on a grid `factor` times as fine as the elements.
/// `mesh` is of a full box of `cells`, its displacements one a node.
GridField refined_quadratic(const calculix::BrickMesh& mesh, const std::vector<std::array<double, 3>>& displacements,
                            const std::array<int, 3>& cells, int factor);

/// How far a field lies from another one on the same grid, relative to the other's own norm.
struct FieldError {
    double l2 = 0; ///< of the displacement, by the trapezoidal rule
    double h1 = 0; ///< of its gradient, in the cells' centres
};
/// Throws std::invalid_argument for another grid.
FieldError field_error(const GridField& field, const GridField& reference);

/// s a + t b, node by node. The same grid.
GridField combined(double s, const GridField& a, double t, const GridField& b);

} // namespace hybmss::price
