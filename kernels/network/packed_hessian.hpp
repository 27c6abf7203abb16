#pragma once

// Second derivatives of a network whose nodes are packed, x y z 0, and passes by other laws of the springs.

#include "kernels/network/network_hessian.hpp"
#include "kernels/network/packed.hpp"

namespace hybmss::kernels {
namespace {

/// Adds the products of `count` vectors of springs, the first of them at `lane` of `block`, computed side by side as in
/// add_block_forces.
template <Accuracy accuracy, int count, SpringLaw law, class V>
HYBMSS_INLINE void add_block_products(const SpringBlock<Scalar<V>>* block, int lane,
                                      const PackedHessian<Scalar<V>>& nodes) {
    const auto block_of = [&](int i) -> const SpringBlock<Scalar<V>>& {
        return block[(lane + i * kWidth<V>) / kBlockItems];
    };
    const auto lane_of = [&](int i) { return (lane + i * kWidth<V>) % kBlockItems; };
    V s[count], t[count];
    Vector3<V> d[count];
    for (int i = 0; i < count; ++i) {
        Vector3<V> rest, du;
        s[i] = block_stretch<V>(block_of(i), lane_of(i), nodes.displacement, rest, du);
        d[i] = rest + du;
    }
    one_minus_rsqrt<accuracy>(s, t);
    V change[count][4];
    for (int i = 0; i < count; ++i) {
        const SpringBlock<Scalar<V>>& springs = block_of(i);
        const int at = lane_of(i);
        Vector3<V> p = d[i];
        if constexpr (law != SpringLaw::stiffening) {
            p = quad_difference<V>(nodes.direction, springs.a + at, springs.b + at);
        }
        vector_to_quads(law_product<law>(load_lanes<V>(springs.stiffness + at), s[i], t[i],
                                         load_lanes<V>(springs.inverse_length2 + at), d[i], p, nodes.stiffening),
                        change[i]);
        accumulate_quads<false>(change[i], nodes.product, springs.a + at);
        if constexpr (!Traits<V>::kAlike) {
            accumulate_quads<true>(change[i], nodes.product, springs.b + at);
        }
    }
    // Of a run (run_hessian_kernels.cpp) a node may be both: so all low ends of a block come first.
    for (int i = 0; Traits<V>::kAlike && i < count; ++i) {
        accumulate_quads<true>(change[i], nodes.product, block_of(i).b + lane_of(i));
    }
}

/// product_b += H (p_b - p_a), or what another law says, product_a -= the same, for the springs of blocks in which no
/// node occurs twice.
template <SpringLaw law, Accuracy accuracy, class V>
void packed_spring_product(const SpringBlock<Scalar<V>>* blocks, const PackedHessian<Scalar<V>>& nodes,
                           std::ptrdiff_t begin, std::ptrdiff_t end) {
    constexpr int kCount = Traits<V>::kAlike ? kTogether<V> : Traits<V>::kAvx512 ? 4 : 2;
    constexpr int kLanes = kCount * kWidth<V>;
    constexpr int kBlocks = kLanes > kBlockItems ? kLanes / kBlockItems : 1;
    std::ptrdiff_t b = begin;
    for (; b + kBlocks <= end; b += kBlocks) {
        for (int lane = 0; lane < kBlocks * kBlockItems; lane += kLanes) {
            add_block_products<accuracy, kCount, law, V>(blocks + b, lane, nodes);
        }
    }
    for (; b < end; ++b) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            add_block_products<accuracy, 1, law, V>(blocks + b, lane, nodes);
        }
    }
}

