#pragma once

// A vector of cells whose springs lie on the cell's means (SpringForm::means): displacements taken apart, and what acts
// on the parts.
//
// With A = 4a, B = 4b, C = 4c, the sums of four parallel edges, and G_i = 8 g_i, the patterns of PatternConstants, a
// corner moves A by its side in x, G_1 by the product of its sides in y and z, and so on. So what A, B, C feel acts on
// opposite corners by turns, and what G_i feel alike:
//
//     corner i: f_i - n_i,  corner 7 - i: -f_i - n_i
//     f_0 = Fa + Fb + Fc,  f_1 = Fb + Fc - Fa,  f_2 = Fa + Fc - Fb,  f_3 = Fc - Fb - Fa
//     n_0 = N1 + N2 + N3,  n_1 = N1 - N2 - N3,  n_2 = N2 - N1 - N3,  n_3 = N3 - N1 - N2
//
// G_4, which a corner moves by the product of its three sides, is odd: F4 adds to f_0 and f_3 and is taken from f_1 and
// f_2.

#include "kernels/lattice/lattice_cell.hpp"

#include <cstddef>

namespace hybmss::kernels {
namespace {

/// The parts of a field at the corners of a vector of cells.
template <class V>
struct CellParts {
    Vector3<V> diagonal[4]; ///< from corner i to 7 - i
    Vector3<V> a, b, c;     ///< of A, B, C
    Vector3<V> g[3];        ///< of G_1, G_2, G_3
    Vector3<V> fourth;      ///< of G_4
};

/// By differences of neighbours first: a body far from its rest position loses no digits.
template <class V>
HYBMSS_INLINE CellParts<V> cell_parts(const Vector3<V> (&u)[8]) {
    CellParts<V> parts;
    Vector3<V>(&d)[4] = parts.diagonal;
    d[0] = u[7] - u[0];
    d[1] = u[6] - u[1];
    d[2] = u[5] - u[2];
    d[3] = u[4] - u[3];
    const Vector3<V> s = d[0] + d[1], t = d[2] + d[3], p = d[0] - d[1], q = d[2] - d[3];
    parts.a = p + q;
    parts.b = s - t;
    parts.c = s + t;
    parts.fourth = p - q;
    const Vector3<V> outer = (u[7] - u[6]) - (u[1] - u[0]), inner = (u[5] - u[4]) - (u[3] - u[2]);
    parts.g[0] = ((u[6] - u[4]) + (u[7] - u[5])) - ((u[2] - u[0]) + (u[3] - u[1]));
    parts.g[1] = outer + inner;
    parts.g[2] = outer - inner;
    return parts;
}

/// A, B, C themselves, from their changes.
template <class V>
struct MeanEdges {
    Vector3<V> a, b, c;
};
template <class V>
HYBMSS_INLINE MeanEdges<V> mean_edges(const CellParts<V>& change) {
    const V four = splat<V>(4);
    return {{change.a.x + four, change.a.y, change.a.z},
            {change.b.x, change.b.y + four, change.b.z},
            {change.c.x, change.c.y, change.c.z + four}};
}

/// A symmetric matrix over A, B, C: of their products, all that springs see of them, or of what springs make of these.
template <class V>
struct MeanMatrix {
    V aa, bb, cc, ab, ac, bc;
};
/// Springs in this order: three edges, four cube diagonals a + b + c, a - b - c, a - b + c, a + b - c, six face
/// diagonals a + b, a - b, a + c, a - c, b + c, b - c; and l^2 in units of A, stiffness by k / 16 of the first seven.
template <bool face_diagonals>
inline constexpr std::size_t kMeanSprings = face_diagonals ? 13 : 7;
inline constexpr int kMeanLength2[13] = {16, 16, 16, 48, 48, 48, 48, 32, 32, 32, 32, 32, 32};
inline constexpr double kCube = 1.0 / 16;

/// r.M r of every spring's vector r.
template <std::size_t count, class V>
HYBMSS_INLINE void along_springs(const MeanMatrix<V>& m, V (&out)[count]) {
    const V two = splat<V>(2), plus = m.ab + m.ac, minus = m.ab - m.ac, ab = m.aa + m.bb, all = ab + m.cc;
    out[0] = m.aa, out[1] = m.bb, out[2] = m.cc;
    out[3] = multiply_add(two, m.bc + plus, all);
    out[4] = multiply_add(two, m.bc - plus, all);
    out[5] = subtract_product(two, m.bc + minus, all);
    out[6] = subtract_product(two, m.bc - minus, all);
    if constexpr (count > 7) {
        const V ac = m.aa + m.cc, bc = m.bb + m.cc;
        out[7] = multiply_add(two, m.ab, ab), out[8] = subtract_product(two, m.ab, ab);
        out[9] = multiply_add(two, m.ac, ac), out[10] = subtract_product(two, m.ac, ac);
        out[11] = multiply_add(two, m.bc, bc), out[12] = subtract_product(two, m.bc, bc);
    }
}
/// |d|^2 / l^2 - 1 of every spring, from the changes of the products.
template <std::size_t count, class V>
HYBMSS_INLINE void mean_stretches(const CellParts<V>& change, const MeanEdges<V>& edges, V (&s)[count]) {
    const V four = splat<V>(4), eight = splat<V>(8);
    const Vector3<V>&a = change.a, &b = change.b, &c = change.c;
    along_springs(MeanMatrix<V>{dot(a, Vector3<V>{a.x + eight, a.y, a.z}), dot(b, Vector3<V>{b.x, b.y + eight, b.z}),
                                dot(c, Vector3<V>{c.x, c.y, c.z + eight}), multiply_add(four, b.x, dot(a, edges.b)),
                                multiply_add(four, c.x, dot(a, edges.c)), multiply_add(four, c.y, dot(b, edges.c))},
                  s);
    for (std::size_t i = 0; i < count; ++i) {
        s[i] = splat<V>(static_cast<Scalar<V>>(1.0 / kMeanLength2[i])) * s[i];
    }
}
/// The sum of every spring's x r r^T, times its stiffness.
template <std::size_t count, class V>
HYBMSS_INLINE MeanMatrix<V> sum_of_springs(const V (&x)[count], V k, const MeanConstants<Scalar<V>>& constants) {
    const V edge = k * splat<V>(constants.edge), cube = k * splat<V>(Scalar<V>(kCube));
    const V plus = x[3] + x[4], minus = x[3] - x[4], other_plus = x[5] + x[6], other_minus = x[5] - x[6];
    const V all = cube * (plus + other_plus);
    MeanMatrix<V> sum = {multiply_add(edge, x[0], all), multiply_add(edge, x[1], all), multiply_add(edge, x[2], all),
                         cube * (minus - other_minus),  cube * (minus + other_minus),  cube * (plus - other_plus)};
    if constexpr (count > 7) {
        const V face = k * splat<V>(constants.face);
        const V ab = x[7] + x[8], ac = x[9] + x[10], bc = x[11] + x[12];
        sum.aa = multiply_add(face, ab + ac, sum.aa);
        sum.bb = multiply_add(face, ab + bc, sum.bb);
        sum.cc = multiply_add(face, ac + bc, sum.cc);
        sum.ab = multiply_add(face, x[7] - x[8], sum.ab);
        sum.ac = multiply_add(face, x[9] - x[10], sum.ac);
        sum.bc = multiply_add(face, x[11] - x[12], sum.bc);
    }
    return sum;
}
/// f + M (A, B, C)
template <class V>
HYBMSS_INLINE void add_product(const MeanMatrix<V>& m, const MeanEdges<V>& edges, Vector3<V> (&f)[3]) {
    const Vector3<V>&a = edges.a, &b = edges.b, &c = edges.c;
    f[0] = multiply_add(m.aa, a, multiply_add(m.ab, b, multiply_add(m.ac, c, f[0])));
    f[1] = multiply_add(m.ab, a, multiply_add(m.bb, b, multiply_add(m.bc, c, f[1])));
    f[2] = multiply_add(m.ac, a, multiply_add(m.bc, b, multiply_add(m.cc, c, f[2])));
}

/// 32 p_ia: G_i . A and so on; entry [i][0] goes with A, [1] with B, [2] with C.
template <class V>
HYBMSS_INLINE void pattern_projections(const Vector3<V> (&g)[3], const MeanEdges<V>& edges, V (&p)[3][3]) {
    for (int i = 0; i < 3; ++i) {
        p[i][0] = dot(g[i], edges.a);
        p[i][1] = dot(g[i], edges.b);
        p[i][2] = dot(g[i], edges.c);
    }
}
/// The energy's derivatives by them, in N: a constant has the squares of 4, 8 and h. Partners: (g_3 a, g_1 c), (g_3 b,
/// g_2 c), (g_2 a, g_1 b).
template <class V>
HYBMSS_INLINE void pattern_tensions(const V (&p)[3][3], V k, const MeanConstants<Scalar<V>>& constants, V (&w)[3][3]) {
    const V bending = k * splat<V>(constants.bending), coupling = splat<V>(constants.coupling);
    const auto pair = [&](int i, int j) HYBMSS_INLINE_BODY {
        w[i][j] = bending * multiply_add(coupling, p[j][i], p[i][j]);
        w[j][i] = bending * multiply_add(coupling, p[i][j], p[j][i]);
    };
    pair(2, 0);
    pair(2, 1);
    pair(1, 0);
    const V twist = k * splat<V>(constants.twist);
    const V together = k * splat<V>(constants.joint_twist) * (p[0][0] + p[1][1] + p[2][2]);
    for (int i = 0; i < 3; ++i) {
        w[i][i] = multiply_add(twist, p[i][i], together);
    }
}
/// sum over i, j of w[i][j] of what G_i and A, B, C feel.
template <class V>
HYBMSS_INLINE Vector3<V> of_pattern(const V (&w)[3], const MeanEdges<V>& edges) {
    return multiply_add(w[2], edges.c, multiply_add(w[1], edges.b, scaled(w[0], edges.a)));
}
template <class V>
HYBMSS_INLINE Vector3<V> of_edge(const V (&w)[3][3], int edge, const Vector3<V> (&g)[3]) {
    return multiply_add(w[2][edge], g[2], multiply_add(w[1][edge], g[1], scaled(w[0][edge], g[0])));
}

/// f_i and n_i of the corners 0 to 3 (above).
template <class V>
struct CornerForces {
    Vector3<V> odd[4], even[4];
};
template <class V>
HYBMSS_INLINE void corner_sums(const Vector3<V>& n1, const Vector3<V>& n2, const Vector3<V>& n3, Vector3<V> (&n)[4]) {
    const Vector3<V> sum = n2 + n3, difference = n2 - n3;
    n[0] = n1 + sum;
    n[1] = n1 - sum;
    n[2] = difference - n1;
    n[3] = n3 - (n1 + n2);
}

/// Forces of a vector of cells. Units: lengths h, stiffness k h, so forces are in N; `k` is the cube diagonals',
/// `kappa` the volume's, kappa h^2 / 32.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
HYBMSS_INLINE CornerForces<V> mean_cell_forces(const Vector3<V> (&u)[8], V k, V kappa,
                                               const MeanConstants<Scalar<V>>& constants) {
    const CellParts<V> change = cell_parts(u);
    const MeanEdges<V> edges = mean_edges(change);
    V s[kMeanSprings<face_diagonals>], t[kMeanSprings<face_diagonals>];
    mean_stretches(change, edges, s);
    one_minus_rsqrt<accuracy>(s, t);
    V p[3][3], w[3][3];
    pattern_projections(change.g, edges, p);
    pattern_tensions(p, k, constants, w);
    Vector3<V> f[3] = {of_edge(w, 0, change.g), of_edge(w, 1, change.g), of_edge(w, 2, change.g)};
    add_product(sum_of_springs(t, k, constants), edges, f);
    Vector3<V> with_a = f[0], along = f[1] + f[2], against = f[2] - f[1];
    CornerForces<V> force;
    corner_sums(of_pattern(w[0], edges), of_pattern(w[1], edges), of_pattern(w[2], edges), force.even);
    if constexpr (volume != Volume::none) {
        const Vector3<V>(&d)[4] = change.diagonal;
        const CellVolume<V> cell = cell_volume(d[0], d[1], d[2], d[3]);
        const V pressure = kappa * volume_slope<volume>(cell.dilation);
        with_a = multiply_add(pressure, cell.st, with_a);
        along = multiply_add(pressure, cell.ta, along);
        against = multiply_add(pressure, cell.as, against);
    }
    // What the fourth pattern adds to a's force on one pair of cube diagonals, it takes from it on the other.
    const V of_fourth = k * splat<V>(constants.fourth);
    const Vector3<V> more = multiply_add(of_fourth, change.fourth, with_a),
                     less = subtract_product(of_fourth, change.fourth, with_a);
    force.odd[0] = along + more;
    force.odd[1] = along - more;
    force.odd[2] = against + less;
    force.odd[3] = against - less;
    return force;
}

/// The energy of a vector of cells' springs and patterns, in units of force times h, and that of their volumes, of 32
/// times the same.
template <Volume volume, class V>
HYBMSS_INLINE V mean_cell_volume_energy(const Vector3<V> (&u)[8], V kappa) {
    return kappa * volume_energy<volume>(cell_volume(u[7] - u[0], u[6] - u[1], u[5] - u[2], u[4] - u[3]).dilation);
}
template <bool face_diagonals, class V>
HYBMSS_INLINE V mean_cell_energy(const Vector3<V> (&u)[8], V k, const MeanConstants<Scalar<V>>& constants) {
    const auto number = [](double value) { return splat<V>(static_cast<Scalar<V>>(value)); };
    const CellParts<V> change = cell_parts(u);
    const MeanEdges<V> edges = mean_edges(change);
    V s[kMeanSprings<face_diagonals>];
    mean_stretches(change, edges, s);
    // 1/2 k l^2 (|d|/l - 1)^2; the constants are k / 16.
    V sum = number(24 * kCube) *
            ((squared_strain(s[3]) + squared_strain(s[4])) + (squared_strain(s[5]) + squared_strain(s[6])));
    sum = multiply_add(number(8) * splat<V>(constants.edge),
                       squared_strain(s[0]) + squared_strain(s[1]) + squared_strain(s[2]), sum);
    if constexpr (face_diagonals) {
        V faces = number(0);
        for (std::size_t i = 7; i < 13; ++i) {
            faces = faces + squared_strain(s[i]);
        }
        sum = multiply_add(number(16) * splat<V>(constants.face), faces, sum);
    }
    V p[3][3], w[3][3];
    pattern_projections(change.g, edges, p);
    pattern_tensions(p, number(1), constants, w);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            sum = multiply_add(number(0.5) * w[i][j], p[i][j], sum);
        }
    }
    return k * multiply_add(number(0.5) * splat<V>(constants.fourth), dot(change.fourth, change.fourth), sum);
}

} // namespace
} // namespace hybmss::kernels
