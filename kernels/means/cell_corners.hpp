#pragma once

// The corners of a vector of a network's cells with springs on means, in either of its layouts. Functions of their own,
// which nothing inlines: so what is made for every variant of a kernel is its arithmetic alone.

#include "kernels/network/packed.hpp"
#include "kernels/network/soa.hpp"

namespace hybmss::kernels {
namespace {

/// What a vector of cells is multiplied by: k_c h, 1 / h and kappa h^2 / 32.
template <class V>
struct MeanFactors {
    V stiffness, inverse_edge, kappa;
};
template <class V>
HYBMSS_INLINE MeanFactors<V> mean_factors(const MeanCells<Scalar<V>>& cells, Range i, int lane) {
    const auto of = [lane](const auto* stiffness, const auto& shape) {
        const V k = load_lanes<V>(stiffness + lane);
        return MeanFactors<V>{k, load_lanes<V>(shape.inverse_edge + lane),
                              k * load_lanes<V>(shape.volume_ratio + lane)};
    };
    if (cells.runs) {
        const CellRun& run = cells.runs[i];
        return of(cells.stiffnesses[run.weights].lane, cells.shapes[run.shape]);
    }
    return of(cells.blocks[i].stiffness, cells.blocks[i]);
}

/// (u_c - u_0) / h: a body far from its rest position loses no digits.
template <class V>
[[gnu::noinline]] void load_corners(const MeanCells<Scalar<V>>& cells, Range i, int lane,
                                    const Scalar<V>* const (&field)[3], V inverse_edge, Vector3<V> (&corner)[8]) {
    const V zero = splat<V>(0);
    if (field[1]) {
        const auto& node = cells.blocks[i].node;
        const Vector3<V> low = gather_vector<V>(field, node[0] + lane);
        for (int c = 1; c < 8; ++c) {
            corner[c] = scaled(inverse_edge, gather_vector<V>(field, node[c] + lane) - low);
        }
    } else {
        const auto load = [&](int c, V(&q)[4]) {
            if (cells.runs) {
                load_row(field[0] + cells.runs[i].node[c] + 4 * lane, q);
            } else {
                load_quads(field[0], cells.blocks[i].node[c] + lane, q);
            }
        };
        V low[4];
        load(0, low);
        for (int c = 1; c < 8; ++c) {
            V q[4];
            load(c, q);
            for (int j = 0; j < 4; ++j) {
                q[j] = q[j] - low[j];
            }
            transpose_quads(q);
            corner[c] = scaled(inverse_edge, Vector3<V>{q[0], q[1], q[2]});
        }
    }
    corner[0] = {zero, zero, zero};
}

/// Adds a vector to each corner of the cells from `first` on.
template <class V>
[[gnu::noinline]] void add_corners(const MeanCells<Scalar<V>>& cells, Range i, int first,
                                   const Vector3<V> (&corners)[kTogether<V>][8], Scalar<V>* const (&sum)[3]) {
    // Neighbours along x apart: what one writes must not be read at once by the other.
    for (const int c : {0, 4, 2, 6, 1, 5, 3, 7}) {
        for (int v = 0; v < kTogether<V>; ++v) {
            const Vector3<V>& corner = corners[v][c];
            const int lane = first + v * kWidth<V>;
            if (sum[1]) {
                const std::int32_t* const node = cells.blocks[i].node[c] + lane;
                scatter_vector(gather_vector<V>(sum, node) + corner, sum, node);
                continue;
            }
            V q[4];
            vector_to_quads(corner, q);
            if (cells.runs) {
                accumulate_row<true>(q, sum[0] + cells.runs[i].node[c] + 4 * lane);
            } else {
                accumulate_quads<true>(q, sum[0], cells.blocks[i].node[c] + lane);
            }
        }
    }
}

/// Adds a 3x3 block to that of each corner's node, one node after the other: a diagonal is made once for many products.
template <class V>
[[gnu::noinline]] void add_corner_blocks(const MeanCells<Scalar<V>>& cells, Range i, int lane, bool packed,
                                         const Symmetric3<V> (&corner)[8], const DiagonalBlocks<Scalar<V>>& blocks) {
    for (int c = 0; c < 8; ++c) {
        for (int e = 0; e < kBlockEntries; ++e) {
            alignas(64) Scalar<V> values[kWidth<V>];
            store_lanes(values, corner[c].entry[e]);
            for (int l = 0; l < kWidth<V>; ++l) {
                const std::int32_t first =
                    cells.runs ? cells.runs[i].node[c] + kRow<V>.index[lane + l] : cells.blocks[i].node[c][lane + l];
                blocks.entry[e][packed ? first / 4 : first] += values[l];
            }
        }
    }
}

/// visit(number of block or run, lane, factors) of every vector of the cells [begin, end).
template <class V, class Visit>
HYBMSS_INLINE void for_each_vector(const MeanCells<Scalar<V>>& cells, Range begin, Range end, const Visit& visit) {
    for (Range i = begin; i < end; ++i) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            visit(i, lane, mean_factors<V>(cells, i, lane));
        }
    }
}

/// The same, and adds to `sum` what visit(number of block or run, lane, factors, corners) leaves of the corners.
template <class V, class Visit>
HYBMSS_INLINE void add_to_corners(const MeanCells<Scalar<V>>& cells, Range begin, Range end, Scalar<V>* const (&sum)[3],
                                  const Visit& visit) {
    for (Range i = begin; i < end; ++i) {
        for (int first = 0; first < kBlockItems; first += kTogether<V> * kWidth<V>) {
            Vector3<V> corners[kTogether<V>][8];
            for (int v = 0; v < kTogether<V>; ++v) {
                const int lane = first + v * kWidth<V>;
                visit(i, lane, mean_factors<V>(cells, i, lane), corners[v]);
            }
            add_corners(cells, i, first, corners, sum);
        }
    }
}

/// Adds to the sums what visit(number of block or run, lane, factors, found) finds.
template <class V, std::size_t sums, class Visit>
HYBMSS_INLINE void add_of_cells(const MeanCells<Scalar<V>>& cells, Range begin, Range end, double (&sum)[sums],
                                const Visit& visit) {
    for (Range i = begin; i < end; ++i) {
        for (int first = 0; first < kBlockItems; first += kTogether<V> * kWidth<V>) {
            V found[sums], all[sums][kTogether<V>];
            for (int v = 0; v < kTogether<V>; ++v) {
                const int lane = first + v * kWidth<V>;
                visit(i, lane, mean_factors<V>(cells, i, lane), found);
                for (std::size_t s = 0; s < sums; ++s) {
                    all[s][v] = found[s];
                }
            }
            for (std::size_t s = 0; s < sums; ++s) {
                if (cells.runs) {
                    add_run(sum[s], all[s]);
                    continue;
                }
                for (const V& value : all[s]) {
                    add_in_double(sum[s], value);
                }
            }
        }
    }
}

} // namespace
} // namespace hybmss::kernels
