#pragma once

#include "kernels/hessian_arguments.hpp"
#include "kernels/lattice_cell.hpp"

namespace hybmss::kernels {
namespace {

// The second derivative of a spring's energy: H = k [ t I + (1 - t) n n^T ], t = 1 - l/|d|, n = d/|d|.
//
// t is the factor of the spring's force, without cancellation; l n = (1 - t) d. Where the ends nearly coincide and the
// force's factor is bounded, to T = 1 - (|d|^2/l^2 + b)^(-1/2), the same formula is the derivative of that force, since
// dT/ds = (1 - T)^3 / 2, and stays finite.

/// l n
template <class V>
HYBMSS_INLINE Vector3<V> spring_axis(V t, const Vector3<V>& d) {
    return scaled(splat<V>(1) - t, d);
}

/// H p
template <class V>
HYBMSS_INLINE Vector3<V> spring_product(V k, V t, V inverse_length2, const Vector3<V>& d, const Vector3<V>& p) {
    const Vector3<V> axis = spring_axis(t, d);
    const V axial = k * (splat<V>(1) - t) * inverse_length2 * dot(axis, p);
    return multiply_add(axial, axis, scaled(k * t, p));
}

/// A symmetric 3x3 matrix a lane: xx, yy, zz, xy, xz, yz.
template <class V>
struct Symmetric3 {
    V entry[kBlockEntries];
};

template <class V>
HYBMSS_INLINE Symmetric3<V> operator+(const Symmetric3<V>& a, const Symmetric3<V>& b) {
    Symmetric3<V> sum;
    for (int i = 0; i < kBlockEntries; ++i) {
        sum.entry[i] = a.entry[i] + b.entry[i];
    }
    return sum;
}

/// diagonal I + scale v v^T
template <class V>
HYBMSS_INLINE Symmetric3<V> rank_one(V diagonal, V scale, const Vector3<V>& v) {
    const Vector3<V> w = scaled(scale, v);
    return {{multiply_add(w.x, v.x, diagonal), multiply_add(w.y, v.y, diagonal), multiply_add(w.z, v.z, diagonal),
             w.x * v.y, w.x * v.z, w.y * v.z}};
}

/// H
template <class V>
HYBMSS_INLINE Symmetric3<V> spring_block(V k, V t, V inverse_length2, const Vector3<V>& d) {
    return rank_one(k * t, k * (splat<V>(1) - t) * inverse_length2, spring_axis(t, d));
}

} // namespace
} // namespace hybmss::kernels
