#pragma once

// What the kernels of second derivatives are called with, beside the bodies of kernels/arguments.hpp.

#include "kernels/arguments.hpp"

namespace hybmss::kernels {

/// The entries of a symmetric 3x3 block, in the order in which their arrays come.
inline constexpr int kBlockEntries = 6; ///< xx, yy, zz, xy, xz, yz

/// A LatticeLayer for second derivatives: `components` values a node come out, three of a product K p, six of a
/// diagonal block.
///
/// Lengths are in units of the cell edge, `direction` too, and so are those by which blocks are divided: both results
/// are made of k h, in N.
template <class T, int components>
struct LatticeHessianLayer {
    std::ptrdiff_t row;
    std::ptrdiff_t lanes;
    std::ptrdiff_t plane;
    const T* displacement[3];         ///< of the lower node plane; the upper one follows after `plane` elements
    const T* direction[3];            ///< p, likewise; for products alone
    const T* stiffness[7];            ///< as in LatticeLayer
    T* partial[components];           ///< sums of the lower plane, from the layer below and this one
    T* above[components];             ///< sums of the upper plane, from this layer; set, not added to
    T volume_ratio;                   ///< as in LatticeLayer
    const VectorNeighbors* neighbors; ///< as in LatticeLayer for active-rows; null for flat rows
    std::ptrdiff_t upper_lanes;       ///< as in LatticeLayer; for active-rows
};

/// Nodes of a network as separate arrays; m.
template <class T>
struct HessianArrays {
    const T* displacement[3];
    const T* direction[3];
    T* product[3]; ///< N; added to
};

/// Nodes of a network in packed arrays, x y z 0 a node; m.
template <class T>
struct PackedHessian {
    const T* displacement;
    const T* direction;
    T* product; ///< N; added to
};

/// The diagonal blocks of a network's nodes, N/m, an array for each entry; added to.
template <class T>
struct DiagonalBlocks {
    T* entry[kBlockEntries];
};

} // namespace hybmss::kernels
