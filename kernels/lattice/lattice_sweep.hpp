#pragma once

// The sweep over a lattice: what it does with one vector of cells, wherever its rows lie, and the loops of the layouts
// flat-rows (lattice_) and active-rows (active_).

#include "kernels/lattice/lattice_cell.hpp"

namespace hybmss::kernels {
namespace {

/// Where a vector of cells has its corners: the rows of nodes at its low and high side in y, in the arrays of the lower
/// plane (`low`, `low_y`) and of the upper one (`high`, `high_y`). Corners at the high side in x follow one element on.
struct CellRows {
    std::ptrdiff_t low, low_y, high, high_y;
};

/// What the next vector of cells adds to its nodes: forces on this one's high corners in x, by rows.
template <class V>
struct ColumnCarry {
    Vector3<V> low, low_y, high, high_y;
};
template <class V>
HYBMSS_INLINE ColumnCarry<V> no_carry() {
    const V zero = splat<V>(0);
    const Vector3<V> none{zero, zero, zero};
    return {none, none, none, none};
}

/// What the lanes of a vector hold: nodes of a row, one after the other.
struct NodesOfARow {
    /// How far on a vector's neighbours in x begin.
    template <class V>
    static constexpr std::ptrdiff_t kNext = 1;
    /// Masses and stiffnesses, at the nodes from n on.
    template <class V>
    HYBMSS_INLINE static V made(const Scalar<V>* values, std::ptrdiff_t n) {
        return load_lanes<V>(values + n);
    }
    /// Values of a vector's high sides at the nodes where they lie; `before`: those of the vector before.
    template <class V>
    HYBMSS_INLINE static V next(V before, V high) {
        return shift_in(before, high);
    }
};
/// Or one node of as many bodies, all made alike.
struct NodesOfBodies {
    template <class V>
    static constexpr std::ptrdiff_t kNext = kWidth<V>;
    template <class V>
    HYBMSS_INLINE static V made(const Scalar<V>* values, std::ptrdiff_t n) {
        return splat<V>(values[static_cast<std::size_t>(n) / static_cast<std::size_t>(kWidth<V>)]);
    }
    template <class V>
    HYBMSS_INLINE static V next(V before, V) {
        return before;
    }
};

/// Displacements of a vector of nodes.
template <class V, class T>
HYBMSS_INLINE Vector3<V> load_nodes(const LatticeLayer<T>& layer, std::ptrdiff_t n) {
    return {load_lanes<V>(layer.displacement[0] + n), load_lanes<V>(layer.displacement[1] + n),
            load_lanes<V>(layer.displacement[2] + n)};
}
/// Of a vector of nodes, and of their neighbours one further in x.
template <class V, class T, class Lanes = NodesOfARow>
HYBMSS_INLINE void load_row(const LatticeLayer<T>& layer, std::ptrdiff_t n, Vector3<V>& low, Vector3<V>& high) {
    low = load_nodes<V>(layer, n);
    high = load_nodes<V>(layer, n + Lanes::template kNext<V>);
}

/// Displacements of the eight corners of a vector of cells, and their springs' stiffness; what is not used is not
/// loaded.
template <class V>
struct Cell {
    Vector3<V> u[8];
    V k[7];
};
template <class V, class Lanes, class T>
HYBMSS_INLINE Cell<V> load_cell(const LatticeLayer<T>& layer, const CellRows& at) {
    Cell<V> cell;
    load_row<V, T, Lanes>(layer, at.low, cell.u[0], cell.u[1]);
    load_row<V, T, Lanes>(layer, at.low_y, cell.u[2], cell.u[3]);
    load_row<V, T, Lanes>(layer, layer.plane + at.high, cell.u[4], cell.u[5]);
    load_row<V, T, Lanes>(layer, layer.plane + at.high_y, cell.u[6], cell.u[7]);
    for (int kind = 0; kind < 7; ++kind) {
        cell.k[kind] = Lanes::template made<V>(layer.stiffness[kind], at.low);
    }
    return cell;
}
/// The same, loaded anew: the compiler must not keep the first loads in registers, or spill them.
template <class V, class Lanes, class T>
HYBMSS_INLINE Cell<V> reload_cell(const LatticeLayer<T>& layer, const CellRows& at) {
    return load_cell<V, Lanes>(layer, {forget(at.low), forget(at.low_y), forget(at.high), forget(at.high_y)});
}

/// The forces on the high corners of a vector of cells, moved one lane on to the nodes that they act on. A row of nodes
/// gets its forces from the low corners of its own cells and the high corners of those before. They meet in registers,
/// because two overlapping read-modify-writes of memory stall on store forwarding.
template <class Lanes = NodesOfARow, class V>
HYBMSS_INLINE Vector3<V> next_column(const Vector3<V>& high, Vector3<V>& carry) {
    const Vector3<V> moved = {Lanes::next(carry.x, high.x), Lanes::next(carry.y, high.y), Lanes::next(carry.z, high.z)};
    carry = high;
    return moved;
}

template <class V, class T>
HYBMSS_INLINE Vector3<V> load_force(T* const (&force)[3], std::ptrdiff_t n) {
    return {load_lanes<V>(force[0] + n), load_lanes<V>(force[1] + n), load_lanes<V>(force[2] + n)};
}
template <class V, class T>
HYBMSS_INLINE void store_force(T* const (&force)[3], std::ptrdiff_t n, const Vector3<V>& f) {
    store_lanes(force[0] + n, f.x);
    store_lanes(force[1] + n, f.y);
    store_lanes(force[2] + n, f.z);
}

/// v <- (v + dt (f/m + g)) / (1 + dt c), u <- u + dt v
template <bool driven, class Lanes = NodesOfARow, class V, class T>
HYBMSS_INLINE void integrate_nodes(T* const (&displacement)[3], T* const (&velocity)[3], const T* inverse_mass,
                                   const StepConstants<T>& step, std::ptrdiff_t n, const Vector3<V>& force) {
    const V mass = Lanes::template made<V>(inverse_mass, n);
    const V mobility = mass * splat<V>(step.force_factor);
    const V f[3] = {force.x, force.y, force.z};
    for (int c = 0; c < 3; ++c) {
        V v = load_lanes<V>(velocity[c] + n);
        if constexpr (driven) {
            // Void nodes (inverse mass 0) must not fall.
            v = multiply_add(v, splat<V>(step.velocity_factor), where_positive(mass, splat<V>(step.velocity_gain[c])));
        }
        v = multiply_add(f[c], mobility, v);
        store_lanes(velocity[c] + n, v);
        store_lanes(displacement[c] + n, multiply_add(splat<V>(step.time_step), v, load_lanes<V>(displacement[c] + n)));
    }
}

template <class Lanes = NodesOfARow, class V, class T>
HYBMSS_INLINE void finish_nodes(const LatticeLayer<T>& layer, std::ptrdiff_t n, const Vector3<V>& force) {
    switch (layer.finish) {
    case Finish::store:
        store_force(layer.partial, n, force);
        break;
    case Finish::integrate:
        integrate_nodes<false, Lanes>(layer.displacement, layer.velocity, layer.inverse_mass, layer.step, n, force);
        break;
    case Finish::integrate_driven:
        integrate_nodes<true, Lanes>(layer.displacement, layer.velocity, layer.inverse_mass, layer.step, n, force);
        break;
    }
}

/// Springs and volume of one vector of cells: adds to `partial`, finishes the nodes at `low`, adds to `above`, or sets
/// its row `high_y` where `sets_above`: there, nobody wrote before.
///
/// In float first all tensions of edges and face diagonals, nine registers; then the cube diagonals and the volume,
/// twelve; then the rows one after the other, each stored as soon as it is complete. Holding the forces of all eight
/// corners at once, as the equations suggest, takes twenty-four, too many beside the rest. In double the tensions are
/// longer computations, long enough to be side by side in threes, and what a group needs is loaded again rather than
/// spilled.
///
/// The upper rows are written before the lower ones are read: with rows shorter than a vector they overlap.
template <bool face_diagonals, Volume volume, Accuracy accuracy, bool sets_above, class V, class Lanes = NodesOfARow>
HYBMSS_INLINE void sweep_cells(const LatticeLayer<Scalar<V>>& layer, const CellRows& at, ColumnCarry<V>& carry) {
    const V zero = splat<V>(0);
    // Corners 4 to 7 get the opposite of 3 to 0: their forces are held, and merged, with the sign reversed.
    Vector3<V> f[4], f0, minus_f5, minus_f4;
    const auto diagonals = [&](const Cell<V>& cell) HYBMSS_INLINE_BODY {
        diagonal_forces<volume, accuracy>(cell.u, cell.k, layer.volume_ratio, f);
        f0 = f[0], minus_f5 = f[2], minus_f4 = f[3];
    };
    const auto first_springs = [&](const Cell<V>& cell, const auto& tension) HYBMSS_INLINE_BODY {
        Vector3<V> f6;
        if constexpr (face_diagonals) {
            pull<0, 6>(f0, cell.u, tension);
            f6 =
                minus_product_minus(tension.template at<0, 6>(), CellSpring<0, 6>::vector(cell.u[6] - cell.u[0]), f[1]);
        } else {
            f6 = Vector3<V>{zero, zero, zero} - f[1];
        }
        const Vector3<V> f7 = next_column<Lanes>(f[0], carry.high_y);
        if constexpr (sets_above) {
            store_force<V>(layer.above, at.high_y, f6 - f7);
        } else {
            store_force<V>(layer.above, at.high_y, load_force<V>(layer.above, at.high_y) + f6 - f7);
        }
        if constexpr (face_diagonals) {
            pull<0, 5>(f0, cell.u, tension);
            pull<0, 5>(minus_f5, cell.u, tension);
            pull<1, 4>(f[1], cell.u, tension);
            pull<1, 4>(minus_f4, cell.u, tension);
        }
    };
    const auto second_springs = [&](const Cell<V>& cell, const auto& tension) HYBMSS_INLINE_BODY {
        pull<0, 4>(f0, cell.u, tension);
        pull<0, 4>(minus_f4, cell.u, tension);
        if constexpr (face_diagonals) {
            pull<2, 4>(f[2], cell.u, tension);
            pull<2, 4>(minus_f4, cell.u, tension);
        }
        store_force<V>(layer.above, at.high,
                       load_force<V>(layer.above, at.high) - minus_f4 - next_column<Lanes>(minus_f5, carry.high));
        if constexpr (face_diagonals) {
            pull<0, 3>(f0, cell.u, tension);
            push<0, 3>(f[3], cell.u, tension);
        }
    };
    const auto last_springs = [&](const Cell<V>& cell, const auto& tension) HYBMSS_INLINE_BODY {
        pull<0, 2>(f0, cell.u, tension);
        push<0, 2>(f[2], cell.u, tension);
        if constexpr (face_diagonals) {
            pull<1, 2>(f[1], cell.u, tension);
            push<1, 2>(f[2], cell.u, tension);
        }
        store_force<V>(layer.partial, at.low_y,
                       load_force<V>(layer.partial, at.low_y) + f[2] + next_column<Lanes>(f[3], carry.low_y));
        pull<0, 1>(f0, cell.u, tension);
        push<0, 1>(f[1], cell.u, tension);
    };

    if constexpr (face_diagonals && !Traits<V>::kFloat) {
        diagonals(load_cell<V, Lanes>(layer, at));
        const Cell<V> first = reload_cell<V, Lanes>(layer, at);
        first_springs(first, spring_tensions<accuracy>(FirstThree{}, first.u, first.k));
        const Cell<V> second = reload_cell<V, Lanes>(layer, at);
        second_springs(second, spring_tensions<accuracy>(SecondThree{}, second.u, second.k));
        const Cell<V> last = reload_cell<V, Lanes>(layer, at);
        last_springs(last, spring_tensions<accuracy>(LastThree{}, last.u, last.k));
    } else {
        const Cell<V> cell = load_cell<V, Lanes>(layer, at);
        const auto tension = spring_tensions<accuracy>(EdgesAndFaces<face_diagonals>{}, cell.u, cell.k);
        diagonals(cell);
        first_springs(cell, tension);
        second_springs(cell, tension);
        last_springs(cell, tension);
    }
    finish_nodes<Lanes>(layer, at.low, load_force<V>(layer.partial, at.low) + f0 + next_column<Lanes>(f[1], carry.low));
}

/// The same for nodes of the last row, beyond which there are no cells: springs within the side, which lies in x and z.
template <bool face_diagonals, Accuracy accuracy, class V, class Lanes = NodesOfARow>
HYBMSS_INLINE void sweep_last_row(const LatticeLayer<Scalar<V>>& layer, const CellRows& at, ColumnCarry<V>& carry) {
    using T = Scalar<V>;
    const V zero = splat<V>(0);
    Vector3<V> u[6];
    load_row<V, T, Lanes>(layer, at.low, u[0], u[1]);
    load_row<V, T, Lanes>(layer, layer.plane + at.high, u[4], u[5]);
    V k[7];
    for (int kind : {0, 2, 4}) {
        k[kind] = Lanes::template made<V>(layer.stiffness[kind], at.low);
    }
    const auto tension = spring_tensions<accuracy>(SideSprings<face_diagonals>{}, u, k);
    // Added up as in a cell whose other springs pull with nothing, so that both make the same bits.
    Vector3<V> f0, f1, minus_f4;
    if constexpr (face_diagonals) {
        const Vector3<V> minus_f5 = spring_force<0, 5>(u, tension);
        f0 = minus_f5;
        f1 = minus_f4 = spring_force<1, 4>(u, tension);
        pull<0, 4>(f0, u, tension);
        pull<0, 4>(minus_f4, u, tension);
        store_force<V>(layer.above, at.high,
                       load_force<V>(layer.above, at.high) - minus_f4 - next_column<Lanes>(minus_f5, carry.high));
        pull<0, 1>(f0, u, tension);
        push<0, 1>(f1, u, tension);
    } else {
        f0 = minus_f4 = spring_force<0, 4>(u, tension);
        store_force<V>(layer.above, at.high, load_force<V>(layer.above, at.high) - minus_f4);
        pull<0, 1>(f0, u, tension);
        f1 = Vector3<V>{zero, zero, zero} - spring_force<0, 1>(u, tension);
    }
    finish_nodes<Lanes>(layer, at.low, load_force<V>(layer.partial, at.low) + f0 + next_column<Lanes>(f1, carry.low));
}

/// The same for nodes of the topmost plane, above which there are no cells: springs within the plane.
template <bool face_diagonals, Accuracy accuracy, class V, class Lanes = NodesOfARow>
HYBMSS_INLINE void sweep_top(const LatticeLayer<Scalar<V>>& layer, const CellRows& at, ColumnCarry<V>& carry) {
    using T = Scalar<V>;
    const V zero = splat<V>(0);
    Vector3<V> u[4];
    load_row<V, T, Lanes>(layer, at.low, u[0], u[1]);
    load_row<V, T, Lanes>(layer, at.low_y, u[2], u[3]);
    V k[7];
    for (int kind : {0, 1, 3}) {
        k[kind] = Lanes::template made<V>(layer.stiffness[kind], at.low);
    }
    const auto tension = spring_tensions<accuracy>(PlaneSprings<face_diagonals>{}, u, k);
    Vector3<V> f0 = spring_force<0, 1>(u, tension), f1 = Vector3<V>{zero, zero, zero} - f0;
    pull<0, 2>(f0, u, tension);
    Vector3<V> f2 = Vector3<V>{zero, zero, zero} - spring_force<0, 2>(u, tension), f3{zero, zero, zero};
    if constexpr (face_diagonals) {
        pull<0, 3>(f0, u, tension);
        push<0, 3>(f3, u, tension);
        pull<1, 2>(f1, u, tension);
        push<1, 2>(f2, u, tension);
    }
    store_force(layer.partial, at.low_y,
                load_force<V>(layer.partial, at.low_y) + f2 + next_column<Lanes>(f3, carry.low_y));
    finish_nodes<Lanes>(layer, at.low, load_force<V>(layer.partial, at.low) + f0 + next_column<Lanes>(f1, carry.low));
}

/// The energy of a vector of cells and of the springs that start at its nodes; with `top` of the topmost plane's
/// springs.
template <bool face_diagonals, Volume volume, bool top, class V>
HYBMSS_INLINE void add_energy(const LatticeLayer<Scalar<V>>& layer, const CellRows& at, LayerEnergy& energy) {
    using T = Scalar<V>;
    Vector3<V> u[8];
    load_row<V, T>(layer, at.low, u[0], u[1]);
    load_row<V, T>(layer, at.low_y, u[2], u[3]);
    V k[7];
    for (int kind = 0; kind < 7; ++kind) {
        k[kind] = load_lanes<V>(layer.stiffness[kind] + at.low);
    }
    V springs;
    if constexpr (top) {
        springs = spring_energies(PlaneSprings<face_diagonals>{}, u, k);
    } else {
        load_row<V, T>(layer, layer.plane + at.high, u[4], u[5]);
        load_row<V, T>(layer, layer.plane + at.high_y, u[6], u[7]);
        springs = spring_energies(CubeDiagonals{}, u, k) + spring_energies(EdgesAndFaces<face_diagonals>{}, u, k);
        if constexpr (volume != Volume::none) {
            const V dilation = cell_volume(u[7] - u[0], u[6] - u[1], u[5] - u[2], u[4] - u[3]).dilation;
            add_in_double(energy.volume, k[6] * splat<V>(layer.volume_ratio) * volume_energy<volume>(dilation));
        }
    }
    add_in_double(energy.springs, springs);
}

// ---- flat-rows: rows, and the planes above, lie at fixed distances

template <class Layer>
HYBMSS_INLINE CellRows rows_at(const Layer& layer, std::ptrdiff_t n) {
    return {n, n + layer.row, n, n + layer.row};
}

/// One layer of cells: adds to `partial`, finishes its nodes, sets `above`.
///
/// A node is used only by cells at or before it, so the nodes of a vector are finished, and may be integrated in place,
/// as soon as the sweep has passed.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
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
        sweep_cells<face_diagonals, volume, accuracy, true, V>(layer, rows_at(layer, n), carry);
    }
    // In the last row cells are void, and so are the springs across it.
    for (; n < layer.lanes; n += kWidth<V>) {
        sweep_last_row<face_diagonals, accuracy, V>(layer, rows_at(layer, n), carry);
    }
}

