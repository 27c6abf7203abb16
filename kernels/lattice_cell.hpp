#pragma once

#include "kernels/arguments.hpp"
#include "kernels/simd.hpp"
#include "kernels/spring_law.hpp"
#include "kernels/volume_law.hpp"

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
HYBMSS_INLINE Vector3<V> cross(const Vector3<V>& a, const Vector3<V>& b) {
    return {multiply_subtract(a.y, b.z, a.z * b.y), multiply_subtract(a.z, b.x, a.x * b.z),
            multiply_subtract(a.x, b.y, a.y * b.x)};
}
template <class V>
HYBMSS_INLINE V dot(const Vector3<V>& a, const Vector3<V>& b) {
    return multiply_add(a.z, b.z, multiply_add(a.y, b.y, a.x * b.x));
}

/// v + sign where the compile-time sign is -1, 0 or 1.
template <int sign, class V>
HYBMSS_INLINE V offset(V v) {
    if constexpr (sign == 0) {
        return v;
    } else {
        return v + splat<V>(Scalar<V>(sign));
    }
}
/// sum + sign * v; at the first term `sum` is not read.
template <int sign, bool first, class V>
HYBMSS_INLINE V signed_sum(V sum, V v) {
    if constexpr (sign == 0) {
        return sum;
    } else if constexpr (first) {
        if constexpr (sign > 0) {
            return v;
        } else {
            return -v;
        }
    } else if constexpr (sign > 0) {
        return sum + v;
    } else {
        return sum - v;
    }
}

/// A spring of a lattice cell with the rest vector (rx, ry, rz), components -1, 0 or 1 in units of the cell edge.
template <int rx, int ry, int rz>
struct CellSpring {
    static constexpr int kLength2 = rx * rx + ry * ry + rz * rz;

    /// d = r + du
    template <class V>
    HYBMSS_INLINE static Vector3<V> vector(const Vector3<V>& du) {
        return {offset<rx>(du.x), offset<ry>(du.y), offset<rz>(du.z)};
    }
    /// s = |d|^2 / l^2 - 1 = (du.du + 2 r.du) / l^2
    template <class V>
    HYBMSS_INLINE static V stretch(const Vector3<V>& du) {
        V along = signed_sum<rx, true>(du.x, du.x);
        along = signed_sum<ry, rx == 0>(along, du.y);
        along = signed_sum < rz, rx == 0 && ry == 0 > (along, du.z);
        const V square = dot(du, du);
        if constexpr (kLength2 == 1) {
            return multiply_add(splat<V>(2), along, square);
        } else if constexpr (kLength2 == 2) {
            return multiply_add(splat<V>(Scalar<V>(0.5)), square, along);
        } else {
            const V third = splat<V>(Scalar<V>(1.0 / 3.0));
            return third * multiply_add(splat<V>(2), along, square);
        }
    }
};

/// The cell's thirteen springs: corners (bit 0: high side in x, 1: y, 2: z) and rest vectors. Edges start at the low
/// corner, face diagonals lie in the low faces: the others belong to neighbouring cells.
#define HYBMSS_EDGES(apply) apply(0, 1, 1, 0, 0, 0) apply(0, 2, 0, 1, 0, 1) apply(0, 4, 0, 0, 1, 2)
#define HYBMSS_FACE_DIAGONALS(apply)                                                                                   \
    apply(0, 3, 1, 1, 0, 3) apply(1, 2, -1, 1, 0, 3) apply(0, 5, 1, 0, 1, 4) apply(1, 4, -1, 0, 1, 4)                  \
        apply(0, 6, 0, 1, 1, 5) apply(2, 4, 0, -1, 1, 5)
#define HYBMSS_CUBE_DIAGONALS(apply)                                                                                   \
    apply(0, 7, 1, 1, 1, 6) apply(1, 6, -1, 1, 1, 6) apply(2, 5, 1, -1, 1, 6) apply(3, 4, -1, -1, 1, 6)

/// What the volume force and energy need of a cell: the four cube diagonals as vectors (full: d, and displacement: du).
///
/// The mean edges (5.14) are 4 a = d0 - d1 + d2 - d3, 4 b = S - T, 4 c = S + T with S = d0 + d1, T = d2 + d3.
/// So 16 b x c = 2 S x T, 16 (c x a + a x b) = 2 T x 4a, 16 (a x b - c x a) = 2 4a x S.
template <class V>
struct CellVolume {
    Vector3<V> st, ta, as; ///< S x T, T x 4a, 4a x S
    V dilation;            ///< J - 1
};

