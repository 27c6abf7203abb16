#pragma once

#include "kernels/lattice/lattice_cell.hpp"
#include "kernels/lattice/lattice_layer_impl.hpp"

namespace hybmss::kernels {
namespace {

template <class V, class T>
HYBMSS_INLINE Vector3<V> gather_vector(T* const (&field)[3], const std::int32_t* index) {
    return {gather_lanes<V>(field[0], index), gather_lanes<V>(field[1], index), gather_lanes<V>(field[2], index)};
}
template <class V, class T>
HYBMSS_INLINE void scatter_vector(const Vector3<V>& v, T* const (&field)[3], const std::int32_t* index) {
    scatter_lanes(v.x, field[0], index);
    scatter_lanes(v.y, field[1], index);
    scatter_lanes(v.z, field[2], index);
}

/// du, and s = |d|^2 / l^2 - 1 = (2 r.du + du.du) / l^2, of the springs at i ... i + width.
template <class V, class T, class Field>
HYBMSS_INLINE V spring_stretch(const NetworkSprings<T>& springs, const Field& displacement, std::ptrdiff_t i,
                               Vector3<V>& rest, Vector3<V>& du) {
    rest = {load_lanes<V>(springs.rest[0] + i), load_lanes<V>(springs.rest[1] + i), load_lanes<V>(springs.rest[2] + i)};
    du = gather_vector<V>(displacement, springs.b + i) - gather_vector<V>(displacement, springs.a + i);
    return load_lanes<V>(springs.inverse_length2 + i) * multiply_add(splat<V>(2), dot(rest, du), dot(du, du));
}

/// f_a += k (1 - l/|d|) d, f_b -= the same, d = r + u_b - u_a, for the springs of [begin, end), one colour.
template <Accuracy accuracy, class V>
void network_springs(const NetworkSprings<Scalar<V>>& springs, const NodeArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
                     std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const V tension = load_lanes<V>(springs.stiffness + i) * one_minus_rsqrt<accuracy>(s);
        const Vector3<V> d = rest + du;
        const std::int32_t *a = springs.a + i, *b = springs.b + i;
        scatter_vector(multiply_add(tension, d, gather_vector<V>(nodes.force, a)), nodes.force, a);
        scatter_vector(subtract_product(tension, d, gather_vector<V>(nodes.force, b)), nodes.force, b);
    }
}

/// The deformed mean edges of a cell, the cofactors b x c, c x a, a x b, and J - 1.
template <class V>
struct HexahedronVolume {
    Vector3<V> a, b, c, bc, ca, ab;
    V dilation;
};

/// The mean edges of a field at the corners of cells: how a, b and c change with it.
template <class V, class T, class Field>
HYBMSS_INLINE void mean_edges(const NetworkCells<T>& cells, const Field& field, std::ptrdiff_t i,
                              Vector3<V> (&edges)[3]) {
    // Sums over the corners by the three bits of their number: the mean of four edges is a quarter of a signed sum.
    Vector3<V> u[8];
    for (int corner = 0; corner < 8; ++corner) {
        u[corner] = gather_vector<V>(field, cells.node[corner] + i);
    }
    const Vector3<V> d0 = u[7] - u[0], d1 = u[6] - u[1], d2 = u[5] - u[2], d3 = u[4] - u[3];
    const Vector3<V> sum01 = d0 + d1, sum23 = d2 + d3;
    const V quarter = splat<V>(T(0.25));
    edges[0] = scaled(quarter, (d0 - d1) + (d2 - d3));
    edges[1] = scaled(quarter, sum01 - sum23);
    edges[2] = scaled(quarter, sum01 + sum23);
}

template <class V, class T, class Field>
HYBMSS_INLINE HexahedronVolume<V> hexahedron_volume(const NetworkCells<T>& cells, const Field& displacement,
                                                    std::ptrdiff_t i) {
    Vector3<V> change[3];
    mean_edges(cells, displacement, i, change);
    const Vector3<V>&da = change[0], &db = change[1], &dc = change[2];
    const auto rest = [&](int edge) {
        return Vector3<V>{load_lanes<V>(cells.rest_edge[3 * edge] + i),
                          load_lanes<V>(cells.rest_edge[3 * edge + 1] + i),
                          load_lanes<V>(cells.rest_edge[3 * edge + 2] + i)};
    };
    const Vector3<V> a0 = rest(0), b0 = rest(1), c0 = rest(2);
    const Vector3<V> a = a0 + da, b = b0 + db, c = c0 + dc;
    HexahedronVolume<V> cell{a, b, c, cross(b, c), cross(c, a), cross(a, b), {}};
    // V' - V0 = da.(b x c) + a0.(db x c) + a0.(b0 x dc), each term of the first order in the displacement.
    cell.dilation =
        (dot(da, cell.bc) + dot(a0, cross(db, c) + cross(b0, dc))) * load_lanes<V>(cells.inverse_volume + i);
    return cell;
}

/// f_i -= kappa phi'(J) dV'/dx_i, dV'/dx_i = 1/4 (+-(b x c) +- (c x a) +- (a x b)), for the cells of one colour.
template <Volume volume, class V>
void network_cells(const NetworkCells<Scalar<V>>& cells, const NodeArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
                   std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        const HexahedronVolume<V> cell = hexahedron_volume<V>(cells, nodes.displacement, i);
        const V pressure = load_lanes<V>(cells.kappa + i) * splat<V>(T(0.25)) * volume_slope<volume>(cell.dilation);
        const Vector3<V> plus = cell.bc + cell.ca, minus = cell.bc - cell.ca;
        // Gradients of the corners 7, 6, 5, 4; those of 0, 1, 2, 3 are opposite.
        const Vector3<V> gradient[4] = {plus + cell.ab, cell.ab - minus, minus + cell.ab, cell.ab - plus};
        for (int corner = 0; corner < 4; ++corner) {
            const std::int32_t *low = cells.node[corner] + i, *high = cells.node[7 - corner] + i;
            scatter_vector(multiply_add(pressure, gradient[corner], gather_vector<V>(nodes.force, low)), nodes.force,
                           low);
            scatter_vector(subtract_product(pressure, gradient[corner], gather_vector<V>(nodes.force, high)),
                           nodes.force, high);
        }
    }
}

