#pragma once

// The layout flat-rows: rows, and the planes above, lie at fixed distances.

#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

template <class Layer>
HYBMSS_INLINE CellRows rows_at(const Layer& layer, std::ptrdiff_t n) {
    return {n, n + layer.row, n, n + layer.row};
}

/// One layer of cells: adds to `partial`, finishes its nodes, sets `above`.
///
/// A node is used only by cells at or before it, so the nodes of a vector are finished, and may be integrated in place,
/// as soon as the sweep has passed.
template <bool face_diagonals, Volume volume, Accuracy accuracy, Finish finish, class V>
void lattice_layer(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = 0; n < layer.row; n += kWidth<V>) {
        store_force<V>(layer.above, n, {zero, zero, zero});
    }
    // Behind what the cells set.
    for (std::ptrdiff_t n = layer.cell_lanes + layer.row; n < layer.lanes; n += kWidth<V>) {
        store_force<V>(layer.above, n, {zero, zero, zero});
    }
    auto carry = no_carry<V>();
    std::ptrdiff_t n = 0;
    for (; n < layer.cell_lanes; n += kWidth<V>) {
        sweep_cells<face_diagonals, volume, accuracy, finish, true, V>(layer, rows_at(layer, n), carry);
    }
    // In the last row cells are void, and so are the springs across it.
    for (; n < layer.lanes; n += kWidth<V>) {
        sweep_last_row<face_diagonals, accuracy, finish, V>(layer, rows_at(layer, n), carry);
    }
}

/// The topmost node plane, above which there are no cells; `above` is not touched.
template <bool face_diagonals, Accuracy accuracy, Finish finish, class V>
void lattice_top(const LatticeLayer<Scalar<V>>& layer) {
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        sweep_top<face_diagonals, accuracy, finish, V>(layer, rows_at(layer, n), carry);
    }
}

/// The energy of a layer's cells and of the springs that start at its nodes; with `top` of the topmost plane's springs.
template <bool face_diagonals, Volume volume, bool top, class V>
LayerEnergy lattice_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        add_energy<face_diagonals, volume, top, V>(layer, rows_at(layer, n), energy);
    }
    return energy;
}

} // namespace
} // namespace hybmss::kernels