template <class V>
HYBMSS_INLINE CellVolume<V> cell_volume(const Vector3<V>& e0, const Vector3<V>& e1, const Vector3<V>& e2,
                                        const Vector3<V>& e3) {
    const auto two = splat<V>(2), four = splat<V>(4);
    const Vector3<V> s = e0 + e1, t = e2 + e3, da = (e0 - e1) + (e2 - e3);
    const Vector3<V> big_s = {s.x, s.y + two, s.z + two};
    const Vector3<V> big_t = {t.x, t.y - two, t.z + two};
    const Vector3<V> big_a = {da.x + four, da.y, da.z};
    CellVolume<V> cell{cross(big_s, big_t), cross(big_t, big_a), cross(big_a, big_s), {}};
    // J - 1 = (2 A.(S x T) - 64) / 64 without cancellation, by replacing one factor after the other:
    //   32 (J - 1) = da.(S x T) + A0.(ds x T) + A0.(S0 x dt),  A0 = (4, 0, 0), S0 = (0, 2, 2)
    const V difference = t.z - t.y;
    const V minor = multiply_subtract(s.y, big_t.z, s.z * big_t.y);
    const V bracket = multiply_add(two, difference, minor);
    cell.dilation = multiply_add(four, bracket, dot(da, cell.st)) * splat<V>(Scalar<V>(1.0 / 32.0));
    return cell;
}

/// Sets f[corner] to the forces of a vector of cells on their corners, from the corners' displacements u.
/// Units: lengths h, stiffness k h, so f is in N.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
HYBMSS_INLINE void cell_forces(const Vector3<V> (&u)[8], const V (&k)[7], Scalar<V> volume_ratio, Vector3<V> (&f)[8]) {
    // Opposite corners get opposite forces from the cube diagonal between them and from the cell's volume: one sum.
    Vector3<V> pair[4];
    const Vector3<V> du[4] = {u[7] - u[0], u[6] - u[1], u[5] - u[2], u[4] - u[3]};
#define HYBMSS_PAIR(a, b, rx, ry, rz, kind)                                                                            \
    {                                                                                                                  \
        using Spring = CellSpring<rx, ry, rz>;                                                                         \
        const V tension = k[kind] * one_minus_rsqrt<accuracy>(Spring::stretch(du[a]));                                 \
        const Vector3<V> d = Spring::vector(du[a]);                                                                    \
        pair[a] = {tension * d.x, tension * d.y, tension * d.z};                                                       \
    }
    HYBMSS_CUBE_DIAGONALS(HYBMSS_PAIR)
#undef HYBMSS_PAIR
    if constexpr (volume != Volume::none) {
        // Force on corner i: -kappa phi' dV'/dx_i; dV'/dx_0 = -(ST + TA)/32, dV'/dx_1 = (ST - TA)/32,
        // dV'/dx_2 = -(ST + AS)/32, dV'/dx_3 = (ST - AS)/32 in units of h^2.
        const CellVolume<V> cell = cell_volume(du[0], du[1], du[2], du[3]);
        const V pressure = k[6] * splat<V>(volume_ratio) * volume_slope<volume>(cell.dilation);
        pair[0] = multiply_add(pressure, cell.st + cell.ta, pair[0]);
        pair[1] = subtract_product(pressure, cell.st - cell.ta, pair[1]);
        pair[2] = multiply_add(pressure, cell.st + cell.as, pair[2]);
        pair[3] = subtract_product(pressure, cell.st - cell.as, pair[3]);
    }
    for (int a = 0; a < 4; ++a) {
        f[a] = pair[a];
        f[7 - a] = {-pair[a].x, -pair[a].y, -pair[a].z};
    }
#define HYBMSS_ADD(a, b, rx, ry, rz, kind)                                                                             \
    {                                                                                                                  \
        using Spring = CellSpring<rx, ry, rz>;                                                                         \
        const Vector3<V> e = u[b] - u[a];                                                                              \
        const V tension = k[kind] * one_minus_rsqrt<accuracy>(Spring::stretch(e));                                     \
        const Vector3<V> d = Spring::vector(e);                                                                        \
        f[a] = multiply_add(tension, d, f[a]);                                                                         \
        f[b] = subtract_product(tension, d, f[b]);                                                                     \
    }
    if constexpr (face_diagonals) {
        HYBMSS_FACE_DIAGONALS(HYBMSS_ADD)
    }
    HYBMSS_EDGES(HYBMSS_ADD)
}

/// The forces of the springs that lie in a node plane alone (edges along x and y, face diagonals normal to z).
template <bool face_diagonals, Accuracy accuracy, class V>
HYBMSS_INLINE void plane_forces(const Vector3<V> (&u)[4], const V (&k)[7], Vector3<V> (&f)[4]) {
    const V zero = splat<V>(0);
    for (auto& force : f) {
        force = {zero, zero, zero};
    }
    HYBMSS_ADD(0, 1, 1, 0, 0, 0)
    HYBMSS_ADD(0, 2, 0, 1, 0, 1)
    if constexpr (face_diagonals) {
        HYBMSS_ADD(0, 3, 1, 1, 0, 3)
        HYBMSS_ADD(1, 2, -1, 1, 0, 3)
    }
}
#undef HYBMSS_ADD

} // namespace
} // namespace hybmss::kernels
