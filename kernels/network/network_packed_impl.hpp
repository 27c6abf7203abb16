#pragma once

#include "kernels/lattice/lattice_cell.hpp"
#include "kernels/network/network_kernels.hpp"
#include "kernels/network/network_quads.hpp"

namespace hybmss::kernels {
namespace {

/// x, y, z of u_to - u_from, for a vector of pairs of nodes. Subtracted before it is transposed: one transposition,
/// not two.
template <class V>
HYBMSS_INLINE Vector3<V> quad_difference(const Scalar<V>* u, const std::int32_t* from, const std::int32_t* to) {
    V low[4], high[4];
    load_quads(u, from, low);
    load_quads(u, to, high);
    for (int j = 0; j < 4; ++j) {
        high[j] = high[j] - low[j];
    }
    transpose_quads(high);
    return {high[0], high[1], high[2]};
}

template <class V>
HYBMSS_INLINE void vector_to_quads(const Vector3<V>& v, V (&q)[4]) {
    q[0] = v.x;
    q[1] = v.y;
    q[2] = v.z;
    q[3] = splat<V>(0);
    transpose_quads(q);
}

/// s = |d|^2 / l^2 - 1 = (2 r.du + du.du) / l^2 of the springs at `lane` of a block.
template <class V>
HYBMSS_INLINE V block_stretch(const SpringBlock<Scalar<V>>& block, int lane, const Scalar<V>* u, Vector3<V>& rest,
                              Vector3<V>& du) {
    du = quad_difference<V>(u, block.a + lane, block.b + lane);
    rest = {load_lanes<V>(block.rest[0] + lane), load_lanes<V>(block.rest[1] + lane),
            load_lanes<V>(block.rest[2] + lane)};
    return load_lanes<V>(block.inverse_length2 + lane) * multiply_add(splat<V>(2), dot(rest, du), dot(du, du));
}

/// Adds the forces of `count` vectors of springs, the first of them at `lane` of `block`, computed side by side: one
/// alone is a chain of some forty dependent operations, longer than a processor looks ahead.
template <Accuracy accuracy, int count, class V>
HYBMSS_INLINE void add_block_forces(const SpringBlock<Scalar<V>>* block, int lane,
                                    const PackedNodes<Scalar<V>>& nodes) {
    const auto block_of = [&](int i) -> const SpringBlock<Scalar<V>>& {
        return block[(lane + i * kWidth<V>) / kBlockItems];
    };
    const auto lane_of = [&](int i) { return (lane + i * kWidth<V>) % kBlockItems; };
    V s[count], tension[count];
    Vector3<V> d[count];
    for (int i = 0; i < count; ++i) {
        Vector3<V> rest, du;
        s[i] = block_stretch<V>(block_of(i), lane_of(i), nodes.displacement, rest, du);
        d[i] = rest + du;
    }
    one_minus_rsqrt<accuracy>(s, tension);
    for (int i = 0; i < count; ++i) {
        V force[4];
        vector_to_quads(scaled(load_lanes<V>(block_of(i).stiffness + lane_of(i)) * tension[i], d[i]), force);
        accumulate_quads<true>(force, nodes.force, block_of(i).a + lane_of(i));
        accumulate_quads<false>(force, nodes.force, block_of(i).b + lane_of(i));
    }
}

/// f_a += k (1 - l/|d|) d, f_b -= the same, d = r + u_b - u_a, for the springs of blocks in which no node occurs twice.
template <Accuracy accuracy, class V>
void packed_springs(const SpringBlock<Scalar<V>>* blocks, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                    std::ptrdiff_t end) {
    constexpr int kCount = Traits<V>::kAvx512 ? 4 : 2; // with sixteen registers more gains nothing
    constexpr int kLanes = kCount * kWidth<V>;
    constexpr int kBlocks = kLanes > kBlockItems ? kLanes / kBlockItems : 1;
    std::ptrdiff_t b = begin;
    for (; b + kBlocks <= end; b += kBlocks) {
        for (int lane = 0; lane < kBlocks * kBlockItems; lane += kLanes) {
            add_block_forces<accuracy, kCount, V>(blocks + b, lane, nodes);
        }
    }
    for (; b < end; ++b) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            add_block_forces<accuracy, 1, V>(blocks + b, lane, nodes);
        }
    }
}

