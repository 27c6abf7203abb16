// Compiled once for each instruction set: what multigrid's cycles do beside products with the second derivatives.
#include "kernels/compiled_set.hpp"
#include "kernels/grid_arguments.hpp"

namespace hybmss::kernels {
namespace {

// r = from - (product + weight v),  d = keep d + add B r,  x = x + d
template <BlockUse use, bool pulled, class V>
void node_blocks(const NodeBlocks<Scalar<V>>& nodes, Range begin, Range end) {
    for (Range n = begin; n < end; n += kWidth<V>) {
        V rest[3];
        for (int c = 0; c < 3; ++c) {
            rest[c] = load_lanes<V>(nodes.from[c] + n);
            if constexpr (use == BlockUse::restart || use == BlockUse::next) {
                rest[c] = rest[c] - load_lanes<V>(nodes.product[c] + n);
                if constexpr (pulled) {
                    const Scalar<V>* of = use == BlockUse::next ? nodes.direction[c] : nodes.solution[c];
                    rest[c] = subtract_product(load_lanes<V>(nodes.weight[c] + n), load_lanes<V>(of + n), rest[c]);
                }
            }
            if constexpr (use != BlockUse::multiply) {
                store_lanes(nodes.rest[c] + n, rest[c]);
            }
        }
        constexpr int kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
        for (int c = 0; c < 3; ++c) {
            V z = load_lanes<V>(nodes.inverse[kEntry[c][0]] + n) * rest[0];
            z = multiply_add(load_lanes<V>(nodes.inverse[kEntry[c][1]] + n), rest[1], z);
            z = multiply_add(load_lanes<V>(nodes.inverse[kEntry[c][2]] + n), rest[2], z);
            if constexpr (use == BlockUse::multiply) {
                store_lanes(nodes.solution[c] + n, z);
            } else {
                V step = splat<V>(nodes.add) * z;
                if constexpr (use == BlockUse::next) { // else d may hold anything
                    step = multiply_add(splat<V>(nodes.keep), load_lanes<V>(nodes.direction[c] + n), step);
                }
                store_lanes(nodes.direction[c] + n, step);
                store_lanes(nodes.solution[c] + n,
                            use == BlockUse::first ? step : load_lanes<V>(nodes.solution[c] + n) + step);
            }
        }
    }
}

// out_n = sum over neighbours m of K_nm v_m, with K_nm = K_mn^T; or b less that. A sum for each component of v:
// additions wait for each other.
template <bool residual, class V>
void grid_stencil(const GridStencil<Scalar<V>>& grid, Range begin, Range end) {
    for (Range n = begin; n < end; n += kWidth<V>) {
        V sum[3][3];
        for (int f = 0; f < 3; ++f) {
            const V v = load_lanes<V>(grid.in[f] + n);
            for (int c = 0; c < 3; ++c) {
                sum[c][f] = load_lanes<V>(grid.entries + (3 * c + f) * grid.stride + n) * v;
            }
        }
        const Scalar<V>* entries = grid.entries + 9 * grid.stride + n;
        for (int way = 0; way < 13; ++way, entries += 9 * grid.stride) {
            const std::ptrdiff_t ahead = grid.ahead[way];
            for (int f = 0; f < 3; ++f) {
                const V after = load_lanes<V>(grid.in[f] + n + ahead), before = load_lanes<V>(grid.in[f] + n - ahead);
                for (int c = 0; c < 3; ++c) {
                    sum[c][f] = multiply_add(load_lanes<V>(entries + (3 * c + f) * grid.stride), after, sum[c][f]);
                    sum[c][f] =
                        multiply_add(load_lanes<V>(entries + (3 * f + c) * grid.stride - ahead), before, sum[c][f]);
                }
            }
        }
        for (int c = 0; c < 3; ++c) {
            const V total = sum[c][0] + sum[c][1] + sum[c][2];
            store_lanes(grid.out[c] + n, residual ? load_lanes<V>(grid.from[c] + n) - total : total);
        }
    }
}

// block = sum over d of S_d A_d + sum over e of c a_e (sum over f of V_ef a_f)^T + pull P + sum over i, k of G_ik B_ik
//         + k_4 G_4
template <bool volume, bool means, class V>
void patterned_cells(const PatternedCells<Scalar<V>>& cells, Range count) {
    constexpr int kEntry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5}; // of a symmetric matrix
    constexpr int kVolume = kSpringDirections, kPull = kVolume + 9, kPatterns = kPull + 1, kFourth = kPatterns + 9;
    for (Range n = 0; n < count; n += kWidth<V>) {
        const auto line = [n](const Scalar<V>* lines, int number)
                              HYBMSS_INLINE_BODY { return load_lanes<V>(lines + number * kMaxWidth + n); };
        const Scalar<V>* by = cells.factor;
        for (int pair = 0; pair < kCornerPairs; ++pair, by += cells.terms) {
            V sum[6];
            const V all = splat<V>(by[kPull]) * line(cells.pull, 0);
            for (int i = 0; i < 6; ++i) {
                sum[i] = i == 0 || i == 3 || i == 5 ? all : splat<V>(0);
            }
            if constexpr (means) {
                for (const int i : {0, 3, 5}) {
                    sum[i] = multiply_add(splat<V>(by[kFourth]), line(cells.fourth, 0), sum[i]);
                }
            }
            for (int d = 0; d < kSpringDirections; ++d) {
                const V factor = splat<V>(by[d]);
                for (int i = 0; i < 6; ++i) {
                    sum[i] = multiply_add(factor, line(cells.springs, 6 * d + i), sum[i]);
                }
            }
            V block[9];
            for (int i = 0; i < 9; ++i) {
                block[i] = sum[kEntry[i]];
            }
            if constexpr (volume) {
                for (int e = 0; e < 3; ++e) {
                    V other[3];
                    for (int i = 0; i < 3; ++i) {
                        other[i] = splat<V>(by[kVolume + 3 * e]) * line(cells.areas, i);
                        other[i] = multiply_add(splat<V>(by[kVolume + 3 * e + 1]), line(cells.areas, 3 + i), other[i]);
                        other[i] = multiply_add(splat<V>(by[kVolume + 3 * e + 2]), line(cells.areas, 6 + i), other[i]);
                    }
                    for (int i = 0; i < 3; ++i) {
                        const V own = line(cells.volume_stiffness, 0) * line(cells.areas, 3 * e + i);
                        for (int j = 0; j < 3; ++j) {
                            block[3 * i + j] = multiply_add(own, other[j], block[3 * i + j]);
                        }
                    }
                }
            }
            if constexpr (means) {
                for (int e = 0; e < 9; ++e) {
                    const V factor = splat<V>(by[kPatterns + e]);
                    for (int i = 0; i < 9; ++i) {
                        block[i] = multiply_add(factor, line(cells.patterns, 9 * e + i), block[i]);
                    }
                }
            }
            for (int i = 0; i < 9; ++i) {
                store_lanes(cells.blocks + (9 * pair + i) * kMaxWidth + n, block[i]);
            }
        }
    }
}

// m = sum over corners of s_a x (F^T r_a) = (T_y z - T_z y, ...),  T_e = F^T sum s_a[e] r_a;  w = inverse m
// A cell gives F (w x s_a) to its corners: sx X + sy Y + sz Z with X = F (w x e_x) and so on.
template <class V>
void turn_cells(const CellTurns<Scalar<V>>& row, Range begin, Range end) {
    for (Range n = begin; n < end; n += kWidth<V>) {
        V S[3][3]; // by corner sign, by component
        for (int c = 0; c < 3; ++c) {
            V at[8];
            for (int corner = 0; corner < 8; ++corner) {
                at[corner] = load_lanes<V>(row.residual[c] + row.corner[corner] + n);
            }
            const V a = at[1] - at[0], b = at[3] - at[2], p = at[5] - at[4], q = at[7] - at[6];
            const V s = at[1] + at[0], t = at[3] + at[2], u = at[5] + at[4], v = at[7] + at[6];
            S[0][c] = (a + b) + (p + q);
            S[1][c] = (t - s) + (v - u);
            S[2][c] = (u + v) - (s + t);
        }
        V F[9], G[6];
        for (int e = 0; e < 9; ++e) {
            F[e] = load_lanes<V>(row.gradient[e] + n);
        }
        for (int e = 0; e < 6; ++e) {
            G[e] = load_lanes<V>(row.inverse[e] + n);
        }
        // T_e[c] = F[.][c] . S_e; only the six that the cross products need.
        const auto t = [&](int e, int c) HYBMSS_INLINE_BODY {
            return multiply_add(F[c], S[e][0], multiply_add(F[3 + c], S[e][1], F[6 + c] * S[e][2]));
        };
        const V mx = t(1, 2) - t(2, 1), my = t(2, 0) - t(0, 2), mz = t(0, 1) - t(1, 0);
        const V wx = multiply_add(G[0], mx, multiply_add(G[1], my, G[2] * mz));
        const V wy = multiply_add(G[1], mx, multiply_add(G[3], my, G[4] * mz));
        const V wz = multiply_add(G[2], mx, multiply_add(G[4], my, G[5] * mz));
        // F (w x e_x) = F (0, wz, -wy), and so on
        for (int c = 0; c < 3; ++c) {
            store_lanes(row.turned[c] + n, subtract_product(F[3 * c + 2], wy, F[3 * c + 1] * wz));
            store_lanes(row.turned[3 + c] + n, subtract_product(F[3 * c], wz, F[3 * c + 2] * wx));
            store_lanes(row.turned[6 + c] + n, subtract_product(F[3 * c + 1], wx, F[3 * c] * wy));
        }
    }
}

// A node takes what the two cells along x give it, of both rows: it is the high corner of those before it. Whole
// vectors, but for the last nodes: what comes behind them belongs to the next row.
template <class V>
void add_turned(const TurnedRows<Scalar<V>>& rows, Range count) {
    using T = Scalar<V>;
    const auto add = [&](auto load, auto store, Range n) HYBMSS_INLINE_BODY {
        for (int c = 0; c < 3; ++c) {
            const auto along = [&](const T* const* of)
                                   HYBMSS_INLINE_BODY { return load(of[c] + n) - load(of[c] + n + 1); };
            const auto across = [&](const T* const* of, int e)
                                    HYBMSS_INLINE_BODY { return load(of[e + c] + n) + load(of[e + c] + n + 1); };
            const auto level = (along(rows.before) + along(rows.now)) + (across(rows.before, 3) - across(rows.now, 3));
            const auto upright = across(rows.before, 6) + across(rows.now, 6);
            if (rows.below[c]) {
                store(rows.below[c] + n, load(rows.below[c] + n) + level - upright);
            }
            if (rows.above[c]) {
                store(rows.above[c] + n, load(rows.above[c] + n) + level + upright);
            }
        }
    };
    Range n = 0;
    for (; n + kWidth<V> <= count; n += kWidth<V>) {
        add([](const T* p) HYBMSS_INLINE_BODY { return load_lanes<V>(p); },
            [](T* p, V v) HYBMSS_INLINE_BODY { store_lanes(p, v); }, n);
    }
    for (; n < count; ++n) {
        add([](const T* p) HYBMSS_INLINE_BODY { return *p; }, [](T* p, T v) HYBMSS_INLINE_BODY { *p = v; }, n);
    }
}

} // namespace

HYBMSS_DEFINE_COMMON_KERNEL(node_blocks);
HYBMSS_DEFINE_COMMON_KERNEL(grid_stencil);
HYBMSS_DEFINE_COMMON_KERNEL(patterned_cells);
HYBMSS_DEFINE_COMMON_KERNEL(turn_cells);
HYBMSS_DEFINE_COMMON_KERNEL(add_turned);

} // namespace hybmss::kernels