/// Adds kappa [ phi''/V0 (grad V' . p) grad V' + phi' (hess V') p ] of the cells of such blocks.
template <Volume volume, class V>
void packed_cell_product(const CellBlock<Scalar<V>>* blocks, const PackedHessian<Scalar<V>>& nodes,
                         std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const CellBlock<Scalar<V>>& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const BlockVolume<V> cell = block_volume<V>(block, lane, nodes.displacement);
            const VolumeDerivatives<V> phi = volume_derivatives<volume>(cell.dilation);
            const V scale = load_lanes<V>(block.kappa + lane) * splat<V>(Scalar<V>(0.25));
            Vector3<V> p[3], change[3];
            mean_edges(block, lane, nodes.direction, p);
            cofactor_products(cell, p, scale * phi.curvature * load_lanes<V>(block.inverse_volume + lane),
                              scale * splat<V>(nodes.stiffening.geometric) * phi.slope, change);
            V bc[4], ca[4], ab[4];
            vector_to_quads(change[0], bc);
            vector_to_quads(change[1], ca);
            vector_to_quads(change[2], ab);
            V high[4][4]; // on the corners 7, 6, 5, 4; those on 0, 1, 2, 3 are opposite
            for (int j = 0; j < 4; ++j) {
                const V plus = bc[j] + ca[j], minus = bc[j] - ca[j];
                high[0][j] = plus + ab[j];
                high[1][j] = ab[j] - minus;
                high[2][j] = minus + ab[j];
                high[3][j] = ab[j] - plus;
            }
            for (int corner = 0; corner < 4; ++corner) {
                accumulate_quads<false>(high[corner], nodes.product, block.node[corner] + lane);
                accumulate_quads<true>(high[corner], nodes.product, block.node[7 - corner] + lane);
            }
        }
    }
}

/// Adds a vector of blocks to those of the nodes whose first elements are at `first`, one node after the other: a
/// diagonal is made once for many products.
template <class V>
HYBMSS_INLINE void add_packed_blocks(const Symmetric3<V>& h, const DiagonalBlocks<Scalar<V>>& blocks,
                                     const std::int32_t* first) {
    for (int e = 0; e < kBlockEntries; ++e) {
        alignas(64) Scalar<V> lanes[kWidth<V>];
        store_lanes(lanes, h.entry[e]);
        for (int i = 0; i < kWidth<V>; ++i) {
            blocks.entry[e][first[i] / 4] += lanes[i];
        }
    }
}

/// Adds H to the blocks of both ends.
template <SpringLaw law, Accuracy accuracy, class V>
void packed_spring_diagonal(const SpringBlock<Scalar<V>>* springs, const Scalar<V>* displacement,
                            const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            Vector3<V> rest, du;
            const V s = block_stretch<V>(springs[i], lane, displacement, rest, du);
            const Symmetric3<V> h =
                law_block<law>(load_lanes<V>(springs[i].stiffness + lane), s, one_minus_rsqrt<accuracy>(s),
                               load_lanes<V>(springs[i].inverse_length2 + lane), rest + du, blocks.stiffening);
            add_packed_blocks(h, blocks, springs[i].a + lane);
            add_packed_blocks(h, blocks, springs[i].b + lane);
        }
    }
}

/// Adds kappa phi''/V0 (grad V')(grad V')^T, corner by corner.
template <Volume volume, class V>
void packed_cell_diagonal(const CellBlock<Scalar<V>>* cells, const Scalar<V>* displacement,
                          const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const BlockVolume<V> cell = block_volume<V>(cells[i], lane, displacement);
            const V scale = load_lanes<V>(cells[i].kappa + lane) * volume_derivatives<volume>(cell.dilation).curvature *
                            load_lanes<V>(cells[i].inverse_volume + lane) * splat<V>(Scalar<V>(1.0 / 16.0));
            const Vector3<V> plus = cell.bc + cell.ca, minus = cell.bc - cell.ca;
            const Vector3<V> gradient[4] = {plus + cell.ab, cell.ab - minus, minus + cell.ab, cell.ab - plus};
            for (int corner = 0; corner < 4; ++corner) {
                const Symmetric3<V> h = rank_one(splat<V>(0), scale, gradient[corner]);
                add_packed_blocks(h, blocks, cells[i].node[corner] + lane);
                add_packed_blocks(h, blocks, cells[i].node[7 - corner] + lane);
            }
        }
    }
}

/// What the springs at `lane` of a block store.
template <class V>
HYBMSS_INLINE V block_stiffening(const SpringBlock<Scalar<V>>& block, int lane, const PackedHessian<Scalar<V>>& nodes) {
    Vector3<V> rest, du;
    const V s = block_stretch<V>(block, lane, nodes.displacement, rest, du);
    const V scale = divide(load_lanes<V>(block.stiffness + lane), load_lanes<V>(block.inverse_length2 + lane));
    return scale * stiffening_energy(s, nodes.stiffening);
}

template <class V>
double packed_stiffening_energy(const SpringBlock<Scalar<V>>* blocks, const PackedHessian<Scalar<V>>& nodes,
                                std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t b = begin; b < end; ++b) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            add_in_double(energy, block_stiffening<V>(blocks[b], lane, nodes));
        }
    }
    return energy;
}

} // namespace
} // namespace hybmss::kernels