/// The topmost node plane, above which there are no cells; `above` is not touched.
template <bool face_diagonals, Accuracy accuracy, class V>
void lattice_top(const LatticeLayer<Scalar<V>>& layer) {
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        sweep_top<face_diagonals, accuracy, V>(layer, rows_at(layer, n), carry);
    }
}

/// The energy of a layer's cells and of the springs that start at its nodes.
template <bool face_diagonals, Volume volume, class V>
LayerEnergy lattice_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        add_energy<face_diagonals, volume, false, V>(layer, rows_at(layer, n), energy);
    }
    return energy;
}
/// The energy of the topmost plane's springs.
template <bool face_diagonals, class V>
LayerEnergy lattice_top_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        add_energy<face_diagonals, Volume::none, true, V>(layer, rows_at(layer, n), energy);
    }
    return energy;
}

// ---- active-rows: a plane holds those vectors of its rows that the body has nodes in, and lists where their
// neighbours lie

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
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void active_layer(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = 0; n < layer.upper_lanes; n += kWidth<V>) {
        store_force<V>(layer.above, n, {zero, zero, zero});
    }
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        sweep_cells<face_diagonals, volume, accuracy, false, V>(layer, listed_rows<V>(layer, n), carry);
    }
}

/// The topmost node plane, above which there are no cells; `above` is not touched.
template <bool face_diagonals, Accuracy accuracy, class V>
void active_top(const LatticeLayer<Scalar<V>>& layer) {
    auto carry = no_carry<V>();
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        sweep_top<face_diagonals, accuracy, V>(layer, listed_rows<V>(layer, n), carry);
    }
}

template <bool face_diagonals, Volume volume, class V>
LayerEnergy active_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        add_energy<face_diagonals, volume, false, V>(layer, listed_rows<V>(layer, n), energy);
    }
    return energy;
}
template <bool face_diagonals, class V>
LayerEnergy active_top_energy(const LatticeLayer<Scalar<V>>& layer) {
    LayerEnergy energy{0, 0};
    for (std::ptrdiff_t n = kWidth<V>; n < layer.lanes; n += kWidth<V>) {
        add_energy<face_diagonals, Volume::none, true, V>(layer, listed_rows<V>(layer, n), energy);
    }
    return energy;
}

} // namespace
} // namespace hybmss::kernels
