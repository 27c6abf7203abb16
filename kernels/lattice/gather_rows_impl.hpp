#pragma once

// The layout gather-rows: every node collects the forces of all springs and cells that it belongs to. Nothing is
// scattered and no two nodes write to one place, but each spring is evaluated at both of its ends and each cell's
// volume at all of its corners.

#include "kernels/lattice/lattice_sweep.hpp"

namespace hybmss::kernels {
namespace {

/// How far a corner of a cell is from the cell's own number.
template <int corner, class T>
HYBMSS_INLINE std::ptrdiff_t corner_offset(const LatticeLayer<T>& layer) {
    return (corner & 1) + (corner >> 1 & 1) * layer.row + (corner >> 2) * layer.plane;
}

template <class V, class T>
HYBMSS_INLINE Vector3<V> load_displacement(const LatticeLayer<T>& layer, std::ptrdiff_t n) {
    return {load_lanes<V>(layer.displacement[0] + n), load_lanes<V>(layer.displacement[1] + n),
            load_lanes<V>(layer.displacement[2] + n)};
}

/// f + the force on nodes n, at displacement u, of the springs that they begin and of those that they end.
template <Accuracy accuracy, class Spring, class V>
HYBMSS_INLINE void gather_spring(const LatticeLayer<Scalar<V>>& layer, std::ptrdiff_t n, const Vector3<V>& u,
                                 Vector3<V>& f) {
    const std::ptrdiff_t to_a = corner_offset<Spring::a>(layer), to_b = corner_offset<Spring::b>(layer);
    const auto* stiffness = layer.stiffness[Spring::kKind] + n;
    const Vector3<V> begun = load_displacement<V>(layer, n + to_b - to_a) - u;
    const Vector3<V> ended = u - load_displacement<V>(layer, n + to_a - to_b);
    const V s[2] = {Spring::stretch(begun), Spring::stretch(ended)};
    V tension[2];
    one_minus_rsqrt<accuracy>(s, tension);
    f = multiply_add(load_lanes<V>(stiffness - to_a) * tension[0], Spring::vector(begun), f);
    f = subtract_product(load_lanes<V>(stiffness - to_b) * tension[1], Spring::vector(ended), f);
}

template <Accuracy accuracy, class V, class... Springs>
HYBMSS_INLINE void gather_springs(SpringGroup<Springs...>, const LatticeLayer<Scalar<V>>& layer, std::ptrdiff_t n,
                                  const Vector3<V>& u, Vector3<V>& f) {
    (gather_spring<accuracy, Springs>(layer, n, u, f), ...);
}

/// f + the force of the cells whose corner the nodes are: of their cube diagonals and their volume. The compiler drops
/// what diagonal_forces computes for the other corners alone.
template <Volume volume, Accuracy accuracy, int corner, class V>
HYBMSS_INLINE void gather_corner(const LatticeLayer<Scalar<V>>& layer, std::ptrdiff_t n, Vector3<V>& f) {
    const std::ptrdiff_t cell = n - corner_offset<corner>(layer);
    const Vector3<V> u[8] = {load_displacement<V>(layer, cell + corner_offset<0>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<1>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<2>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<3>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<4>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<5>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<6>(layer)),
                             load_displacement<V>(layer, cell + corner_offset<7>(layer))};
    V k[7];
    k[6] = load_lanes<V>(layer.stiffness[6] + cell); // cube diagonals and volume share it
    Vector3<V> forces[4];
    diagonal_forces<volume, accuracy>(u, k, layer.volume_ratio, forces);
    f = corner < 4 ? f + forces[corner & 3] : f - forces[(7 - corner) & 3];
}

/// Sets `partial` to the forces on a plane of nodes.
template <bool face_diagonals, Volume volume, Accuracy accuracy, class V>
void gather_plane(const LatticeLayer<Scalar<V>>& layer) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        const Vector3<V> u = load_displacement<V>(layer, n);
        Vector3<V> f{zero, zero, zero};
        gather_springs<accuracy>(EdgesAndFaces<face_diagonals>{}, layer, n, u, f);
        gather_corner<volume, accuracy, 0>(layer, n, f);
        gather_corner<volume, accuracy, 1>(layer, n, f);
        gather_corner<volume, accuracy, 2>(layer, n, f);
        gather_corner<volume, accuracy, 3>(layer, n, f);
        gather_corner<volume, accuracy, 4>(layer, n, f);
        gather_corner<volume, accuracy, 5>(layer, n, f);
        gather_corner<volume, accuracy, 6>(layer, n, f);
        gather_corner<volume, accuracy, 7>(layer, n, f);
        store_force(layer.partial, n, f);
    }
}

/// Integrates a plane of nodes by the forces in `partial`: after all planes have theirs, for neighbours read each
/// other's displacements.
template <bool driven, class V>
void integrate_plane(const LatticeLayer<Scalar<V>>& layer) {
    for (std::ptrdiff_t n = 0; n < layer.lanes; n += kWidth<V>) {
        integrate_nodes<driven>(layer.displacement, layer.velocity, layer.inverse_mass, layer.step, n,
                                load_force<V>(layer.partial, n));
    }
}

} // namespace
} // namespace hybmss::kernels
