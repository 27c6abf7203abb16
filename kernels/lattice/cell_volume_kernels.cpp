// Compiled once for each instruction set: passes over the volumes of a lattice's cells alone, for what keeps these from
// being crushed and for volume forces that do not go by the springs' stiffness.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian.hpp"

namespace hybmss::kernels {
namespace {

// What a vector of cells stores by its volume: whether anything is to be added for it at all, the factor of phi times
// h^3 by 32, and phi and its derivatives.

/// (J0 - J)^3 / 3 below J0, by the modulus. A void cell is what its corners make of it, and never crushed.
template <class V>
struct Crushed {
    V scale, depth;

    template <class Layer>
    HYBMSS_INLINE Crushed(const Layer& layer, std::ptrdiff_t n, V dilation)
        : scale(splat<V>(layer.volume_ratio) * load_lanes<V>(layer.stiffness[6] + n)),
          depth(where_positive(scale, maximum(splat<V>(layer.crush_bound) - dilation, splat<V>(0)))) {}
    HYBMSS_INLINE bool any() const { return any_positive(depth); }
    HYBMSS_INLINE VolumeDerivatives<V> derivatives() const { return crush_derivatives(depth); }
    HYBMSS_INLINE V energy() const { return crush_energy(depth); }
};

/// kappa phi(J), kappa of every cell by itself: of kappa = q + m, q has the quadratic energy and m mean stretch. Where
/// no cell of the vector has m, no root is taken.
template <class V>
struct OwnVolume {
    V scale, quadratic, stretch, dilation;

