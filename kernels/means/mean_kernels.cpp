// Compiled once for each instruction set: forces, steps and energies of lattices with springs on means.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"
#include "kernels/means/mean_cell.hpp"

namespace hybmss::kernels {
namespace {

template <class V, class T>
HYBMSS_INLINE void load_corners(const LatticeLayer<T>& layer, const CellRows& at, Vector3<V> (&u)[8]) {
    load_row<V, T>(layer, at.low, u[0], u[1]);
    load_row<V, T>(layer, at.low_y, u[2], u[3]);
    load_row<V, T>(layer, layer.plane + at.high, u[4], u[5]);
    load_row<V, T>(layer, layer.plane + at.high_y, u[6], u[7]);
}

/// One vector of cells, as sweep_cells: adds to `partial`, finishes the nodes at `low`, adds to `above`, or sets its
/// row `high_y` where `sets_above`.
template <bool face_diagonals, Volume volume, Accuracy accuracy, bool sets_above, class V>
HYBMSS_INLINE void sweep_mean_cells(const LatticeLayer<Scalar<V>>& layer, const CellRows& at, ColumnCarry<V>& carry) {
    Vector3<V> u[8];
    load_corners<V>(layer, at, u);
    const V k = load_lanes<V>(layer.stiffness[6] + at.low);
    const CornerForces<V> force =
        mean_cell_forces<face_diagonals, volume, accuracy>(u, k, k * splat<V>(layer.volume_ratio), layer.means);
    const Vector3<V>(&f)[4] = force.odd, (&n)[4] = force.even;
    // Corners 4 to 7 with the sign reversed.
    const Vector3<V> minus_f6 = f[1] + n[1], minus_f7 = next_column(f[0] + n[0], carry.high_y);
    if constexpr (sets_above) {
        const V zero = splat<V>(0);
        store_force<V>(layer.above, at.high_y, Vector3<V>{zero, zero, zero} - minus_f6 - minus_f7);
    } else {
        store_force<V>(layer.above, at.high_y, load_force<V>(layer.above, at.high_y) - minus_f6 - minus_f7);
    }
    store_force<V>(layer.above, at.high,
                   load_force<V>(layer.above, at.high) - (f[3] + n[3]) - next_column(f[2] + n[2], carry.high));
    store_force<V>(layer.partial, at.low_y,
                   load_force<V>(layer.partial, at.low_y) + (f[2] - n[2]) + next_column(f[3] - n[3], carry.low_y));
    finish_nodes(layer, at.low,
                 load_force<V>(layer.partial, at.low) + (f[0] - n[0]) + next_column(f[1] - n[1], carry.low));
}

/// In flat rows, as lattice_layer: adds to `partial`, finishes its nodes, sets `above`.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void mean_layer(const LatticeLayer<Scalar<V>>& layer) {
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
        sweep_mean_cells<face_diagonals, volume, accuracy, true, V>(layer, rows_at(layer, n), carry);
    }
    // Nodes of the last row alone: the last cell before them is void and carries nothing on.
    for (; n < layer.lanes; n += kWidth<V>) {
        finish_nodes(layer, n, load_force<V>(layer.partial, n));
    }
}

/// In active rows, as active_layer.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void active_mean_layer(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = 0; n < layer.upper_lanes; n += kWidth<V>) {
        store_force<V>(layer.above, n, {zero, zero, zero});
    }
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        sweep_mean_cells<face_diagonals, volume, accuracy, false, V>(layer, listed_rows<V>(layer, n), carry);
    }
}

/// The topmost node plane: nothing but its sums is left.
template <class V>
void mean_top(const LatticeLayer<Scalar<V>>& layer) {
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        finish_nodes(layer, n, load_force<V>(layer.partial, n));
    }
}

/// Of a layer of cells, in flat or active rows.
template <bool face_diagonals, Volume volume, class V>
LayerEnergy mean_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8];
        load_corners<V>(layer, at, u);
        const V k = load_lanes<V>(layer.stiffness[6] + at.low);
        add_in_double(energy.springs, mean_cell_energy<face_diagonals>(u, k, layer.means));
        if constexpr (volume != Volume::none) {
            add_in_double(energy.volume, mean_cell_volume_energy<volume>(u, k * splat<V>(layer.volume_ratio)));
        }
    }
    return energy;
}

} // namespace

HYBMSS_DEFINE_KERNEL(mean_layer);
HYBMSS_DEFINE_KERNEL(active_mean_layer);
HYBMSS_DEFINE_KERNEL(mean_top);
HYBMSS_DEFINE_ORDERED_KERNEL(mean_energy);

} // namespace hybmss::kernels
