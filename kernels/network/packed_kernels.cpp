// Compiled once for each instruction set.
#include "kernels/compiled_set.hpp"
#include "kernels/network/packed.hpp"

namespace hybmss::kernels {
namespace {

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
            const V scale = divide(splat<V>(Scalar<V>(0.5)) * load_lanes<V>(blocks[b].stiffness + lane),
                                   load_lanes<V>(blocks[b].inverse_length2 + lane));
            add_in_double(energy, scale * squared_strain(s));
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
            add_in_double(energy, scale * volume_energy<volume>(dilation));
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

HYBMSS_DEFINE_KERNEL(packed_springs);
HYBMSS_DEFINE_KERNEL(packed_cells);
HYBMSS_DEFINE_ORDERED_KERNEL(packed_spring_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(packed_cell_energy);
HYBMSS_DEFINE_KERNEL(packed_integrate);

} // namespace hybmss::kernels
