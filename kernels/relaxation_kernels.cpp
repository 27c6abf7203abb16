// Compiled once for each instruction set: cells that remember how they were strained (dynamics/effects).
#include "kernels/compiled_set.hpp"

#include <type_traits>
#include <utility>

namespace hybmss::kernels {
namespace {

template <class V>
inline constexpr int kVectors = static_cast<int>(kMaxWidth) / kWidth<V>; ///< a block

/// f(0), ... one after the other: loops over lines of a cell are too long for the compiler to unroll by itself.
template <int count, class F>
HYBMSS_INLINE void unrolled(const F& f) {
    [&]<int... i>(std::integer_sequence<int, i...>) HYBMSS_INLINE_BODY {
        (f(std::integral_constant<int, i>()), ...);
    }
    (std::make_integer_sequence<int, count>());
}

/// Whether three rows beside a block are whole.
HYBMSS_INLINE bool whole(const SlotRow* rows) {
    return rows[0].from < 0 && rows[1].from < 0 && rows[2].from < 0;
}
/// A vector of the slots beside those of a block.
template <bool is_whole, class V>
HYBMSS_INLINE V load_row(const Scalar<V>* array, const SlotRow& row, const std::int32_t* lanes, int vector) {
    const int first = vector * kWidth<V>;
    return is_whole || row.from < 0 ? load_lanes<V>(array + row.start + first)
                                    : gather_lanes<V>(array, lanes + row.from + first);
}

/// Of the means of the cells' parallel edges. Differences come first: they lose nothing far from where a body was.
template <bool is_whole, class V>
HYBMSS_INLINE void load_gradient(const RelaxingCells<Scalar<V>>& cells, Range block, int vector, V (&h)[3][3]) {
    const Range slot = block * kMaxWidth + vector * kWidth<V>;
    const SlotRow* const rows = cells.rows + 3 * block;
    const V factor = splat<V>(cells.quarter_by_edge);
    unrolled<3>([&](auto a) HYBMSS_INLINE_BODY {
        const Scalar<V>* const u = cells.displacement[a];
        V low[4], high[4]; // by y, z
        low[0] = load_lanes<V>(u + slot);
        high[0] = load_lanes<V>(u + slot + 1);
        for (int r = 1; r < 4; ++r) {
            low[r] = load_row<is_whole, V>(u, rows[r - 1], cells.lanes, vector);
            high[r] = load_row<is_whole, V>(u + 1, rows[r - 1], cells.lanes, vector);
        }
        h[a][0] = factor * (((high[0] - low[0]) + (high[1] - low[1])) + ((high[2] - low[2]) + (high[3] - low[3])));
        h[a][1] = factor * (((low[1] - low[0]) + (high[1] - high[0])) + ((low[3] - low[2]) + (high[3] - high[2])));
        h[a][2] = factor * (((low[2] - low[0]) + (high[2] - high[0])) + ((low[3] - low[1]) + (high[3] - high[1])));
    });
}

template <class V>
HYBMSS_INLINE V trace_of(const V (&e)[6]) {
    return e[0] + e[1] + e[2];
}
/// The sum of the squares of all nine entries.
template <class V>
HYBMSS_INLINE V square_of(const V (&e)[6]) {
    const V shears = multiply_add(e[5], e[5], multiply_add(e[4], e[4], e[3] * e[3]));
    return multiply_add(splat<V>(2), shears, multiply_add(e[2], e[2], multiply_add(e[1], e[1], e[0] * e[0])));
}

/// Takes a vector of cells on. Returns what their branches take out.
template <bool is_whole, class V>
HYBMSS_INLINE V take_on(const RelaxingCells<Scalar<V>>& cells, Range block, int vector) {
    using T = Scalar<V>;
    constexpr int kA[6] = {0, 1, 2, 0, 1, 0}, kB[6] = {0, 1, 2, 1, 2, 2};
    constexpr bool kRemainders = kRelaxationLines<T> == 12;
    V h[3][3];
    load_gradient<is_whole>(cells, block, vector, h);
    const Range lines = 6 + cells.branches * kRelaxationLines<T>;
    T* line = cells.strains + (block * lines * kMaxWidth + vector * kWidth<V>);
    V change[6], sum[6];
    unrolled<6>([&](auto s) HYBMSS_INLINE_BODY {
        constexpr int a = kA[s], b = kB[s];
        const V twice = multiply_add(h[2][a], h[2][b],
                                     multiply_add(h[1][a], h[1][b], multiply_add(h[0][a], h[0][b], h[a][b] + h[b][a])));
        const V now = splat<V>(T(0.5)) * twice;
        change[s] = now - load_lanes<V>(line + s * kMaxWidth);
        store_lanes(line + s * kMaxWidth, now);
        sum[s] = splat<V>(0);
    });
    line += 6 * kMaxWidth;
    V traces = splat<V>(0), squares = splat<V>(0); // of what is taken out
    const V new_trace = trace_of(change) * trace_of(change), new_square = square_of(change);
    for (int b = 0; b < cells.branches; ++b, line += kRelaxationLines<T> * kMaxWidth) {
        const RelaxationCourse<T>& course = cells.course[b];
        const V gained = splat<V>(course.gained), lost = splat<V>(course.lost), part = splat<V>(course.part);
        V both[6];
        unrolled<6>([&](auto s) HYBMSS_INLINE_BODY {
            T* const at = line + s * kMaxWidth;
            const V own = load_lanes<V>(at);
            V gain;
            if constexpr (kRemainders) {
                gain = subtract_product(lost, own, multiply_add(gained, change[s], load_lanes<V>(at + 6 * kMaxWidth)));
            } else {
                gain = subtract_product(lost, own, gained * change[s]);
            }
            const V next = own + gain;
            if constexpr (kRemainders) {
                store_lanes(at + 6 * kMaxWidth, gain - (next - own));
            }
            store_lanes(at, next);
            both[s] = own + next;
            sum[s] = multiply_add(part, next, sum[s]);
        });
        const V of_sums = splat<V>(course.of_sums), of_changes = splat<V>(course.of_changes), trace = trace_of(both);
        traces = multiply_add(of_sums, trace * trace, multiply_add(of_changes, new_trace, traces));
        squares = multiply_add(of_sums, square_of(both), multiply_add(of_changes, new_square, squares));
    }
    const Range slot = block * kMaxWidth + vector * kWidth<V>;
    const V shear = load_lanes<V>(cells.shear + slot), lame = load_lanes<V>(cells.lame + slot), twice = shear + shear;
    const V mean = lame * trace_of(sum);
    const V xx = multiply_add(twice, sum[0], mean), yy = multiply_add(twice, sum[1], mean),
            zz = multiply_add(twice, sum[2], mean), xy = twice * sum[3], yz = twice * sum[4], xz = twice * sum[5];
    unrolled<3>([&](auto i) HYBMSS_INLINE_BODY {
        const V x = i == 0 ? h[i][0] + splat<V>(1) : h[i][0], y = i == 1 ? h[i][1] + splat<V>(1) : h[i][1],
                z = i == 2 ? h[i][2] + splat<V>(1) : h[i][2];
        const V px = multiply_add(z, xz, multiply_add(y, xy, x * xx)),
                py = multiply_add(z, yz, multiply_add(y, yy, x * xy)),
                pz = multiply_add(z, zz, multiply_add(y, yz, x * xz));
        const V low = px - pz, high = px + pz;
        store_lanes(cells.pull[4 * i] + slot, high + py);
        store_lanes(cells.pull[4 * i + 1] + slot, high - py);
        store_lanes(cells.pull[4 * i + 2] + slot, low + py);
        store_lanes(cells.pull[4 * i + 3] + slot, low - py);
    });
    return multiply_add(twice, squares, lame * traces);
}

/// What is taken out is added up by places in a block, whatever a vector's width.
template <class V>
double relaxing_cells(const RelaxingCells<Scalar<V>>& cells, Range begin, Range end) {
    V taken[kVectors<V>];
    for (V& lanes : taken) {
        lanes = splat<V>(0);
    }
    for (Range block = begin; block < end; ++block) {
        const bool is_whole = whole(cells.rows + 3 * block);
        for (int vector = 0; vector < kVectors<V>; ++vector) {
            taken[vector] = taken[vector] + (is_whole ? take_on<true, V>(cells, block, vector)
                                                      : take_on<false, V>(cells, block, vector));
        }
    }
    alignas(64) Scalar<V> lanes[kMaxWidth];
    double sum = 0;
    for (int vector = 0; vector < kVectors<V>; ++vector) {
        taken[vector].store_aligned(lanes + vector * kWidth<V>);
    }
    for (const Scalar<V> lane : lanes) {
        sum += static_cast<double>(lane);
    }
    return sum;
}

template <bool is_whole, class V>
HYBMSS_INLINE void sum_up(const RelaxingNodes<Scalar<V>>& nodes, Range block, int vector) {
    const Range slot = block * kMaxWidth + vector * kWidth<V>;
    const SlotRow* const rows = nodes.rows + 3 * block;
    unrolled<3>([&](auto a) HYBMSS_INLINE_BODY {
        const Scalar<V>* const* const pull = nodes.pull + 4 * a;
        V force = load_lanes<V>(pull[0] + slot) - load_lanes<V>(pull[3] + slot - 1);
        for (int r = 1; r < 4; ++r) {
            force = force + (load_row<is_whole, V>(pull[r], rows[r - 1], nodes.lanes, vector) -
                             load_row<is_whole, V>(pull[3 - r] - 1, rows[r - 1], nodes.lanes, vector));
        }
        store_lanes(nodes.force[a] + slot, force);
    });
}

template <class V>
void relaxing_nodes(const RelaxingNodes<Scalar<V>>& nodes, Range begin, Range end) {
    for (Range block = begin; block < end; ++block) {
        const bool is_whole = whole(nodes.rows + 3 * block);
        for (int vector = 0; vector < kVectors<V>; ++vector) {
            is_whole ? sum_up<true, V>(nodes, block, vector) : sum_up<false, V>(nodes, block, vector);
        }
    }
}

} // namespace

HYBMSS_DEFINE_KERNEL(relaxing_cells);
HYBMSS_DEFINE_KERNEL(relaxing_nodes);

} // namespace hybmss::kernels