/// A cell's deformed mean edges, the cofactors b x c, c x a, a x b, and J - 1.
template <class V>
struct BlockVolume {
    Vector3<V> a, b, c, bc, ca, ab;
    V dilation;
};

/// A mean of four edges is a quarter of a signed sum over the cube diagonals 0-7, 1-6, 2-5, 3-4, formed before anything
/// is transposed.
template <class V>
HYBMSS_INLINE void mean_edges(const V (&diagonal)[4][4], Vector3<V> (&edges)[3]) {
    V mean[3][4];
    const V quarter = splat<V>(Scalar<V>(0.25));
    for (int j = 0; j < 4; ++j) {
        const V d0 = diagonal[0][j], d1 = diagonal[1][j], d2 = diagonal[2][j], d3 = diagonal[3][j];
        const V sum01 = d0 + d1, sum23 = d2 + d3;
        mean[0][j] = quarter * ((d0 - d1) + (d2 - d3));
        mean[1][j] = quarter * (sum01 - sum23);
        mean[2][j] = quarter * (sum01 + sum23);
    }
    for (int edge = 0; edge < 3; ++edge) {
        transpose_quads(mean[edge]);
        edges[edge] = {mean[edge][0], mean[edge][1], mean[edge][2]};
    }
}

/// The mean edges of a field at the corners of cells: how a, b and c change with it.
template <class V>
HYBMSS_INLINE void mean_edges(const CellBlock<Scalar<V>>& block, int lane, const Scalar<V>* field,
                              Vector3<V> (&edges)[3]) {
    V diagonal[4][4];
    for (int corner = 0; corner < 4; ++corner) {
        V low[4];
        load_quads(field, block.node[corner] + lane, low);
        load_quads(field, block.node[7 - corner] + lane, diagonal[corner]);
        for (int j = 0; j < 4; ++j) {
            diagonal[corner][j] = diagonal[corner][j] - low[j];
        }
    }
    mean_edges(diagonal, edges);
}

/// From the changes of the mean edges; `shapes` has the rest shapes.
template <class V, class Shapes>
HYBMSS_INLINE BlockVolume<V> deformed_volume(const Shapes& shapes, int lane, const Vector3<V> (&change)[3]) {
    Vector3<V> rest[3];
    for (int edge = 0; edge < 3; ++edge) {
        rest[edge] = {load_lanes<V>(shapes.rest_edge[3 * edge] + lane),
                      load_lanes<V>(shapes.rest_edge[3 * edge + 1] + lane),
                      load_lanes<V>(shapes.rest_edge[3 * edge + 2] + lane)};
    }
    const Vector3<V>&da = change[0], &db = change[1], &dc = change[2];
    const Vector3<V> a = rest[0] + da, b = rest[1] + db, c = rest[2] + dc;
    BlockVolume<V> cell{a, b, c, cross(b, c), cross(c, a), cross(a, b), {}};
    // V' - V0 = da.(b x c) + a0.(db x c) + a0.(b0 x dc), each term of the first order in the displacement.
    cell.dilation = (dot(da, cell.bc) + dot(rest[0], cross(db, c) + cross(rest[1], dc))) *
                    load_lanes<V>(shapes.inverse_volume + lane);
    return cell;
}

template <class V>
HYBMSS_INLINE BlockVolume<V> block_volume(const CellBlock<Scalar<V>>& block, int lane, const Scalar<V>* u) {
    Vector3<V> change[3];
    mean_edges(block, lane, u, change);
    return deformed_volume(block, lane, change);
}