/// Sum of 1/2 k (|d| - l)^2 over [begin, end).
template <class V>
double network_spring_energy(const NetworkSprings<Scalar<V>>& springs, const NodeArrays<Scalar<V>>& nodes,
                             std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const V k =
            divide(splat<V>(T(0.5)) * load_lanes<V>(springs.stiffness + i), load_lanes<V>(springs.inverse_length2 + i));
        energy += sum_in_double(k * squared_strain(s));
    }
    return energy;
}

/// Sum of kappa V0 phi(J) over [begin, end).
template <Volume volume, class V>
double network_cell_energy(const NetworkCells<Scalar<V>>& cells, const NodeArrays<Scalar<V>>& nodes,
                           std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        const V dilation = hexahedron_volume<V>(cells, nodes.displacement, i).dilation;
        const V scale = divide(load_lanes<V>(cells.kappa + i), load_lanes<V>(cells.inverse_volume + i));
        energy += sum_in_double(scale * volume_energy<volume>(dilation));
    }
    return energy;
}

/// Integrates the nodes of [begin, end), multiples of the width, and zeroes their forces for the next step.
template <bool driven, class V>
void network_integrate(const NodeArrays<Scalar<V>>& nodes, const StepConstants<Scalar<V>>& step, std::ptrdiff_t begin,
                       std::ptrdiff_t end) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = begin; n < end; n += kWidth<V>) {
        integrate_nodes<driven>(nodes.displacement, nodes.velocity, nodes.inverse_mass, step, n,
                                load_force<V>(nodes.force, n));
        store_force<V>(nodes.force, n, {zero, zero, zero});
    }
}

} // namespace
} // namespace hybmss::kernels
