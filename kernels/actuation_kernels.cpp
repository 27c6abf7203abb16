// Compiled once for each instruction set: cells of another size at rest than they were made with.
#include "kernels/actuated_cell.hpp"
#include "kernels/compiled_set.hpp"

#include <type_traits>

namespace hybmss::kernels {
namespace {

/// The vectors of all levels: sets give the same bits, so that none is worth a function of its own.
template <class V>
using AlikeVector = Batch<Scalar<V>, Alike<typename Traits<V>::Arch>>;

template <class V>
HYBMSS_INLINE V gather_place(const Scalar<V>* first, const std::uint32_t* place) {
    alignas(64) Scalar<V> lanes[kWidth<V>];
    for (int i = 0; i < kWidth<V>; ++i) {
        lanes[i] = first[place[i]];
    }
    return V::load_aligned(lanes);
}

/// Changes of a field at the corners from corner 0, by the edge of a cell.
template <class V>
HYBMSS_INLINE void load_changes(const ActuatedCells<Scalar<V>>& cells, const Scalar<V>* const (&field)[3], Range i,
                                V (&u)[8][3]) {
    for (int a = 0; a < 3; ++a) {
        const V low = gather_place<V>(field[a], cells.place[0] + i);
        u[0][a] = splat<V>(0);
        for (int c = 1; c < 8; ++c) {
            u[c][a] = splat<V>(cells.by_edge) * (gather_place<V>(field[a], cells.place[c] + i) - low);
        }
    }
}
template <bool means, class V>
HYBMSS_INLINE RestSize<V> load_size(const ActuatedCells<Scalar<V>>& cells, Range i) {
    const V s[3] = {load_lanes<V>(cells.stretch[0] + i), load_lanes<V>(cells.stretch[1] + i),
                    load_lanes<V>(cells.stretch[2] + i)};
    return rest_size<means>(s);
}

/// A function of its own, for products and diagonals: most of what there is to compile.
template <bool means, class V>
[[gnu::noinline]] void forces_along(const Dual<V> (&u)[8][3], const RestSize<V>& size, V kappa,
                                    const ActuationLaw<Scalar<V>>& law, Dual<V> (&f)[8][3]) {
    actuated_cell_forces<means>(u, size, kappa, law, f);
}

/// Sets what each corner of the cells feels; cells [begin, end), multiples of kMaxWidth.
template <bool means, class Outer>
void actuated_cells(const ActuatedCells<Scalar<Outer>>& cells, Range begin, Range end) {
    using V = AlikeVector<Outer>;
    for (Range i = begin; i < end; i += kWidth<V>) {
        V u[8][3], f[8][3];
        load_changes(cells, cells.displacement, i, u);
        actuated_cell_forces<means>(u, load_size<means, V>(cells, i), load_lanes<V>(cells.kappa + i), cells.law, f);
        const V weight = load_lanes<V>(cells.weight + i);
        for (int c = 0; c < 8; ++c) {
            for (int a = 0; a < 3; ++a) {
                store_lanes(cells.result + (3 * c + a) * cells.count + i, weight * f[c][a]);
            }
        }
    }
}

/// Likewise minus what their second derivatives make of `direction`.
template <bool means, class Outer>
void actuated_product(const ActuatedCells<Scalar<Outer>>& cells, Range begin, Range end) {
    using V = AlikeVector<Outer>;
    for (Range i = begin; i < end; i += kWidth<V>) {
        V u[8][3], p[8][3];
        load_changes(cells, cells.displacement, i, u);
        load_changes(cells, cells.direction, i, p);
        Dual<V> both[8][3], f[8][3];
        for (int c = 0; c < 8; ++c) {
            for (int a = 0; a < 3; ++a) {
                both[c][a] = {u[c][a], p[c][a]};
            }
        }
        forces_along<means>(both, load_size<means, V>(cells, i), load_lanes<V>(cells.kappa + i), cells.law, f);
        const V weight = load_lanes<V>(cells.weight + i);
        for (int c = 0; c < 8; ++c) {
            for (int a = 0; a < 3; ++a) {
                store_lanes(cells.result + (3 * c + a) * cells.count + i, weight * f[c][a].along);
            }
        }
    }
}

/// Likewise minus the blocks of the corners themselves, xx, yy, zz, xy, xz, yz, by the edge of a cell.
template <bool means, class Outer>
void actuated_diagonal(const ActuatedCells<Scalar<Outer>>& cells, Range begin, Range end) {
    using V = AlikeVector<Outer>;
    constexpr int kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    for (Range i = begin; i < end; i += kWidth<V>) {
        V u[8][3];
        load_changes(cells, cells.displacement, i, u);
        const RestSize<V> size = load_size<means, V>(cells, i);
        const V kappa = load_lanes<V>(cells.kappa + i), weight = load_lanes<V>(cells.weight + i);
        for (int corner = 0; corner < 8; ++corner) {
            for (int axis = 0; axis < 3; ++axis) {
                Dual<V> both[8][3], f[8][3];
                for (int c = 0; c < 8; ++c) {
                    for (int a = 0; a < 3; ++a) {
                        both[c][a] = {u[c][a], splat<V>(c == corner && a == axis ? Scalar<V>(1) : Scalar<V>(0))};
                    }
                }
                forces_along<means>(both, size, kappa, cells.law, f);
                for (int a = axis; a < 3; ++a) {
                    const Range entry = kBlockEntries * corner + kEntry[axis][a];
                    store_lanes(cells.result + entry * cells.count + i, weight * f[corner][a].along);
                }
            }
        }
    }
}

/// Their energy, by the unit of force times the edge of a cell; in the order of the cells.
template <bool means, class Outer>
double actuated_energy(const ActuatedCells<Scalar<Outer>>& cells, Range begin, Range end) {
    using V = AlikeVector<Outer>;
    double sum = 0;
    for (Range i = begin; i < end; i += kWidth<V>) {
        V u[8][3];
        load_changes(cells, cells.displacement, i, u);
        add_in_double(sum, load_lanes<V>(cells.weight + i) *
                               actuated_cell_energy<means>(u, load_size<means, V>(cells, i),
                                                           load_lanes<V>(cells.kappa + i), cells.law));
    }
    return sum;
}

} // namespace

HYBMSS_DEFINE_COMMON_KERNEL(actuated_cells);
HYBMSS_DEFINE_COMMON_KERNEL(actuated_product);
HYBMSS_DEFINE_COMMON_KERNEL(actuated_diagonal);
HYBMSS_DEFINE_COMMON_KERNEL(actuated_energy);

} // namespace hybmss::kernels