/// The forces on the corners 0, 1, 2, 3, as quads; those on 7, 6, 5, 4 are opposite.
template <Volume volume, class V>
HYBMSS_INLINE void corner_forces(const BlockVolume<V>& cell, V kappa, V (&force)[4][4]) {
    const V pressure = kappa * splat<V>(Scalar<V>(0.25)) * volume_slope<volume>(cell.dilation);
    // Three transpositions back; the four pairs of corners are signed sums of what they give.
    V bc[4], ca[4], ab[4];
    vector_to_quads(scaled(pressure, cell.bc), bc);
    vector_to_quads(scaled(pressure, cell.ca), ca);
    vector_to_quads(scaled(pressure, cell.ab), ab);
    for (int j = 0; j < 4; ++j) {
        const V plus = bc[j] + ca[j], minus = bc[j] - ca[j];
        force[0][j] = plus + ab[j];
        force[1][j] = ab[j] - minus;
        force[2][j] = minus + ab[j];
        force[3][j] = ab[j] - plus;
    }
}

/// f_i -= kappa phi'(J) dV'/dx_i, dV'/dx_i = 1/4 (+-(b x c) +- (c x a) +- (a x b)), for the cells of such blocks.
template <Volume volume, class V>
void packed_cells(const CellBlock<Scalar<V>>* blocks, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                  std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const CellBlock<Scalar<V>>& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            V force[4][4];
            corner_forces<volume>(block_volume<V>(block, lane, nodes.displacement), load_lanes<V>(block.kappa + lane),
                                  force);
            for (int corner = 0; corner < 4; ++corner) {
                accumulate_quads<true>(force[corner], nodes.force, block.node[corner] + lane);
                accumulate_quads<false>(force[corner], nodes.force, block.node[7 - corner] + lane);
            }
        }
    }
}

/// Sum of 1/2 k (|d| - l)^2.
template <class V>
double packed_spring_energy(const SpringBlock<Scalar<V>>* blocks, const PackedNodes<Scalar<V>>& nodes,
                            std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t b = begin; b < end; ++b) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            Vector3<V> rest, du;
            const V s = block_stretch<V>(blocks[b], lane, nodes.displacement, rest, du);
            const V scale = splat<V>(Scalar<V>(0.5)) * load_lanes<V>(blocks[b].stiffness + lane) /
                            load_lanes<V>(blocks[b].inverse_length2 + lane);
            energy += sum_in_double(scale * squared_strain(s));
        }
    }
    return energy;
}

/// Sum of kappa V0 phi(J).
template <Volume volume, class V>
double packed_cell_energy(const CellBlock<Scalar<V>>* blocks, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                          std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t b = begin; b < end; ++b) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const V dilation = block_volume<V>(blocks[b], lane, nodes.displacement).dilation;
            const V scale =
                divide(load_lanes<V>(blocks[b].kappa + lane), load_lanes<V>(blocks[b].inverse_volume + lane));
            energy += sum_in_double(scale * volume_energy<volume>(dilation));
        }
    }
    return energy;
}

/// v <- (v + dt (f/m + g)) / (1 + dt c), u <- u + dt v, f <- 0, four components a node; the fourth stays zero.
template <bool driven, class V>
void packed_integrate(const PackedNodes<Scalar<V>>& nodes, const StepConstants<Scalar<V>>& step, std::ptrdiff_t begin,
                      std::ptrdiff_t end) {
    const V force_factor = splat<V>(step.force_factor), time_step = splat<V>(step.time_step);
    alignas(64) Scalar<V> gain[kMaxWidth];
    for (int i = 0; i < kMaxWidth; ++i) {
        gain[i] = i % 4 < 3 ? step.velocity_gain[i % 4] : Scalar<V>(0);
    }
    for (std::ptrdiff_t i = 4 * begin; i < 4 * end; i += kWidth<V>) {
        const V mass = load_lanes<V>(nodes.inverse_mass + i);
        V v = load_lanes<V>(nodes.velocity + i);
        if constexpr (driven) {
            // Dummies (inverse mass 0) must not fall.
            v = multiply_add(v, splat<V>(step.velocity_factor),
                             one_where_positive(mass) * load_lanes<V>(gain + i % kMaxWidth % 4));
        }
        v = multiply_add(load_lanes<V>(nodes.force + i), mass * force_factor, v);
        store_lanes(nodes.velocity + i, v);
        store_lanes(nodes.displacement + i, multiply_add(time_step, v, load_lanes<V>(nodes.displacement + i)));
        store_lanes(nodes.force + i, splat<V>(0));
    }
}

} // namespace
} // namespace hybmss::kernels
