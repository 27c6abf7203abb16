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

// ---- products

template <class V>
HYBMSS_INLINE CellVolume<V> volume_of_cells(const Vector3<V> (&u)[8]) {
    return cell_volume(u[7] - u[0], u[6] - u[1], u[5] - u[2], u[4] - u[3]);
}

/// Adds the product of a vector of cells' volumes to that of their cube diagonals, on the corners 0 to 3.
///
/// With V' = 4a . (S x T) / 32, the gradient with respect to cube diagonal 0 is (S x T + T x 4a) / 32, and so on
/// (lattice_cell.hpp). K p is its change, kappa [ phi'' dJ grad V' + phi' d grad V' ], when the corners move by p:
///
///     dJ = (d4a . (S x T) + dS . (T x 4a) + dT . (4a x S)) / 32,  d(S x T) = dS x T + S x dT, ...
template <class V>
HYBMSS_INLINE void add_volume_product(const CellVolume<V>& cell, const VolumeDerivatives<V>& phi,
                                      const Vector3<V> (&p)[8], V scale, Scalar<V> geometric,
                                      Vector3<V> (&product)[4]) {
    const Vector3<V> p0 = p[0] - p[7], p1 = p[1] - p[6], p2 = p[2] - p[5], p3 = p[3] - p[4];
    const Vector3<V> ds = p0 + p1, dt = p2 + p3, da = (p0 - p1) + (p2 - p3);
    const V change =
        (dot(da, cell.st) + dot(ds, cell.ta) + dot(dt, cell.as)) * splat<V>(static_cast<Scalar<V>>(1.0 / 32.0));
    const V along = scale * phi.curvature * change, pressure = scale * splat<V>(geometric) * phi.slope;
    const Vector3<V> ws = scaled(pressure, ds), wt = scaled(pressure, dt), wa = scaled(pressure, da);
    const Vector3<V> st = add_cross(cell.s, wt, add_cross(ws, cell.t, scaled(along, cell.st)));
    const Vector3<V> ta = add_cross(cell.t, wa, add_cross(wt, cell.a, scaled(along, cell.ta)));
    const Vector3<V> as = add_cross(cell.a, ws, add_cross(wa, cell.s, scaled(along, cell.as)));
    product[0] = product[0] + (st + ta);
    product[1] = product[1] + (ta - st);
    product[2] = product[2] + (st + as);
    product[3] = product[3] + (as - st);
}

template <Volume volume, class V>
HYBMSS_INLINE void add_volume_product(const Vector3<V> (&u)[8], const Vector3<V> (&p)[8], V scale, Scalar<V> geometric,
                                      Vector3<V> (&product)[4]) {
    const CellVolume<V> cell = volume_of_cells(u);
    add_volume_product(cell, volume_derivatives<volume>(cell.dilation), p, scale, geometric, product);
}

template <class V, int corners, class... Springs>
HYBMSS_INLINE V stiffening_energies(SpringGroup<Springs...>, const Vector3<V> (&u)[corners], const V (&k)[7],
                                    const StiffeningConstants<Scalar<V>>& c) {
    V sum = splat<V>(0);
    ((sum = multiply_add(k[Springs::kKind] * splat<V>(Scalar<V>(Springs::kLength2)),
                         stiffening_energy(Springs::stretch(u[Springs::b] - u[Springs::a]), c), sum)),
     ...);
    return sum;
}

// ---- diagonal blocks

template <class V>
HYBMSS_INLINE Symmetric3<V> next_column(const Symmetric3<V>& high, Symmetric3<V>& carry) {
    Symmetric3<V> moved;
    for (int i = 0; i < kBlockEntries; ++i) {
        moved.entry[i] = shift_in(carry.entry[i], high.entry[i]);
    }
    carry = high;
    return moved;
}

template <class V, class T>
HYBMSS_INLINE void add_blocks(T* const (&blocks)[kBlockEntries], std::ptrdiff_t n, const Symmetric3<V>& b) {
    for (int i = 0; i < kBlockEntries; ++i) {
        store_lanes(blocks[i] + n, load_lanes<V>(blocks[i] + n) + b.entry[i]);
    }
}

/// Adds a group's H to the blocks of both corners of each spring.
template <Accuracy accuracy, SpringLaw law, class V, int corners, class... Springs>
HYBMSS_INLINE void add_spring_blocks(SpringGroup<Springs...>, const Vector3<V> (&u)[corners], const V (&k)[7],
                                     const StiffeningConstants<Scalar<V>>& constants,
                                     Symmetric3<V> (&blocks)[corners]) {
    const auto add = [&](auto spring) HYBMSS_INLINE_BODY {
        using Spring = decltype(spring);
        const Vector3<V> du = u[Spring::b] - u[Spring::a];
        const V s = Spring::stretch(du);
        const Symmetric3<V> h =
            law_block<law>(k[Spring::kKind], s, one_minus_rsqrt<accuracy>(s),
                           splat<V>(static_cast<Scalar<V>>(1.0 / Spring::kLength2)), Spring::vector(du), constants);
        blocks[Spring::a] = blocks[Spring::a] + h;
        blocks[Spring::b] = blocks[Spring::b] + h;
    };
    (add(Springs{}), ...);
}

/// Adds kappa phi''/V0 (grad V')(grad V')^T of a vector of cells, corner by corner; the second derivative of V' with
/// respect to one corner is zero.
template <class V>
HYBMSS_INLINE void add_volume_blocks(const CellVolume<V>& cell, V curvature, Symmetric3<V> (&blocks)[8]) {
    const V along = curvature * splat<V>(static_cast<Scalar<V>>(1.0 / 32.0));
    const Vector3<V> gradient[4] = {cell.st + cell.ta, cell.ta - cell.st, cell.st + cell.as, cell.as - cell.st};
    for (int corner = 0; corner < 4; ++corner) {
        const Symmetric3<V> h = rank_one(splat<V>(0), along, gradient[corner]);
        blocks[corner] = blocks[corner] + h;
        blocks[7 - corner] = blocks[7 - corner] + h;
    }
}
template <Volume volume, class V>
HYBMSS_INLINE void add_volume_blocks(const Vector3<V> (&u)[8], V scale, Symmetric3<V> (&blocks)[8]) {
    const CellVolume<V> cell = volume_of_cells(u);
    add_volume_blocks(cell, scale * volume_derivatives<volume>(cell.dilation).curvature, blocks);
}

} // namespace
} // namespace hybmss::kernels
