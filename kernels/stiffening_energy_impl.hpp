#pragma once

#include "kernels/lattice/lattice_hessian_impl.hpp"
#include "kernels/network/network_hessian_impl.hpp"
#include "kernels/network/run_hessian_impl.hpp"

// Sums of the stiffening energy k l^2 (quadratic e^3/3 + cubic e^4/4) in every layout.

namespace hybmss::kernels {
namespace {

template <class V, int corners, class... Springs>
HYBMSS_INLINE V stiffening_energies(SpringGroup<Springs...>, const Vector3<V> (&u)[corners], const V (&k)[7],
                                    const StiffeningConstants<Scalar<V>>& c) {
    V sum = splat<V>(0);
    ((sum = multiply_add(k[Springs::kKind] * splat<V>(Scalar<V>(Springs::kLength2)),
                         stiffening_energy(Springs::stretch(u[Springs::b] - u[Springs::a]), c), sum)),
     ...);
    return sum;
}

/// Of the springs that start at a plane's nodes; with `top` of the topmost plane's.
template <bool face_diagonals, bool top, class V>
double lattice_stiffening_energy(const LatticeHessianLayer<Scalar<V>, 3>& layer) {
    double energy = 0;
    for (std::ptrdiff_t n = first_vector<V>(layer); n < layer.lanes; n += kWidth<V>) {
        const CellRows at = hessian_rows<V>(layer, n);
        V k[7];
        for (int kind = 0; kind < 7; ++kind) {
            k[kind] = load_lanes<V>(layer.stiffness[kind] + n);
        }
        Vector3<V> u[8];
        if constexpr (top) {
            load_row<V>(layer.displacement, n, u[0], u[1]);
            load_row<V>(layer.displacement, at.low_y, u[2], u[3]);
            energy += sum_in_double(stiffening_energies(PlaneSprings<face_diagonals>{}, u, k, layer.stiffening));
        } else {
            load_cells<V>(layer, layer.displacement, at, u);
            energy += sum_in_double(stiffening_energies(CubeDiagonals{}, u, k, layer.stiffening) +
                                    stiffening_energies(EdgesAndFaces<face_diagonals>{}, u, k, layer.stiffening));
        }
    }
    return energy;
}

template <class V>
double soa_stiffening_energy(const NetworkSprings<Scalar<V>>& springs, const HessianArrays<Scalar<V>>& nodes,
                             std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const V scale = divide(load_lanes<V>(springs.stiffness + i), load_lanes<V>(springs.inverse_length2 + i));
        energy += sum_in_double(scale * stiffening_energy(s, nodes.stiffening));
    }
    return energy;
}

template <class V>
double packed_stiffening_energy(const SpringBlock<Scalar<V>>* blocks, const PackedHessian<Scalar<V>>& nodes,
                                std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t b = begin; b < end; ++b) {
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            Vector3<V> rest, du;
            const V s = block_stretch<V>(blocks[b], lane, nodes.displacement, rest, du);
            const V scale =
                divide(load_lanes<V>(blocks[b].stiffness + lane), load_lanes<V>(blocks[b].inverse_length2 + lane));
            energy += sum_in_double(scale * stiffening_energy(s, nodes.stiffening));
        }
    }
    return energy;
}

template <class V>
double run_stiffening_energy(const SpringRuns<Scalar<V>>* springs, const PackedHessian<Scalar<V>>& nodes,
                             std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        SpringBlock<Scalar<V>> block;
        set_block<V>(*springs, i, block);
        energy += packed_stiffening_energy<V>(&block, nodes, 0, 1);
    }
    return energy;
}

} // namespace
} // namespace hybmss::kernels
