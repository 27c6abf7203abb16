#pragma once

// A vector of lattice cells: its springs and its volume.

#include "kernels/spring_law.hpp"
#include "kernels/volume_law.hpp"

namespace hybmss::kernels {
namespace {

/// v + the compile-time number.
template <int number, class V>
HYBMSS_INLINE V offset(V v) {
    if constexpr (number == 0) {
        return v;
    } else {
        return v + splat<V>(Scalar<V>(number));
    }
}
/// sum + sign * v
template <int sign, class V>
HYBMSS_INLINE V signed_sum(V sum, V v) {
    if constexpr (sign == 0) {
        return sum;
    } else if constexpr (sign > 0) {
        return sum + v;
    } else {
        return sum - v;
    }
}

/// The spring between two corners of a lattice cell (bit 0 of a corner's number: high side in x, 1: y, 2: z).
template <int corner_a, int corner_b>
struct CellSpring {
    static constexpr int a = corner_a, b = corner_b;
    // Rest vector in units of the cell edge.
    static constexpr int rx = (b & 1) - (a & 1), ry = (b >> 1 & 1) - (a >> 1 & 1), rz = (b >> 2) - (a >> 2);
    static constexpr int kLength2 = rx * rx + ry * ry + rz * rz;
    /// Which of a layer's stiffness arrays: by the axes along which the corners differ.
    static constexpr int kKinds[8] = {-1, 0, 1, 3, 2, 4, 5, 6};
    static constexpr int kKind = kKinds[a ^ b];

    /// d = r + du
    template <class V>
    HYBMSS_INLINE static Vector3<V> vector(const Vector3<V>& du) {
        return {offset<rx>(du.x), offset<ry>(du.y), offset<rz>(du.z)};
    }
    /// r.du, beginning with a term that is not negated: a negation is an operation of its own.
    template <class V>
    HYBMSS_INLINE static V along(const Vector3<V>& du) {
        static_assert(rx > 0 || ry > 0 || rz > 0, "name the corners the other way round");
        if constexpr (rx > 0) {
            return signed_sum<rz>(signed_sum<ry>(du.x, du.y), du.z);
        } else if constexpr (ry > 0) {
            return signed_sum<rx>(signed_sum<rz>(du.y, du.z), du.x);
        } else {
            return signed_sum<rx>(signed_sum<ry>(du.z, du.y), du.x);
        }
    }
    /// s = |d|^2 / l^2 - 1 = (du.du + 2 r.du) / l^2 = du.(du + 2 r) / l^2
    template <class V>
    HYBMSS_INLINE static V stretch(const Vector3<V>& du) {
        if constexpr (kLength2 == 2) {
            return multiply_add(splat<V>(Scalar<V>(0.5)), dot(du, du), along(du));
        } else {
            const Vector3<V> sum = {offset<2 * rx>(du.x), offset<2 * ry>(du.y), offset<2 * rz>(du.z)};
            const V scaled_stretch = dot(du, sum);
            return kLength2 == 1 ? scaled_stretch : splat<V>(Scalar<V>(1.0 / 3.0)) * scaled_stretch;
        }
    }
};

/// Springs that a kernel computes side by side: one spring alone is a chain of some twenty dependent operations, more
/// than a processor looks ahead. With sixteen registers the spills cost more than that gains, and groups are taken
/// apart.
template <class... Springs>
struct SpringGroup {};

// The cell's thirteen springs. Edges start at the low corner and face diagonals lie in the low faces: the others belong
// to neighbouring cells. Cube diagonal i starts at corner i.
using Edges = SpringGroup<CellSpring<0, 1>, CellSpring<0, 2>, CellSpring<0, 4>>;
using EdgesAndFaceDiagonals =
    SpringGroup<CellSpring<0, 1>, CellSpring<0, 2>, CellSpring<0, 4>, CellSpring<1, 2>, CellSpring<1, 4>,
                CellSpring<2, 4>, CellSpring<0, 3>, CellSpring<0, 5>, CellSpring<0, 6>>;
using CubeDiagonals = SpringGroup<CellSpring<0, 7>, CellSpring<1, 6>, CellSpring<2, 5>, CellSpring<3, 4>>;
// Those that lie in a node plane alone.
using PlaneEdges = SpringGroup<CellSpring<0, 1>, CellSpring<0, 2>>;
using PlaneEdgesAndFaceDiagonals = SpringGroup<CellSpring<0, 1>, CellSpring<0, 2>, CellSpring<1, 2>, CellSpring<0, 3>>;
// Those that lie in a side normal to y.
using SideEdges = SpringGroup<CellSpring<0, 1>, CellSpring<0, 4>>;
using SideEdgesAndFaceDiagonals = SpringGroup<CellSpring<0, 1>, CellSpring<0, 4>, CellSpring<1, 4>, CellSpring<0, 5>>;
template <bool face_diagonals>
using EdgesAndFaces = std::conditional_t<face_diagonals, EdgesAndFaceDiagonals, Edges>;
// The nine in the order in which the rows of a layer need them.
using FirstThree = SpringGroup<CellSpring<0, 6>, CellSpring<0, 5>, CellSpring<1, 4>>;
using SecondThree = SpringGroup<CellSpring<0, 4>, CellSpring<2, 4>, CellSpring<0, 3>>;
using LastThree = SpringGroup<CellSpring<0, 1>, CellSpring<0, 2>, CellSpring<1, 2>>;
template <bool face_diagonals>
using PlaneSprings = std::conditional_t<face_diagonals, PlaneEdgesAndFaceDiagonals, PlaneEdges>;
template <bool face_diagonals>
using SideSprings = std::conditional_t<face_diagonals, SideEdgesAndFaceDiagonals, SideEdges>;

/// The tension k (1 - l/|d|) of each spring of a group, by the pair of its corners.
template <class V, class... Springs>
struct Tensions {
    V value[sizeof...(Springs)];

