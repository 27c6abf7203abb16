#pragma once

// What the sweeps of second derivatives share, of products (lattice_product_kernels.cpp) and of diagonals.

#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

/// Of a field with three components: those of a row of node vectors, and of their neighbours one further in x.
template <class V>
HYBMSS_INLINE void load_row(const Scalar<V>* const (&field)[3], std::ptrdiff_t n, Vector3<V>& low, Vector3<V>& high) {
    low = {load_lanes<V>(field[0] + n), load_lanes<V>(field[1] + n), load_lanes<V>(field[2] + n)};
    high = {load_lanes<V>(field[0] + n + 1), load_lanes<V>(field[1] + n + 1), load_lanes<V>(field[2] + n + 1)};
}

/// The eight corners of a vector of cells.
template <class V, class Layer>
HYBMSS_INLINE void load_cells(const Layer& layer, const Scalar<V>* const (&field)[3], const CellRows& at,
                              Vector3<V> (&corner)[8]) {
    load_row<V>(field, at.low, corner[0], corner[1]);
    load_row<V>(field, at.low_y, corner[2], corner[3]);
    load_row<V>(field, layer.plane + at.high, corner[4], corner[5]);
    load_row<V>(field, layer.plane + at.high_y, corner[6], corner[7]);
}

// Flat or active rows, found out at run time: a vector of cells has work enough to hide the question. So all layouts
// share these kernels.
template <class V, class Layer>
HYBMSS_INLINE CellRows hessian_rows(const Layer& layer, std::ptrdiff_t n) {
    return layer.neighbors ? listed_rows<V>(layer, n) : rows_at(layer, n);
}
/// The first vector: in active rows, the one at 0 is void.
template <class V, class Layer>
HYBMSS_INLINE std::ptrdiff_t first_vector(const Layer& layer) {
    return layer.neighbors ? kWidth<V> : 0;
}
/// All that a sweep adds to in `above`.
template <class V, class T, int components>
HYBMSS_INLINE void clear_above(const LatticeHessianLayer<T, components>& layer) {
    const std::ptrdiff_t end = layer.neighbors ? layer.upper_lanes : layer.plane;
    for (int c = 0; c < components; ++c) {
        for (std::ptrdiff_t n = 0; n < end; n += kWidth<V>) {
            store_lanes(layer.above[c] + n, splat<V>(0));
        }
    }
}

/// partial += above, where two slabs meet.
template <class V, int components>
HYBMSS_INLINE void join_planes(const LatticeHessianLayer<Scalar<V>, components>& layer) {
    for (int c = 0; c < components; ++c) {
        for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
            store_lanes(layer.partial[c] + n, load_lanes<V>(layer.partial[c] + n) + load_lanes<V>(layer.above[c] + n));
        }
    }
}

} // namespace
} // namespace hybmss::kernels
