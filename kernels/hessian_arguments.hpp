#pragma once

// What the kernels of second derivatives are called with, beside the bodies of kernels/arguments.hpp.

#include "kernels/arguments.hpp"

namespace hybmss::kernels {

/// Which vector a spring contributes to a sweep's sums, at end b; the opposite at end a. With p = p_b - p_a, d = x_b -
/// x_a, n = d/|d|, e = |d|/l - 1 and g(e) = quadratic e^2 + cubic e^3:
enum class SpringLaw {
    elastic,            ///< H p of the energy 1/2 k (|d| - l)^2: k [ (1 - l/|d|) (I - n n^T) + n n^T ] p
    damping,            ///< k (n.p) n: for p the velocity, the force of a dashpot k by the time it lags
    stiffening,         ///< k l g(e) n: the derivative of the energy k l^2 (quadratic e^3/3 + cubic e^4/4)
    stiffening_tangent, ///< H p of that energy: k [ g/(1 + e) (I - n n^T) + g' n n^T ] p
};

/// The constants of g(e), without unit; zero where the law has none.
template <class T>
struct StiffeningConstants {
    T quadratic, cubic;
};

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
    StiffeningConstants<T> stiffening;
};

/// Nodes of a network as separate arrays; m.
template <class T>
struct HessianArrays {
    const T* displacement[3];
    const T* direction[3];
    T* product[3]; ///< N; added to
    StiffeningConstants<T> stiffening;
};

/// Nodes of a network in packed arrays, x y z 0 a node; m.
template <class T>
struct PackedHessian {
    const T* displacement;
    const T* direction;
    T* product; ///< N; added to
    StiffeningConstants<T> stiffening;
};

/// The diagonal blocks of a network's nodes, N/m, an array for each entry; added to.
template <class T>
struct DiagonalBlocks {
    T* entry[kBlockEntries];
    StiffeningConstants<T> stiffening;
};

} // namespace hybmss::kernels