    template <class Layer>
    HYBMSS_INLINE OwnVolume(const Layer& layer, std::ptrdiff_t n, V j) : scale(splat<V>(1)), dilation(j) {
        const V kappa = load_lanes<V>(layer.stiffness[6] + n);
        quadratic = maximum(kappa, splat<V>(layer.least_quadratic));
        if (layer.all_mean_stretch) {
            quadratic = splat<V>(0);
        }
        stretch = kappa - quadratic;
    }
    HYBMSS_INLINE bool any_stretch() const { return any_positive(maximum(stretch, splat<V>(0) - stretch)); }
    HYBMSS_INLINE bool any() const {
        return any_positive(maximum(quadratic, splat<V>(0) - quadratic)) || any_stretch();
    }
    HYBMSS_INLINE VolumeDerivatives<V> derivatives() const {
        VolumeDerivatives<V> sum = {quadratic * dilation, quadratic};
        if (any_stretch()) {
            const VolumeDerivatives<V> more = volume_derivatives<Volume::mean_stretch>(dilation);
            sum = {multiply_add(stretch, more.slope, sum.slope), multiply_add(stretch, more.curvature, sum.curvature)};
        }
        return sum;
    }
    HYBMSS_INLINE V energy() const {
        return quadratic * volume_energy<Volume::quadratic>(dilation) +
               stretch * volume_energy<Volume::mean_stretch>(dilation);
    }
};

/// visit(where a vector of cells has its corners, their volume, what they store) for all of a layer.
template <class V, class Stored, class Layer, class Visit>
HYBMSS_INLINE void for_each_cells(const Layer& layer, const Visit& visit) {
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        Vector3<V> u[8];
        load_cells<V>(layer, layer.displacement, at, u);
        const CellVolume<V> cell = volume_of_cells(u);
        visit(at, cell, Stored(layer, n, cell.dilation));
    }
}

/// One layer of cells: sets `above`, and adds to `partial`, what `product` makes of the corners 0 to 3 of a vector of
/// cells of which some store anything; the opposite at 7 to 4. Vectors without one are not looked at any further.
template <class V, class Stored, class Product>
HYBMSS_INLINE void sweep_volumes(const LatticeHessianLayer<Scalar<V>, 3>& layer, const Product& product) {
    const V zero = splat<V>(0);
    const Vector3<V> none{zero, zero, zero};
    clear_above<V>(layer);
    auto carry = no_carry<V>();
    bool carries = false;
    for_each_cells<V, Stored>(
        layer, [&](const CellRows& at, const CellVolume<V>& cell, const Stored& stored) HYBMSS_INLINE_BODY {
            const bool any = stored.any();
            if (!any && !carries) {
                return;
            }
            carries = any;
            Vector3<V> f[4] = {none, none, none, none};
            product(at, cell, stored, f);
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

/// The derivative of the energy by the corners: phi' times those of the volume (lattice_cell.hpp).
template <class V, class Stored>
HYBMSS_INLINE void sweep_slopes(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_volumes<V, Stored>(layer, [](const CellRows&, const CellVolume<V>& cell, const Stored& stored,
                                       Vector3<V>(&f)[4]) HYBMSS_INLINE_BODY {
        const V slope = stored.scale * (splat<V>(0) - stored.derivatives().slope);
        const Vector3<V> st = scaled(slope, cell.st), ta = scaled(slope, cell.ta), as = scaled(slope, cell.as);
        f[0] = st + ta;
        f[1] = ta - st;
        f[2] = st + as;
        f[3] = as - st;
    });
}

/// The second derivatives of it, times `direction`.
template <class V, class Stored>
HYBMSS_INLINE void sweep_products(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_volumes<V, Stored>(layer, [&](const CellRows& at, const CellVolume<V>& cell, const Stored& stored,
                                        Vector3<V>(&f)[4]) HYBMSS_INLINE_BODY {
        Vector3<V> p[8];
        load_cells<V>(layer, layer.direction, at, p);
        add_volume_product(cell, stored.derivatives(), p, stored.scale, layer.stiffening.geometric, f);
    });
}

/// Its blocks on the diagonal: adds to `partial`, sets `above`.
template <class V, class Stored>
HYBMSS_INLINE void sweep_diagonals(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    const V zero = splat<V>(0);
    const Symmetric3<V> none{{zero, zero, zero, zero, zero, zero}};
    clear_above<V>(layer);
    Symmetric3<V> carry[4] = {none, none, none, none};
    for_each_cells<V, Stored>(
        layer, [&](const CellRows& at, const CellVolume<V>& cell, const Stored& stored) HYBMSS_INLINE_BODY {
            Symmetric3<V> blocks[8] = {none, none, none, none, none, none, none, none};
            add_volume_blocks(cell, stored.scale * stored.derivatives().curvature, blocks);
            add_blocks<V>(layer.above, at.high_y, blocks[6] + next_column(blocks[7], carry[3]));
            add_blocks<V>(layer.above, at.high, blocks[4] + next_column(blocks[5], carry[2]));
            add_blocks<V>(layer.partial, at.low_y, blocks[2] + next_column(blocks[3], carry[1]));
            add_blocks<V>(layer.partial, at.low, blocks[0] + next_column(blocks[1], carry[0]));
        });
}

/// In units of 32 times force times h, as a volume's.
template <class V, class Stored>
HYBMSS_INLINE double sum_energies(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    double energy = 0;
    for_each_cells<V, Stored>(layer,
                              [&](const CellRows&, const CellVolume<V>&, const Stored& stored) HYBMSS_INLINE_BODY {
                                  if (stored.any()) {
                                      add_in_double(energy, stored.scale * stored.energy());
                                  }
                              });
    return energy;
}

template <class V>
void lattice_crush(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_slopes<V, Crushed<V>>(layer);
}
template <class V>
void lattice_crush_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_products<V, Crushed<V>>(layer);
}
template <class V>
void lattice_crush_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    sweep_diagonals<V, Crushed<V>>(layer);
}
template <class V>
double lattice_crush_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    return sum_energies<V, Crushed<V>>(layer);
}

template <class V>
void lattice_volume(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_slopes<V, OwnVolume<V>>(layer);
}
template <class V>
void lattice_volume_product(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    sweep_products<V, OwnVolume<V>>(layer);
}
template <class V>
void lattice_volume_diagonal(const LatticeHessianLayer<Scalar<V>, kBlockEntries>& layer) {
    sweep_diagonals<V, OwnVolume<V>>(layer);
}
template <class V>
double lattice_volume_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    return sum_energies<V, OwnVolume<V>>(layer);
}

} // namespace

HYBMSS_DEFINE_KERNEL(lattice_crush);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_crush_product);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_crush_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(lattice_crush_energy);
HYBMSS_DEFINE_KERNEL(lattice_volume);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_volume_product);
HYBMSS_DEFINE_COMMON_KERNEL(lattice_volume_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(lattice_volume_energy);

} // namespace hybmss::kernels
