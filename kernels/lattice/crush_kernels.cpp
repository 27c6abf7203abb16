// Compiled once for each instruction set: what keeps the cells of a lattice from being crushed, a pass over their
// volumes alone.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"

namespace hybmss::kernels {
namespace {

/// visit(where a vector of cells has its corners, their displacements, their volume, J0 - J or 0, the modulus times h^3
/// by 32) for all of a layer. A void cell is what its corners make of it, and never crushed.
template <class V, class Layer, class Visit>
HYBMSS_INLINE void for_each_cells(const Layer& layer, const Visit& visit) {
    const V zero = splat<V>(0), bound = splat<V>(layer.crush_bound), ratio = splat<V>(layer.volume_ratio);
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8];
        load_cells<V>(layer, layer.displacement, at, u);
        const V scale = ratio * load_lanes<V>(layer.stiffness[6] + n);
        const CellVolume<V> cell = volume_of_cells(u);
        visit(at, cell, where_positive(scale, maximum(bound - cell.dilation, zero)), scale);
    }
}

/// One layer of cells: sets `above`, and adds to `partial`, what `product` makes of the corners 0 to 3 of a vector of
/// cells of which some are crushed; the opposite at 7 to 4. Vectors without one are not looked at any further.
template <class V, class Product>
HYBMSS_INLINE void sweep_crushed(const LatticeHessianLayer<Scalar<V>, 3>& layer, const Product& product) {
    const V zero = splat<V>(0);
    const Vector3<V> none{zero, zero, zero};
    clear_above<V>(layer);
    auto carry = no_carry<V>();
    bool carries = false;
    for_each_cells<V>(layer, [&](const CellRows& at, const CellVolume<V>& cell, V depth, V scale) HYBMSS_INLINE_BODY {
        const bool crushed = any_positive(depth);
        if (!crushed && !carries) {
            return;
        }
        carries = crushed;
        Vector3<V> f[4] = {none, none, none, none};
        product(at, cell, depth, scale, f);
        store_force<V>(layer.above, at.high_y,
                       load_force<V>(layer.above, at.high_y) - f[1] - next_column(f[0], carry.high_y));
        store_force<V>(layer.above, at.high,
                       load_force<V>(layer.above, at.high) - f[3] - next_column(f[2], carry.high));
        store_force<V>(layer.partial, at.low_y,
                       load_force<V>(layer.partial, at.low_y) + f[2] + next_column(f[3], carry.low_y));
        store_force<V>(layer.partial, at.low,
                       load_force<V>(layer.partial, at.low) + f[0] + next_column(f[1], carry.low));
    });
}

/// The derivative of the energy by the corners: modulus (J0 - J)^2 times the opposite of those of the volume
/// (lattice_cell.hpp).
template <class V>
void lattice_crush(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_crushed<V>(
        layer, [](const CellRows&, const CellVolume<V>& cell, V depth, V scale, Vector3<V>(&f)[4]) HYBMSS_INLINE_BODY {
            const V slope = scale * (depth * depth);
            const Vector3<V> st = scaled(slope, cell.st), ta = scaled(slope, cell.ta), as = scaled(slope, cell.as);
            f[0] = st + ta;
            f[1] = ta - st;
            f[2] = st + as;
            f[3] = as - st;
        });
}

/// The second derivatives of it, times `direction`.
template <class V>
void lattice_crush_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_crushed<V>(layer, [&](const CellRows& at, const CellVolume<V>& cell, V depth, V scale,
                                Vector3<V>(&f)[4]) HYBMSS_INLINE_BODY {
        Vector3<V> p[8];
        load_cells<V>(layer, layer.direction, at, p);
        add_volume_product(cell, crush_derivatives(depth), p, scale, layer.stiffening.geometric, f);
    });
}

/// Its blocks on the diagonal: adds to `partial`, sets `above`.
template <class V>
void lattice_crush_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    const V zero = splat<V>(0);
    const Symmetric3<V> none{{zero, zero, zero, zero, zero, zero}};
    clear_above<V>(layer);
    Symmetric3<V> carry[4] = {none, none, none, none};
    for_each_cells<V>(layer, [&](const CellRows& at, const CellVolume<V>& cell, V depth, V scale) HYBMSS_INLINE_BODY {
        Symmetric3<V> blocks[8] = {none, none, none, none, none, none, none, none};
        add_volume_blocks(cell, scale * crush_derivatives(depth).curvature, blocks);
        add_blocks<V>(layer.above, at.high_y, blocks[6] + next_column(blocks[7], carry[3]));
        add_blocks<V>(layer.above, at.high, blocks[4] + next_column(blocks[5], carry[2]));
        add_blocks<V>(layer.partial, at.low_y, blocks[2] + next_column(blocks[3], carry[1]));
        add_blocks<V>(layer.partial, at.low, blocks[0] + next_column(blocks[1], carry[0]));
    });
}

/// In units of 32 times force times h, as a volume's.
template <class V>
double lattice_crush_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    double energy = 0;
    for_each_cells<V>(layer, [&](const CellRows&, const CellVolume<V>&, V depth, V scale) HYBMSS_INLINE_BODY {
        if (any_positive(depth)) {
            energy += sum_in_double(scale * crush_energy(depth));
        }
    });
    return energy;
}

} // namespace

HYBMSS_DEFINE_KERNEL(lattice_crush);
HYBMSS_DEFINE_KERNEL(lattice_crush_product);
HYBMSS_DEFINE_KERNEL(lattice_crush_diagonal);
HYBMSS_DEFINE_KERNEL(lattice_crush_energy);

} // namespace hybmss::kernels
