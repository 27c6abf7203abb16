#pragma once

// What the kernels of networks with packed nodes share: springs and cells in blocks.

#include "kernels/network/network_quads.hpp"
#include "kernels/spring_law.hpp"
#include "kernels/volume_law.hpp"

namespace hybmss::kernels {
namespace {

/// x, y, z of u_to - u_from, for a vector of pairs of nodes. Subtracted before it is transposed: one transposition,
/// not two.
template <class V>
HYBMSS_INLINE Vector3<V> quad_difference(const Scalar<V>* u, const std::int32_t* from, const std::int32_t* to) {
    V low[4], high[4];
    load_quads(u, from, low);
    load_quads(u, to, high);
    for (int j = 0; j < 4; ++j) {
        high[j] = high[j] - low[j];
    }
    transpose_quads(high);
    return {high[0], high[1], high[2]};
}

template <class V>
HYBMSS_INLINE void vector_to_quads(const Vector3<V>& v, V (&q)[4]) {
    q[0] = v.x;
    q[1] = v.y;
    q[2] = v.z;
    q[3] = splat<V>(0);
    transpose_quads(q);
}

/// s = |d|^2 / l^2 - 1 = (2 r.du + du.du) / l^2 of the springs at `lane` of a block.
template <class V>
HYBMSS_INLINE V block_stretch(const SpringBlock<Scalar<V>>& block, int lane, const Scalar<V>* u, Vector3<V>& rest,
                              Vector3<V>& du) {
    du = quad_difference<V>(u, block.a + lane, block.b + lane);
    rest = {load_lanes<V>(block.rest[0] + lane), load_lanes<V>(block.rest[1] + lane),
            load_lanes<V>(block.rest[2] + lane)};
    return load_lanes<V>(block.inverse_length2 + lane) * multiply_add(splat<V>(2), dot(rest, du), dot(du, du));
}

/// A cell's deformed mean edges, the cofactors b x c, c x a, a x b, and J - 1.
template <class V>
struct BlockVolume {
    Vector3<V> a, b, c, bc, ca, ab;
    V dilation;
};

/// A mean of four edges is a quarter of a signed sum over the cube diagonals 0-7, 1-6, 2-5, 3-4, formed before anything
/// is transposed.
template <class V>
HYBMSS_INLINE void mean_edges(const V (&diagonal)[4][4], Vector3<V> (&edges)[3]) {
    V mean[3][4];
    const V quarter = splat<V>(Scalar<V>(0.25));
    for (int j = 0; j < 4; ++j) {
        const V d0 = diagonal[0][j], d1 = diagonal[1][j], d2 = diagonal[2][j], d3 = diagonal[3][j];
        const V sum01 = d0 + d1, sum23 = d2 + d3;
        mean[0][j] = quarter * ((d0 - d1) + (d2 - d3));
        mean[1][j] = quarter * (sum01 - sum23);
        mean[2][j] = quarter * (sum01 + sum23);
    }
    for (int edge = 0; edge < 3; ++edge) {
        transpose_quads(mean[edge]);
        edges[edge] = {mean[edge][0], mean[edge][1], mean[edge][2]};
    }
}

/// The mean edges of a field at the corners of cells: how a, b and c change with it.
template <class V>
HYBMSS_INLINE void mean_edges(const CellBlock<Scalar<V>>& block, int lane, const Scalar<V>* field,
                              Vector3<V> (&edges)[3]) {
    V diagonal[4][4];
    for (int corner = 0; corner < 4; ++corner) {
        V low[4];
        load_quads(field, block.node[corner] + lane, low);
        load_quads(field, block.node[7 - corner] + lane, diagonal[corner]);
        for (int j = 0; j < 4; ++j) {
            diagonal[corner][j] = diagonal[corner][j] - low[j];
        }
    }
    mean_edges(diagonal, edges);
}

/// From the changes of the mean edges; `shapes` has the rest shapes.
template <class V, class Shapes>
HYBMSS_INLINE BlockVolume<V> deformed_volume(const Shapes& shapes, int lane, const Vector3<V> (&change)[3]) {
    Vector3<V> rest[3];
    for (int edge = 0; edge < 3; ++edge) {
        rest[edge] = {load_lanes<V>(shapes.rest_edge[3 * edge] + lane),
                      load_lanes<V>(shapes.rest_edge[3 * edge + 1] + lane),
                      load_lanes<V>(shapes.rest_edge[3 * edge + 2] + lane)};
    }
    const Vector3<V>&da = change[0], &db = change[1], &dc = change[2];
    const Vector3<V> a = rest[0] + da, b = rest[1] + db, c = rest[2] + dc;
    BlockVolume<V> cell{a, b, c, cross(b, c), cross(c, a), cross(a, b), {}};
    // V' - V0 = da.(b x c) + a0.(db x c) + a0.(b0 x dc), each term of the first order in the displacement.
    cell.dilation = (dot(da, cell.bc) + dot(rest[0], cross(db, c) + cross(rest[1], dc))) *
                    load_lanes<V>(shapes.inverse_volume + lane);
    return cell;
}

template <class V>
HYBMSS_INLINE BlockVolume<V> block_volume(const CellBlock<Scalar<V>>& block, int lane, const Scalar<V>* u) {
    Vector3<V> change[3];
    mean_edges(block, lane, u, change);
    return deformed_volume(block, lane, change);
}

/// The forces on the corners 0, 1, 2, 3, as quads; those on 7, 6, 5, 4 are opposite.
template <Volume volume, class V>
HYBMSS_INLINE void corner_forces(const BlockVolume<V>& cell, V kappa, V (&force)[4][4]) {
    const V pressure = kappa * splat<V>(Scalar<V>(0.25)) * volume_slope<volume>(cell.dilation);
    // Three transpositions back; the four pairs of corners are signed sums of what they give.
    V bc[4], ca[4], ab[4];
    vector_to_quads(scaled(pressure, cell.bc), bc);
    vector_to_quads(scaled(pressure, cell.ca), ca);
    vector_to_quads(scaled(pressure, cell.ab), ab);
    for (int j = 0; j < 4; ++j) {
        const V plus = bc[j] + ca[j], minus = bc[j] - ca[j];
        force[0][j] = plus + ab[j];
        force[1][j] = ab[j] - minus;
        force[2][j] = minus + ab[j];
        force[3][j] = ab[j] - plus;
    }
}

} // namespace
} // namespace hybmss::kernels
