// Compiled once for each instruction set: second derivatives of a network as structure of arrays, and passes by other
// laws of the springs.
#include "kernels/compiled_set.hpp"
#include "kernels/network/network_hessian.hpp"
#include "kernels/network/soa.hpp"
#include "kernels/volume_law.hpp"

namespace hybmss::kernels {
namespace {

/// product_b += H (p_b - p_a), or what another law says, product_a -= the same, for the springs of [begin, end), one
/// colour.
template <SpringLaw law, Accuracy accuracy, class V>
void soa_spring_product(const NetworkSprings<Scalar<V>>& springs, const HessianArrays<Scalar<V>>& nodes,
                        std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; i += kTogether<V> * kWidth<V>) {
        Vector3<V> change[kTogether<V>];
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            Vector3<V> rest, du;
            const V s = spring_stretch<V>(springs, nodes.displacement, at, rest, du);
            Vector3<V> p = rest + du;
            if constexpr (law != SpringLaw::stiffening) {
                p = gather_vector<V>(nodes.direction, node_lanes(springs.b, springs.in_row, at)) -
                    gather_vector<V>(nodes.direction, node_lanes(springs.a, springs.in_row, at));
            }
            change[v] = law_product<law>(load_lanes<V>(springs.stiffness + at), s, one_minus_rsqrt<accuracy>(s),
                                         load_lanes<V>(springs.inverse_length2 + at), rest + du, p, nodes.stiffening);
        });
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            const NodeLanes a = node_lanes(springs.a, springs.in_row, at);
            scatter_vector(gather_vector<V>(nodes.product, a) - change[v], nodes.product, a);
        });
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            const NodeLanes b = node_lanes(springs.b, springs.in_row, at);
            scatter_vector(gather_vector<V>(nodes.product, b) + change[v], nodes.product, b);
        });
    }
}

/// Adds kappa [ phi''/V0 (grad V' . p) grad V' + phi' (hess V') p ] of the cells of one colour.
template <Volume volume, class V>
void soa_cell_product(const NetworkCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
                      std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        const HexahedronVolume<V> cell = hexahedron_volume<V>(cells, nodes.displacement, i);
        const VolumeDerivatives<V> phi = volume_derivatives<volume>(cell.dilation);
        const V scale = load_lanes<V>(cells.kappa + i) * splat<V>(T(0.25));
        Vector3<V> p[3], change[3];
        mean_edges(cells, nodes.direction, i, p);
        cofactor_products(cell, p, scale * phi.curvature * load_lanes<V>(cells.inverse_volume + i),
                          scale * splat<V>(nodes.stiffening.geometric) * phi.slope, change);
        const Vector3<V> plus = change[0] + change[1], minus = change[0] - change[1];
        // On the corners 7, 6, 5, 4; those on 0, 1, 2, 3 are opposite.
        const Vector3<V> high_change[4] = {plus + change[2], change[2] - minus, minus + change[2], change[2] - plus};
        for (int corner = 0; corner < 4; ++corner) {
            const NodeLanes low = node_lanes(cells.node[corner], cells.in_row, i),
                            high = node_lanes(cells.node[7 - corner], cells.in_row, i);
            scatter_vector(gather_vector<V>(nodes.product, low) - high_change[corner], nodes.product, low);
            scatter_vector(gather_vector<V>(nodes.product, high) + high_change[corner], nodes.product, high);
        }
    }
}

template <class V, class T>
HYBMSS_INLINE void add_blocks(const Symmetric3<V>& h, const DiagonalBlocks<T>& blocks, const NodeLanes& at) {
    for (int e = 0; e < kBlockEntries; ++e) {
        scatter_lanes(gather_lanes<V>(blocks.entry[e], at) + h.entry[e], blocks.entry[e], at);
    }
}

/// Adds H to the blocks of both ends of the springs of [begin, end), one colour.
template <SpringLaw law, Accuracy accuracy, class V>
void soa_spring_diagonal(const NetworkSprings<Scalar<V>>& springs, const HessianArrays<Scalar<V>>& nodes,
                         const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const Symmetric3<V> h =
            law_block<law>(load_lanes<V>(springs.stiffness + i), s, one_minus_rsqrt<accuracy>(s),
                           load_lanes<V>(springs.inverse_length2 + i), rest + du, blocks.stiffening);
        add_blocks(h, blocks, node_lanes(springs.a, springs.in_row, i));
        add_blocks(h, blocks, node_lanes(springs.b, springs.in_row, i));
    }
}

/// Adds kappa phi''/V0 (grad V')(grad V')^T, corner by corner; the second derivative of V' with respect to one corner
/// is zero.
template <Volume volume, class V>
void soa_cell_diagonal(const NetworkCells<Scalar<V>>& cells, const HessianArrays<Scalar<V>>& nodes,
                       const DiagonalBlocks<Scalar<V>>& blocks, std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        const HexahedronVolume<V> cell = hexahedron_volume<V>(cells, nodes.displacement, i);
        const V scale = load_lanes<V>(cells.kappa + i) * volume_derivatives<volume>(cell.dilation).curvature *
                        load_lanes<V>(cells.inverse_volume + i) * splat<V>(T(1.0 / 16.0));
        const Vector3<V> plus = cell.bc + cell.ca, minus = cell.bc - cell.ca;
        const Vector3<V> gradient[4] = {plus + cell.ab, cell.ab - minus, minus + cell.ab, cell.ab - plus};
        for (int corner = 0; corner < 4; ++corner) {
            const Symmetric3<V> h = rank_one(splat<V>(0), scale, gradient[corner]);
            add_blocks(h, blocks, node_lanes(cells.node[corner], cells.in_row, i));
            add_blocks(h, blocks, node_lanes(cells.node[7 - corner], cells.in_row, i));
        }
    }
}

template <class V>
double soa_stiffening_energy(const NetworkSprings<Scalar<V>>& springs, const HessianArrays<Scalar<V>>& nodes,
                             std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const V scale = divide(load_lanes<V>(springs.stiffness + i), load_lanes<V>(springs.inverse_length2 + i));
        add_in_double(energy, scale * stiffening_energy(s, nodes.stiffening));
    }
    return energy;
}

} // namespace

HYBMSS_DEFINE_ORDERED_KERNEL(soa_spring_product);
HYBMSS_DEFINE_COMMON_KERNEL(soa_cell_product);
HYBMSS_DEFINE_COMMON_KERNEL(soa_spring_diagonal);
HYBMSS_DEFINE_COMMON_KERNEL(soa_cell_diagonal);
HYBMSS_DEFINE_ORDERED_KERNEL(soa_stiffening_energy);

} // namespace hybmss::kernels