    template <int a, int b>
    HYBMSS_INLINE V at() const {
        int i = 0, found = 0;
        ((found = Springs::a == a && Springs::b == b ? i : found, ++i), ...);
        return value[found];
    }
};

template <Accuracy accuracy, class V, int corners, class... Springs>
HYBMSS_INLINE Tensions<V, Springs...> spring_tensions(SpringGroup<Springs...>, const Vector3<V> (&u)[corners],
                                                      const V (&k)[7]) {
    Tensions<V, Springs...> tension;
    const V s[] = {Springs::stretch(u[Springs::b] - u[Springs::a])...};
    one_minus_rsqrt<accuracy>(s, tension.value);
    int i = 0;
    ((tension.value[i] = k[Springs::kKind] * tension.value[i], ++i), ...);
    return tension;
}

/// The force tension d of the spring between two corners, on corner a.
template <int a, int b, class V, int corners, class Group>
HYBMSS_INLINE Vector3<V> spring_force(const Vector3<V> (&u)[corners], const Group& tension) {
    return scaled(tension.template at<a, b>(), CellSpring<a, b>::vector(u[b] - u[a]));
}
/// f + tension d
template <int a, int b, class V, int corners, class Group>
HYBMSS_INLINE void pull(Vector3<V>& f, const Vector3<V> (&u)[corners], const Group& tension) {
    f = multiply_add(tension.template at<a, b>(), CellSpring<a, b>::vector(u[b] - u[a]), f);
}
/// f - tension d
template <int a, int b, class V, int corners, class Group>
HYBMSS_INLINE void push(Vector3<V>& f, const Vector3<V> (&u)[corners], const Group& tension) {
    f = subtract_product(tension.template at<a, b>(), CellSpring<a, b>::vector(u[b] - u[a]), f);
}

/// Sum over a group of 1/2 k (|d| - l)^2 = k l^2 / 2 * squared strain.
template <class V, int corners, class... Springs>
HYBMSS_INLINE V spring_energies(SpringGroup<Springs...>, const Vector3<V> (&u)[corners], const V (&k)[7]) {
    V sum = splat<V>(0);
    ((sum = multiply_add(k[Springs::kKind] * splat<V>(Scalar<V>(0.5 * Springs::kLength2)),
                         squared_strain(Springs::stretch(u[Springs::b] - u[Springs::a])), sum)),
     ...);
    return sum;
}

/// What the volume energy and its derivatives need of a cell: the four cube diagonals as vectors (full: d, and
/// displacement: du).
///
/// The mean edges (5.14) are 4 a = d0 - d1 + d2 - d3, 4 b = S - T, 4 c = S + T with S = d0 + d1, T = d2 + d3.
/// So 16 b x c = 2 S x T, 16 (c x a + a x b) = 2 T x 4a, 16 (a x b - c x a) = 2 4a x S.
template <class V>
struct CellVolume {
    Vector3<V> s, t, a;    ///< S, T, 4a
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
    // J - 1 = (2 A.(S x T) - 64) / 64 without cancellation, by replacing one factor after the other:
    //   32 (J - 1) = da.(S x T) + A0.(ds x T) + A0.(S0 x dt),  A0 = (4, 0, 0), S0 = (0, 2, 2)
    const V difference = t.z - t.y;
    const V minor = multiply_subtract(s.y, big_t.z, s.z * big_t.y);
    const V bracket = multiply_add(two, difference, minor);
    // The bracket is the x component of S x T less that of S0 x T0.
    const Vector3<V> st = {bracket + splat<V>(8), multiply_subtract(big_s.z, big_t.x, big_s.x * big_t.z),
                           multiply_subtract(big_s.x, big_t.y, big_s.y * big_t.x)};
    const V dilation = multiply_add(four, bracket, dot(da, st)) * splat<V>(Scalar<V>(1.0 / 32.0));
    return {big_s, big_t, big_a, st, cross(big_t, big_a), cross(big_a, big_s), dilation};
}

/// The forces of a vector of cells' cube diagonals and volumes on the corners 0 to 3; those on the opposite corners 7
/// to 4 are opposite. Units: lengths h, stiffness k h, so forces are in N.
template <Volume volume, Accuracy accuracy, class V>
HYBMSS_INLINE void diagonal_forces(const Vector3<V> (&u)[8], const V (&k)[7], Scalar<V> volume_ratio,
                                   Vector3<V> (&f)[4]) {
    const auto tension = spring_tensions<accuracy>(CubeDiagonals{}, u, k);
    if constexpr (volume == Volume::none) {
        f[0] = spring_force<0, 7>(u, tension);
        f[1] = spring_force<1, 6>(u, tension);
        f[2] = spring_force<2, 5>(u, tension);
        f[3] = spring_force<3, 4>(u, tension);
    } else {
        // Force on corner i: -kappa phi' dV'/dx_i; dV'/dx_0 = -(ST + TA)/32, dV'/dx_1 = (ST - TA)/32,
        // dV'/dx_2 = -(ST + AS)/32, dV'/dx_3 = (ST - AS)/32 in units of h^2.
        const CellVolume<V> cell = cell_volume(u[7] - u[0], u[6] - u[1], u[5] - u[2], u[4] - u[3]);
        const V pressure = k[6] * splat<V>(volume_ratio) * volume_slope<volume>(cell.dilation);
        const Vector3<V> st = scaled(pressure, cell.st), ta = scaled(pressure, cell.ta), as = scaled(pressure, cell.as);
        f[0] = st + ta;
        f[1] = ta - st;
        f[2] = st + as;
        f[3] = as - st;
        pull<0, 7>(f[0], u, tension);
        pull<1, 6>(f[1], u, tension);
        pull<2, 5>(f[2], u, tension);
        pull<3, 4>(f[3], u, tension);
    }
}

} // namespace
} // namespace hybmss::kernels
