#pragma once

#include "kernels/network/network_packed_impl.hpp"

// The scalar loops over arrays of structs: the code that people would write first, kept as a baseline. The batch type
// names only the precision; all levels of accuracy use the rounded square root and division.

namespace hybmss::kernels {
namespace {

HYBMSS_INLINE float scalar_square_root(float a) {
    return __builtin_sqrtf(a);
}
HYBMSS_INLINE double scalar_square_root(double a) {
    return __builtin_sqrt(a);
}
HYBMSS_INLINE float scalar_cube_root(float a) {
    return __builtin_cbrtf(a);
}
HYBMSS_INLINE double scalar_cube_root(double a) {
    return __builtin_cbrt(a);
}

template <class T>
struct Point {
    T x, y, z;
};
template <class T>
HYBMSS_INLINE Point<T> operator+(const Point<T>& a, const Point<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
HYBMSS_INLINE Point<T> operator-(const Point<T>& a, const Point<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
HYBMSS_INLINE Point<T> operator*(T s, const Point<T>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class T>
HYBMSS_INLINE T scalar_product(const Point<T>& a, const Point<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
HYBMSS_INLINE Point<T> vector_product(const Point<T>& a, const Point<T>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
HYBMSS_INLINE Point<T> point_at(const T* p) {
    return {p[0], p[1], p[2]};
}
template <class T>
HYBMSS_INLINE void add_to(T* p, const Point<T>& v) {
    p[0] += v.x;
    p[1] += v.y;
    p[2] += v.z;
}

/// s = |d|^2 / l^2 - 1.
template <class T>
HYBMSS_INLINE T record_stretch(const SpringRecord<T>& spring, const T* u, Point<T>& d) {
    const Point<T> rest = point_at(spring.rest), du = point_at(u + spring.b) - point_at(u + spring.a);
    d = rest + du;
    return (2 * scalar_product(rest, du) + scalar_product(du, du)) * spring.inverse_length2;
}

/// 1 - 1/sqrt(w) = s / (w + sqrt(w)), w = 1 + s, bounded as in spring_law.hpp.
template <class T>
HYBMSS_INLINE T scalar_one_minus_rsqrt(T s) {
    constexpr T kLeast = sizeof(T) == 4 ? T(0x1p-20) : T(0x1p-40);
    const T w = s + 1 > kLeast ? s + 1 : kLeast;
    return s / (w + scalar_square_root(w));
}

/// f_a += k (1 - l/|d|) d, f_b -= the same.
template <class V>
void record_springs(const SpringRecord<Scalar<V>>* springs, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                    std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const SpringRecord<T>& spring = springs[i];
        Point<T> d;
        const T s = record_stretch(spring, nodes.displacement, d);
        const Point<T> force = (spring.stiffness * scalar_one_minus_rsqrt(s)) * d;
        add_to(nodes.force + spring.a, force);
        add_to(nodes.force + spring.b, T(-1) * force);
    }
}

/// Sum of 1/2 k (|d| - l)^2 = k l^2 / 2 (s / (1 + sqrt(1 + s)))^2.
template <class V>
double record_spring_energy(const SpringRecord<Scalar<V>>* springs, const PackedNodes<Scalar<V>>& nodes,
                            std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        Point<T> d;
        const T s = record_stretch(springs[i], nodes.displacement, d);
        const T strain = s / (1 + scalar_square_root(s + 1 > 0 ? s + 1 : T(0)));
        energy += static_cast<double>(springs[i].stiffness / (2 * springs[i].inverse_length2) * strain * strain);
    }
    return energy;
}

template <class T>
struct RecordVolume {
    Point<T> a, b, c, bc, ca, ab;
    T dilation;
};

/// The mean edges of a field at the corners of a cell: how a, b and c change with it.
template <class T>
HYBMSS_INLINE void mean_edges(const CellRecord<T>& cell, const T* field, Point<T> (&edges)[3]) {
    Point<T> d[4];
    for (int corner = 0; corner < 4; ++corner) {
        d[corner] = point_at(field + cell.node[7 - corner]) - point_at(field + cell.node[corner]);
    }
    const T quarter = T(0.25);
    edges[0] = quarter * ((d[0] - d[1]) + (d[2] - d[3]));
    edges[1] = quarter * ((d[0] + d[1]) - (d[2] + d[3]));
    edges[2] = quarter * ((d[0] + d[1]) + (d[2] + d[3]));
}

template <class T>
HYBMSS_INLINE RecordVolume<T> record_volume(const CellRecord<T>& cell, const T* u) {
    Point<T> change[3];
    mean_edges(cell, u, change);
    const Point<T>&da = change[0], &db = change[1], &dc = change[2];
    const Point<T> a0 = point_at(cell.rest_edge), b0 = point_at(cell.rest_edge + 3), c0 = point_at(cell.rest_edge + 6);
    const Point<T> a = a0 + da, b = b0 + db, c = c0 + dc;
    RecordVolume<T> volume{a, b, c, vector_product(b, c), vector_product(c, a), vector_product(a, b), T(0)};
    // V' - V0 = da.(b x c) + a0.(db x c) + a0.(b0 x dc)
    volume.dilation =
        (scalar_product(da, volume.bc) + scalar_product(a0, vector_product(db, c) + vector_product(b0, dc))) *
        cell.inverse_volume;
    return volume;
}

/// cbrt(1 + j) - 1: y = c - 1 is exact, and one Newton step adds what the rounding of c took.
template <class T>
HYBMSS_INLINE T scalar_cube_root_minus_one(T j) {
    const T c = scalar_cube_root(1 + j), y = c - 1;
    return y + (j - y * (3 + y * (3 + y))) / (3 * c * c);
}

/// phi'(J): j, or 3 (c - 1) / c^2, c = cbrt(1 + j), -6 below J = 1/8.
template <Volume volume, class T>
HYBMSS_INLINE T scalar_volume_slope(T j) {
    if constexpr (volume == Volume::quadratic) {
        return j;
    } else {
        const T e = scalar_cube_root_minus_one(j > T(-0.875) ? j : T(-0.875));
        return 3 * e / ((1 + e) * (1 + e));
    }
}

/// phi''(J): 1, or (2 - c) / c^5, 0 below J = 1/8.
template <Volume volume, class T>
HYBMSS_INLINE T scalar_volume_curvature(T j) {
    if constexpr (volume == Volume::quadratic) {
        return T(1);
    } else {
        if (!(j > T(-0.875))) {
            return T(0);
        }
        const T e = scalar_cube_root_minus_one(j), c2 = (1 + e) * (1 + e);
        return (1 - e) / (c2 * c2 * (1 + e));
    }
}

template <Volume volume, class T>
HYBMSS_INLINE T scalar_volume_energy(T j) {
    if constexpr (volume == Volume::quadratic) {
        return T(0.5) * j * j;
    } else {
        const T bounded = j > T(-0.875) ? j : T(-0.875), e = scalar_cube_root_minus_one(bounded);
        return T(4.5) * e * e + 6 * (bounded - j);
    }
}

/// f_i -= kappa phi'(J) / 4 (+-(b x c) +- (c x a) +- (a x b)).
template <Volume volume, class V>
void record_cells(const CellRecord<Scalar<V>>* cells, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                  std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const RecordVolume<T> cell = record_volume(cells[i], nodes.displacement);
        const T pressure = T(-0.25) * cells[i].kappa * scalar_volume_slope<volume>(cell.dilation);
        const Point<T> x = pressure * cell.bc, y = pressure * cell.ca, z = pressure * cell.ab;
        for (int corner = 0; corner < 8; ++corner) {
            const Point<T> along_x = T(corner & 1 ? 1 : -1) * x, along_y = T(corner & 2 ? 1 : -1) * y,
                           along_z = T(corner & 4 ? 1 : -1) * z;
            add_to(nodes.force + cells[i].node[corner], along_x + along_y + along_z);
        }
    }
}

/// Sum of kappa V0 phi(J).
template <Volume volume, class V>
double record_cell_energy(const CellRecord<Scalar<V>>* cells, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                          std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const Scalar<V> dilation = record_volume(cells[i], nodes.displacement).dilation;
        energy +=
            static_cast<double>(cells[i].kappa / cells[i].inverse_volume * scalar_volume_energy<volume>(dilation));
    }
    return energy;
}

/// As packed_integrate, a node at a time.
template <bool driven, class V>
void record_integrate(const PackedNodes<Scalar<V>>& nodes, const StepConstants<Scalar<V>>& step, std::ptrdiff_t begin,
                      std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t n = begin; n < end; ++n) {
        const T mass = nodes.inverse_mass[4 * n];
        for (std::ptrdiff_t c = 0; c < 3; ++c) {
            T& v = nodes.velocity[4 * n + c];
            if (driven && mass > 0) {
                v = v * step.velocity_factor + step.velocity_gain[c];
            }
            v += nodes.force[4 * n + c] * mass * step.force_factor;
            nodes.displacement[4 * n + c] += step.time_step * v;
            nodes.force[4 * n + c] = 0;
        }
    }
}

} // namespace
} // namespace hybmss::kernels
