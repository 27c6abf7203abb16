#pragma once

// The layout active-rows: a plane holds those vectors of its rows that the body has nodes in, and lists where their
// neighbours lie.

#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

/// Vector v lies at (v + 1) widths: the first one of a plane is void, the neighbour of all that have none.
template <class V, class Layer>
HYBMSS_INLINE CellRows listed_rows(const Layer& layer, std::ptrdiff_t n) {
    const VectorNeighbors& neighbors = layer.neighbors[n / kWidth<V> - 1];
    return {n, neighbors.low_y, neighbors.high, neighbors.high_y};
}

/// One layer of cells: adds to `partial`, finishes its nodes, sets `above`.
///
/// The forces that leave a vector at its end reach the next one in the list. Where that is no neighbour, the last cell
/// is void: a filled one has nodes in both.
template <bool face_diagonals, Volume volume, Accuracy accuracy, Finish finish, class V>
void active_layer(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = 0; n < layer.upper_lanes; n += kWidth<V>) {
        store_force<V>(layer.above, n, {zero, zero, zero});
    }
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        sweep_cells<face_diagonals, volume, accuracy, finish, false, V>(layer, listed_rows<V>(layer, n), carry);
    }
}

/// The topmost node plane, above which there are no cells; `above` is not touched.
template <bool face_diagonals, Accuracy accuracy, Finish finish, class V>
void active_top(const LatticeLayer<Scalar<V>>& layer) {
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        sweep_top<face_diagonals, accuracy, finish, V>(layer, listed_rows<V>(layer, n), carry);
    }
}

/// The energy of a layer's cells and of the springs that start at its nodes; with `top` of the topmost plane's springs.
template <bool face_diagonals, Volume volume, bool top, class V>
LayerEnergy active_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        add_energy<face_diagonals, volume, top, V>(layer, listed_rows<V>(layer, n), energy);
    }
    return energy;
}

} // namespace
} // namespace hybmss::kernels
