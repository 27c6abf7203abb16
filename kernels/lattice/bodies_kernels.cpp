// Many equal bodies: a lane of a vector is a body. Compiled once for each instruction set.
//
// The sweep of flat-rows, with the next node a vector on: nothing is shifted, and no lane is void. In flat-rows cells
// beyond the body are swept with stiffness zero; here the ends of rows, and the last row of the topmost plane, have
// functions of their own for the springs that are there. They add up as sweep_cells, sweep_last_row and sweep_top do
// where all others pull with nothing: a body has the same bits as by itself.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

using Bodies = NodesOfBodies;

// Springs that lie in a side normal to x.
using EndEdges = SpringGroup<CellSpring<0, 2>, CellSpring<0, 4>>;
using EndEdgesAndFaceDiagonals = SpringGroup<CellSpring<0, 2>, CellSpring<0, 4>, CellSpring<2, 4>, CellSpring<0, 6>>;
template <bool face_diagonals>
using EndSprings = std::conditional_t<face_diagonals, EndEdgesAndFaceDiagonals, EndEdges>;

template <class V>
HYBMSS_INLINE V stiffness_at(const LatticeLayer<Scalar<V>>& layer, int kind, std::ptrdiff_t n) {
    return Bodies::made<V>(layer.stiffness[kind], n);
}
/// The end of a row of cells: springs within the side, which lies in y and z.
template <bool face_diagonals, Accuracy accuracy, class V>
HYBMSS_INLINE void sweep_end(const LatticeLayer<Scalar<V>>& layer, const CellRows& at, const ColumnCarry<V>& carry) {
    const V zero = splat<V>(0);
    const Vector3<V> none{zero, zero, zero};
    Vector3<V> u[7];
    u[0] = load_nodes<V>(layer, at.low);
    u[2] = load_nodes<V>(layer, at.low_y);
    u[4] = load_nodes<V>(layer, layer.plane + at.high);
    u[6] = load_nodes<V>(layer, layer.plane + at.high_y);
    V k[7];
    for (int kind : {1, 2, 5}) {
        k[kind] = stiffness_at<V>(layer, kind, at.low);
    }
    const auto tension = spring_tensions<accuracy>(EndSprings<face_diagonals>{}, u, k);
    Vector3<V> f0 = none, f2 = none, minus_f4 = none, f6 = none;
    if constexpr (face_diagonals) {
        f0 = spring_force<0, 6>(u, tension);
        f6 = none - f0;
    }
    store_force<V>(layer.above, at.high_y, f6 - carry.high_y);
    pull<0, 4>(f0, u, tension);
    pull<0, 4>(minus_f4, u, tension);
    if constexpr (face_diagonals) {
        pull<2, 4>(f2, u, tension);
        pull<2, 4>(minus_f4, u, tension);
    }
    store_force<V>(layer.above, at.high, load_force<V>(layer.above, at.high) - minus_f4 - carry.high);
    pull<0, 2>(f0, u, tension);
    push<0, 2>(f2, u, tension);
    store_force<V>(layer.partial, at.low_y, load_force<V>(layer.partial, at.low_y) + f2 + carry.low_y);
    finish_nodes<Bodies>(layer, at.low, load_force<V>(layer.partial, at.low) + f0 + carry.low);
}

/// The force of the spring from a node to its neighbour on the high side along one axis, of two vectors of nodes.
template <int corner, Accuracy accuracy, class V>
HYBMSS_INLINE Vector3<V> edge_force(const LatticeLayer<Scalar<V>>& layer, std::ptrdiff_t n, std::ptrdiff_t neighbor) {
    Vector3<V> u[corner + 1];
    u[0] = load_nodes<V>(layer, n);
    u[corner] = load_nodes<V>(layer, neighbor);
    V k[7];
    constexpr int kKind = CellSpring<0, corner>::kKind;
    k[kKind] = stiffness_at<V>(layer, kKind, n);
    return spring_force<0, corner>(u, spring_tensions<accuracy>(SpringGroup<CellSpring<0, corner>>{}, u, k));
}

/// One layer of cells, as lattice_layer. `lanes` and `cell_lanes` are without padding: whole rows.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void bodies_layer(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = 0; n < layer.row; n += kWidth<V>) {
        store_force<V>(layer.above, n, {zero, zero, zero});
    }
    std::ptrdiff_t n = 0;
    while (n < layer.cell_lanes) {
        auto carry = no_carry<V>();
        for (const std::ptrdiff_t end = n + layer.row - kWidth<V>; n < end; n += kWidth<V>) {
            sweep_cells<face_diagonals, volume, accuracy, true, V, Bodies>(layer, rows_at(layer, n), carry);
        }
        sweep_end<face_diagonals, accuracy, V>(layer, rows_at(layer, n), carry);
        n += kWidth<V>;
    }
    auto carry = no_carry<V>();
    for (; n < layer.lanes - kWidth<V>; n += kWidth<V>) {
        sweep_last_row<face_diagonals, accuracy, V, Bodies>(layer, rows_at(layer, n), carry);
    }
    const Vector3<V> f0 = edge_force<4, accuracy, V>(layer, n, layer.plane + n);
    const Vector3<V> above = load_force<V>(layer.above, n) - f0;
    store_force<V>(layer.above, n, face_diagonals ? above - carry.high : above);
    finish_nodes<Bodies>(layer, n, load_force<V>(layer.partial, n) + f0 + carry.low);
}

/// The topmost plane of nodes, as lattice_top.
template <bool face_diagonals, Accuracy accuracy, class V>
void bodies_top(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    const Vector3<V> none{zero, zero, zero};
    std::ptrdiff_t n = 0;
    while (n < layer.cell_lanes) {
        auto carry = no_carry<V>();
        for (const std::ptrdiff_t end = n + layer.row - kWidth<V>; n < end; n += kWidth<V>) {
            sweep_top<face_diagonals, accuracy, V, Bodies>(layer, rows_at(layer, n), carry);
        }
        const std::ptrdiff_t y = n + layer.row;
        const Vector3<V> f0 = edge_force<2, accuracy, V>(layer, n, y);
        store_force<V>(layer.partial, y, load_force<V>(layer.partial, y) + (none - f0) + carry.low_y);
        finish_nodes<Bodies>(layer, n, load_force<V>(layer.partial, n) + f0 + carry.low);
        n += kWidth<V>;
    }
    Vector3<V> before = none;
    for (; n < layer.lanes - kWidth<V>; n += kWidth<V>) {
        const Vector3<V> f0 = edge_force<1, accuracy, V>(layer, n, n + kWidth<V>);
        finish_nodes<Bodies>(layer, n, load_force<V>(layer.partial, n) + f0 + before);
        before = none - f0;
    }
    finish_nodes<Bodies>(layer, n, load_force<V>(layer.partial, n) + before);
}

/// Where two slabs meet, as lattice_join.
template <class V>
void bodies_join(const LatticeLayer<Scalar<V>>& layer) {
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        finish_nodes<Bodies>(layer, n, load_force<V>(layer.partial, n) + load_force<V>(layer.above, n));
    }
}

} // namespace

HYBMSS_DEFINE_KERNEL(bodies_layer);
HYBMSS_DEFINE_KERNEL(bodies_top);
HYBMSS_DEFINE_KERNEL(bodies_join);

} // namespace hybmss::kernels
