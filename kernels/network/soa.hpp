#pragma once

// What the kernels of networks as structure of arrays share: springs and cells by the indices of their nodes.

#include "kernels/spring_law.hpp"

namespace hybmss::kernels {
namespace {

/// The nodes of a vector of ends.
struct NodeLanes {
    const std::int32_t* index;
    bool in_row; ///< index[0], index[0] + 1, ...
};
HYBMSS_INLINE NodeLanes node_lanes(const std::int32_t* index, const std::uint8_t* in_row, std::ptrdiff_t i) {
    return {index + i, in_row[i / kMaxWidth] != 0};
}

/// visit(number, where it begins) of the vectors that are added up as one from i on.
template <class V, class Visit>
HYBMSS_INLINE void for_together(std::ptrdiff_t i, const Visit& visit) {
    for (int v = 0; v < kTogether<V>; ++v) {
        visit(v, i + v * kWidth<V>);
    }
}

template <class V, class T>
HYBMSS_INLINE V gather_lanes(const T* field, const NodeLanes& at) {
    return at.in_row ? load_lanes<V>(field + at.index[0]) : gather_lanes<V>(field, at.index);
}
template <class V, class T>
HYBMSS_INLINE void scatter_lanes(V v, T* field, const NodeLanes& at) {
    if (at.in_row) {
        store_lanes(field + at.index[0], v);
    } else {
        scatter_lanes(v, field, at.index);
    }
}

/// `at`: indices, or NodeLanes.
template <class V, class T, class Lanes>
HYBMSS_INLINE Vector3<V> gather_vector(T* const (&field)[3], const Lanes& at) {
    return {gather_lanes<V>(field[0], at), gather_lanes<V>(field[1], at), gather_lanes<V>(field[2], at)};
}
template <class V, class T, class Lanes>
HYBMSS_INLINE void scatter_vector(const Vector3<V>& v, T* const (&field)[3], const Lanes& at) {
    scatter_lanes(v.x, field[0], at);
    scatter_lanes(v.y, field[1], at);
    scatter_lanes(v.z, field[2], at);
}

/// du, and s = |d|^2 / l^2 - 1 = (2 r.du + du.du) / l^2, of the springs at i ... i + width.
template <class V, class T, class Field>
HYBMSS_INLINE V spring_stretch(const NetworkSprings<T>& springs, const Field& displacement, std::ptrdiff_t i,
                               Vector3<V>& rest, Vector3<V>& du) {
    rest = {load_lanes<V>(springs.rest[0] + i), load_lanes<V>(springs.rest[1] + i), load_lanes<V>(springs.rest[2] + i)};
    du = gather_vector<V>(displacement, node_lanes(springs.b, springs.in_row, i)) -
         gather_vector<V>(displacement, node_lanes(springs.a, springs.in_row, i));
    return load_lanes<V>(springs.inverse_length2 + i) * multiply_add(splat<V>(2), dot(rest, du), dot(du, du));
}

/// The deformed mean edges of a cell, the cofactors b x c, c x a, a x b, and J - 1.
template <class V>
struct HexahedronVolume {
    Vector3<V> a, b, c, bc, ca, ab;
    V dilation;
};

/// The mean edges of a field at the corners of cells: how a, b and c change with it.
template <class V, class T, class Field>
HYBMSS_INLINE void mean_edges(const NetworkCells<T>& cells, const Field& field, std::ptrdiff_t i,
                              Vector3<V> (&edges)[3]) {
    // Sums over the corners by the three bits of their number: the mean of four edges is a quarter of a signed sum.
    Vector3<V> u[8];
    for (int corner = 0; corner < 8; ++corner) {
        u[corner] = gather_vector<V>(field, node_lanes(cells.node[corner], cells.in_row, i));
    }
    const Vector3<V> d0 = u[7] - u[0], d1 = u[6] - u[1], d2 = u[5] - u[2], d3 = u[4] - u[3];
    const Vector3<V> sum01 = d0 + d1, sum23 = d2 + d3;
    const V quarter = splat<V>(T(0.25));
    edges[0] = scaled(quarter, (d0 - d1) + (d2 - d3));
    edges[1] = scaled(quarter, sum01 - sum23);
    edges[2] = scaled(quarter, sum01 + sum23);
}

template <class V, class T, class Field>
HYBMSS_INLINE HexahedronVolume<V> hexahedron_volume(const NetworkCells<T>& cells, const Field& displacement,
                                                    std::ptrdiff_t i) {
    Vector3<V> change[3];
    mean_edges(cells, displacement, i, change);
    const Vector3<V>&da = change[0], &db = change[1], &dc = change[2];
    const auto rest = [&](int edge) {
        return Vector3<V>{load_lanes<V>(cells.rest_edge[3 * edge] + i),
                          load_lanes<V>(cells.rest_edge[3 * edge + 1] + i),
                          load_lanes<V>(cells.rest_edge[3 * edge + 2] + i)};
    };
    const Vector3<V> a0 = rest(0), b0 = rest(1), c0 = rest(2);
    const Vector3<V> a = a0 + da, b = b0 + db, c = c0 + dc;
    HexahedronVolume<V> cell{a, b, c, cross(b, c), cross(c, a), cross(a, b), {}};
    // V' - V0 = da.(b x c) + a0.(db x c) + a0.(b0 x dc), each term of the first order in the displacement.
    cell.dilation =
        (dot(da, cell.bc) + dot(a0, cross(db, c) + cross(b0, dc))) * load_lanes<V>(cells.inverse_volume + i);
    return cell;
}

} // namespace
} // namespace hybmss::kernels
