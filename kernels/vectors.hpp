#pragma once

// Vectors and symmetric matrices of a space of three dimensions, one a lane.

#include "kernels/arguments.hpp"
#include "kernels/simd.hpp"

/// For a lambda: it is a step of the function around it, and its values belong into that one's registers.
#define HYBMSS_INLINE_BODY __attribute__((always_inline))

namespace hybmss::kernels {
namespace {

/// x, y, z of one vector of nodes or differences.
template <class V>
struct Vector3 {
    V x, y, z;
};

template <class V>
HYBMSS_INLINE Vector3<V> operator-(const Vector3<V>& a, const Vector3<V>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
HYBMSS_INLINE Vector3<V> operator+(const Vector3<V>& a, const Vector3<V>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
HYBMSS_INLINE Vector3<V> multiply_add(V scale, const Vector3<V>& a, const Vector3<V>& b) {
    return {multiply_add(scale, a.x, b.x), multiply_add(scale, a.y, b.y), multiply_add(scale, a.z, b.z)};
}
template <class V>
HYBMSS_INLINE Vector3<V> subtract_product(V scale, const Vector3<V>& a, const Vector3<V>& b) {
    return {subtract_product(scale, a.x, b.x), subtract_product(scale, a.y, b.y), subtract_product(scale, a.z, b.z)};
}
template <class V>
HYBMSS_INLINE Vector3<V> scaled(V scale, const Vector3<V>& a) {
    return {scale * a.x, scale * a.y, scale * a.z};
}
template <class V>
HYBMSS_INLINE Vector3<V> cross(const Vector3<V>& a, const Vector3<V>& b) {
    return {multiply_subtract(a.y, b.z, a.z * b.y), multiply_subtract(a.z, b.x, a.x * b.z),
            multiply_subtract(a.x, b.y, a.y * b.x)};
}
/// -scale a - b
template <class V>
HYBMSS_INLINE Vector3<V> minus_product_minus(V scale, const Vector3<V>& a, const Vector3<V>& b) {
    return {minus_product_minus(scale, a.x, b.x), minus_product_minus(scale, a.y, b.y),
            minus_product_minus(scale, a.z, b.z)};
}
/// v + a x b
template <class V>
HYBMSS_INLINE Vector3<V> add_cross(const Vector3<V>& a, const Vector3<V>& b, const Vector3<V>& v) {
    return {multiply_add(a.y, b.z, subtract_product(a.z, b.y, v.x)),
            multiply_add(a.z, b.x, subtract_product(a.x, b.z, v.y)),
            multiply_add(a.x, b.y, subtract_product(a.y, b.x, v.z))};
}
template <class V>
HYBMSS_INLINE V dot(const Vector3<V>& a, const Vector3<V>& b) {
    return multiply_add(a.z, b.z, multiply_add(a.y, b.y, a.x * b.x));
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

} // namespace
} // namespace hybmss::kernels
