#pragma once

// A vector of cells whose edges and face diagonals lie on the cell's means (SpringForm::means): displacements
// taken apart, and what acts on the parts.
//
// With A = 4a, B = 4b, C = 4c, the sums of four parallel edges, and G_i = 8 g_i, the patterns of PatternConstants, a
// corner moves A by its side in x, G_1 by the product of its sides in y and z, and so on. So what A, B, C feel acts on
// opposite corners by turns, and what G_i feel alike:
//
//     corner i: f_i - n_i,  corner 7 - i: -f_i - n_i
//     f_0 = Fa + Fb + Fc,  f_1 = Fb + Fc - Fa,  f_2 = Fa + Fc - Fb,  f_3 = Fc - Fb - Fa
//     n_0 = N1 + N2 + N3,  n_1 = N1 - N2 - N3,  n_2 = N2 - N1 - N3,  n_3 = N3 - N1 - N2
//
// Cube diagonals lie between corners: opposite ones, so they see A, B, C and the fourth pattern alone, which needs no
// energy of its own.

#include "kernels/lattice/lattice_cell.hpp"

namespace hybmss::kernels {
namespace {

/// The parts of a field at the corners of a vector of cells.
template <class V>
struct CellParts {
    Vector3<V> diagonal[4]; ///< from corner i to 7 - i
    Vector3<V> s, t;        ///< diagonal[0] + [1], [2] + [3]
    Vector3<V> a, b, c;     ///< of A, B, C
    Vector3<V> g[3];        ///< of G_1, G_2, G_3
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
    parts.s = d[0] + d[1];
    parts.t = d[2] + d[3];
    parts.a = (d[0] - d[1]) + (d[2] - d[3]);
    parts.b = parts.s - parts.t;
    parts.c = parts.s + parts.t;
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

/// |d|^2 / l^2 - 1 of the edges a, b, c.
template <class V>
HYBMSS_INLINE void edge_stretches(const CellParts<V>& change, V (&s)[3]) {
    const V eight = splat<V>(8), unit = splat<V>(Scalar<V>(1.0 / 16));
    const Vector3<V>&a = change.a, &b = change.b, &c = change.c;
    s[0] = unit * dot(a, Vector3<V>{a.x + eight, a.y, a.z});
    s[1] = unit * dot(b, Vector3<V>{b.x, b.y + eight, b.z});
    s[2] = unit * dot(c, Vector3<V>{c.x, c.y, c.z + eight});
}
/// Of the face diagonals a + b, a - b, a + c, a - c, b + c, b - c: (s_a + s_b) / 2 +- a.b / h^2.
template <class V>
HYBMSS_INLINE void face_stretches(const CellParts<V>& change, const MeanEdges<V>& edges, const V (&s)[3],
                                  V (&face)[6]) {
    const V four = splat<V>(4), half = splat<V>(Scalar<V>(0.5)), unit = splat<V>(Scalar<V>(1.0 / 16));
    const V ab = unit * multiply_add(four, change.b.x, dot(change.a, edges.b));
    const V ac = unit * multiply_add(four, change.c.x, dot(change.a, edges.c));
    const V bc = unit * multiply_add(four, change.c.y, dot(change.b, edges.c));
    const V mean_ab = half * (s[0] + s[1]), mean_ac = half * (s[0] + s[2]), mean_bc = half * (s[1] + s[2]);
    face[0] = mean_ab + ab, face[1] = mean_ab - ab;
    face[2] = mean_ac + ac, face[3] = mean_ac - ac;
    face[4] = mean_bc + bc, face[5] = mean_bc - bc;
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
    const Vector3<V>(&d)[4] = change.diagonal;
    const MeanEdges<V> edges = mean_edges(change);
    V s[3];
    edge_stretches(change, s);
    const V stretches[7] = {s[0],
                            s[1],
                            s[2],
                            CellSpring<0, 7>::stretch(d[0]),
                            CellSpring<1, 6>::stretch(d[1]),
                            CellSpring<2, 5>::stretch(d[2]),
                            CellSpring<3, 4>::stretch(d[3])};
    V tension[7];
    one_minus_rsqrt<accuracy>(stretches, tension);
    V p[3][3], w[3][3];
    pattern_projections(change.g, edges, p);
    pattern_tensions(p, k, constants, w);
    const V edge = k * splat<V>(constants.edge);
    Vector3<V> fa = multiply_add(edge * tension[0], edges.a, of_edge(w, 0, change.g));
    Vector3<V> fb = multiply_add(edge * tension[1], edges.b, of_edge(w, 1, change.g));
    Vector3<V> fc = multiply_add(edge * tension[2], edges.c, of_edge(w, 2, change.g));
    CornerForces<V> force;
    corner_sums(of_pattern(w[0], edges), of_pattern(w[1], edges), of_pattern(w[2], edges), force.even);
    if constexpr (face_diagonals) {
        // Tensions along a + b and a - b give their sum to both, their difference crosswise.
        V stretch[6], t[6];
        face_stretches(change, edges, s, stretch);
        one_minus_rsqrt<accuracy>(stretch, t);
        const V face = k * splat<V>(constants.face);
        const V ab = t[0] + t[1], ac = t[2] + t[3], bc = t[4] + t[5];
        const V across_ab = face * (t[0] - t[1]), across_ac = face * (t[2] - t[3]), across_bc = face * (t[4] - t[5]);
        fa = multiply_add(face * (ab + ac), edges.a,
                          multiply_add(across_ab, edges.b, multiply_add(across_ac, edges.c, fa)));
        fb = multiply_add(face * (ab + bc), edges.b,
                          multiply_add(across_ab, edges.a, multiply_add(across_bc, edges.c, fb)));
        fc = multiply_add(face * (ac + bc), edges.c,
                          multiply_add(across_ac, edges.a, multiply_add(across_bc, edges.b, fc)));
    }
    Vector3<V> with_a = fa, along = fb + fc, against = fc - fb;
    if constexpr (volume != Volume::none) {
        const CellVolume<V> cell = cell_volume(d[0], d[1], d[2], d[3]);
        const V pressure = kappa * volume_slope<volume>(cell.dilation);
        with_a = multiply_add(pressure, cell.st, with_a);
        along = multiply_add(pressure, cell.ta, along);
        against = multiply_add(pressure, cell.as, against);
    }
    force.odd[0] = multiply_add(k * tension[3], CellSpring<0, 7>::vector(d[0]), with_a + along);
    force.odd[1] = multiply_add(k * tension[4], CellSpring<1, 6>::vector(d[1]), along - with_a);
    force.odd[2] = multiply_add(k * tension[5], CellSpring<2, 5>::vector(d[2]), with_a + against);
    force.odd[3] = multiply_add(k * tension[6], CellSpring<3, 4>::vector(d[3]), against - with_a);
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
    V s[3];
    edge_stretches(change, s);
    // 1/2 k l^2 (|d|/l - 1)^2; the constants are k / 16.
    V sum = number(8) * splat<V>(constants.edge) * (squared_strain(s[0]) + squared_strain(s[1]) + squared_strain(s[2]));
    if constexpr (face_diagonals) {
        V face[6], faces = number(0);
        face_stretches(change, edges, s, face);
        for (const V stretch : face) {
            faces = faces + squared_strain(stretch);
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
    const V all[7] = {k, k, k, k, k, k, k};
    return multiply_add(k, sum, spring_energies(CubeDiagonals{}, u, all));
}

} // namespace
} // namespace hybmss::kernels
