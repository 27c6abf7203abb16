#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "layouts/aligned_array.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace hybmss {

/// A run of consecutive nodes of the body that are also consecutive in the layout.
struct NodeRun {
    std::size_t node;
    std::size_t index;
    std::size_t length;
};

/// The layout "flat-rows": every grid node has a place, connectivity is a sum of strides, void cells have stiffness
/// zero.
///
///     plane 0: row 0 | row 1 | ... | row ny | zeros to `plane`;  plane 1: ...;  plane nz
///
/// Planes are normal to z or to y, whichever wastes fewer lanes on void cells: a bar of 4 x 4 x 24 cells has 24 planes
/// of 25 nodes in 32 lanes, or 4 of 125 in 128. Mirrored axes and components make the same forces.
///
/// Rows are nx + 1 nodes long and not padded (a padded row costs more lanes than it saves); planes are padded so that
/// they start on a vector and one row of zeros separates them. See kernels::LatticeLayer for how a kernel walks it.
template <class T>
struct FlatRows {
    FlatRows(const Lattice& lattice, const Material& material);

    std::array<std::size_t, 3> axes; ///< the body's axis along a row, along a plane, and normal to the planes
    std::size_t row;                 ///< nodes of a row
    std::size_t lanes;               ///< nodes of a plane, padded
    std::size_t plane;               ///< distance of planes
    std::size_t planes;
    double cell_size;
    AlignedArray<T> stiffness[7];        ///< k h, N; see kernels::LatticeLayer
    AlignedArray<T> inverse_mass;        ///< 1 / (m h); 0 at void nodes
    T volume_ratio;                      ///< kappa h^2 / (32 k_c h)
    std::vector<double> masses;          ///< kg, one a node of the body
    std::vector<NodeRun> runs;           ///< ascending, none longer than a plane
    std::vector<std::size_t> plane_runs; ///< the first run of each plane; one more entry at the end
    std::size_t node_count = 0;

    std::size_t size() const { return planes * plane; }
    std::size_t bytes() const;
    /// The layout index of a node of the body.
    std::size_t index_of(std::size_t node) const;
};

extern template struct FlatRows<float>;
extern template struct FlatRows<double>;

} // namespace hybmss
