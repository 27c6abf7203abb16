// Compiled once for each instruction set: the diagonal 3x3 blocks of a lattice's K(u), in the same sweep as its
// product.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"

namespace hybmss::kernels {
namespace {

/// One layer of cells: adds to `partial`, sets `above`.
template <bool face_diagonals, LatticeSum sum, Accuracy accuracy, class V>
void lattice_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    const V zero = splat<V>(0);
    const Symmetric3<V> none{{zero, zero, zero, zero, zero, zero}};
    clear_above<V>(layer);
    Symmetric3<V> carry[4] = {none, none, none, none};
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8];
        load_cells<V>(layer, layer.displacement, at, u);
        V k[7];
        for (int kind = 0; kind < 7; ++kind) {
            k[kind] = load_lanes<V>(layer.stiffness[kind] + n);
        }
        Symmetric3<V> blocks[8] = {none, none, none, none, none, none, none, none};
        add_spring_blocks<accuracy, sum.law>(CubeDiagonals{}, u, k, layer.stiffening, blocks);
        add_spring_blocks<accuracy, sum.law>(EdgesAndFaces<face_diagonals>{}, u, k, layer.stiffening, blocks);
        if constexpr (sum.volume != Volume::none) {
            add_volume_blocks<sum.volume>(u, k[6] * splat<V>(layer.volume_ratio), blocks);
        }
        add_blocks<V>(layer.above, at.high_y, blocks[6] + next_column(blocks[7], carry[3]));
        add_blocks<V>(layer.above, at.high, blocks[4] + next_column(blocks[5], carry[2]));
        add_blocks<V>(layer.partial, at.low_y, blocks[2] + next_column(blocks[3], carry[1]));
        add_blocks<V>(layer.partial, n, blocks[0] + next_column(blocks[1], carry[0]));
    }
}

/// The topmost node plane; `above` is not touched.
template <bool face_diagonals, SpringLaw law, Accuracy accuracy, class V>
void lattice_top_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    const V zero = splat<V>(0);
    const Symmetric3<V> none{{zero, zero, zero, zero, zero, zero}};
    Symmetric3<V> carry[2] = {none, none};
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[4];
        load_row<V>(layer.displacement, n, u[0], u[1]);
        load_row<V>(layer.displacement, at.low_y, u[2], u[3]);
        V k[7];
        for (int kind : {0, 1, 3}) {
            k[kind] = load_lanes<V>(layer.stiffness[kind] + n);
        }
        Symmetric3<V> blocks[4] = {none, none, none, none};
        add_spring_blocks<accuracy, law>(PlaneSprings<face_diagonals>{}, u, k, layer.stiffening, blocks);
        add_blocks<V>(layer.partial, at.low_y, blocks[2] + next_column(blocks[3], carry[1]));
        add_blocks<V>(layer.partial, n, blocks[0] + next_column(blocks[1], carry[0]));
    }
}

template <class V>
void lattice_join_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    join_planes<V>(layer);
}

} // namespace

HYBMSS_DEFINE_COMMON_KERNEL(lattice_diagonal);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_top_diagonal);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_join_diagonal);

} // namespace hybmss::kernels
