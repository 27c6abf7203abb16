// Compiled once for each instruction set.
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_sweep.hpp"
#include "kernels/network/soa.hpp"

namespace hybmss::kernels {
namespace {

/// f_a += k (1 - l/|d|) d, f_b -= the same, d = r + u_b - u_a, for the springs of [begin, end), one colour.
template <Accuracy accuracy, class V>
void soa_springs(const NetworkSprings<Scalar<V>>& springs, const NodeArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
                 std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; i += kTogether<V> * kWidth<V>) {
        V tension[kTogether<V>];
        Vector3<V> d[kTogether<V>];
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            Vector3<V> rest, du;
            const V s = spring_stretch<V>(springs, nodes.displacement, at, rest, du);
            tension[v] = load_lanes<V>(springs.stiffness + at) * one_minus_rsqrt<accuracy>(s);
            d[v] = rest + du;
        });
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            const NodeLanes a = node_lanes(springs.a, springs.in_row, at);
            scatter_vector(multiply_add(tension[v], d[v], gather_vector<V>(nodes.force, a)), nodes.force, a);
        });
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            const NodeLanes b = node_lanes(springs.b, springs.in_row, at);
            scatter_vector(subtract_product(tension[v], d[v], gather_vector<V>(nodes.force, b)), nodes.force, b);
        });
    }
}

/// f_i -= kappa phi'(J) dV'/dx_i, dV'/dx_i = 1/4 (+-(b x c) +- (c x a) +- (a x b)), for the cells of one colour.
template <Volume volume, class V>
void soa_cells(const NetworkCells<Scalar<V>>& cells, const NodeArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
               std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; i += kTogether<V> * kWidth<V>) {
        V pressure[kTogether<V>];
        Vector3<V> gradient[kTogether<V>][4];
        for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
            const HexahedronVolume<V> cell = hexahedron_volume<V>(cells, nodes.displacement, at);
            pressure[v] = load_lanes<V>(cells.kappa + at) * splat<V>(T(0.25)) * volume_slope<volume>(cell.dilation);
            const Vector3<V> plus = cell.bc + cell.ca, minus = cell.bc - cell.ca;
            // Gradients of the corners 7, 6, 5, 4; those of 0, 1, 2, 3 are opposite.
            gradient[v][0] = plus + cell.ab;
            gradient[v][1] = cell.ab - minus;
            gradient[v][2] = minus + cell.ab;
            gradient[v][3] = cell.ab - plus;
        });
        for (int corner = 0; corner < 4; ++corner) {
            for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
                const NodeLanes low = node_lanes(cells.node[corner], cells.in_row, at);
                scatter_vector(multiply_add(pressure[v], gradient[v][corner], gather_vector<V>(nodes.force, low)),
                               nodes.force, low);
            });
            for_together<V>(i, [&](int v, std::ptrdiff_t at) HYBMSS_INLINE_BODY {
                const NodeLanes high = node_lanes(cells.node[7 - corner], cells.in_row, at);
                scatter_vector(subtract_product(pressure[v], gradient[v][corner], gather_vector<V>(nodes.force, high)),
                               nodes.force, high);
            });
        }
    }
}

/// Sum of 1/2 k (|d| - l)^2 over [begin, end).
template <class V>
double soa_spring_energy(const NetworkSprings<Scalar<V>>& springs, const NodeArrays<Scalar<V>>& nodes,
                         std::ptrdiff_t begin, std::ptrdiff_t end) {
    using T = Scalar<V>;
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const V k =
            divide(splat<V>(T(0.5)) * load_lanes<V>(springs.stiffness + i), load_lanes<V>(springs.inverse_length2 + i));
        add_in_double(energy, k * squared_strain(s));
    }
    return energy;
}

/// Sum of kappa V0 phi(J) over [begin, end).
template <Volume volume, class V>
double soa_cell_energy(const NetworkCells<Scalar<V>>& cells, const NodeArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
                       std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        const V dilation = hexahedron_volume<V>(cells, nodes.displacement, i).dilation;
        const V scale = divide(load_lanes<V>(cells.kappa + i), load_lanes<V>(cells.inverse_volume + i));
        add_in_double(energy, scale * volume_energy<volume>(dilation));
    }
    return energy;
}

/// Integrates the nodes of [begin, end), multiples of the width, and zeroes their forces for the next step.
template <bool driven, class V>
void soa_integrate(const NodeArrays<Scalar<V>>& nodes, const StepConstants<Scalar<V>>& step, std::ptrdiff_t begin,
                   std::ptrdiff_t end) {
    const V zero = splat<V>(0);
    for (std::ptrdiff_t n = begin; n < end; n += kWidth<V>) {
        integrate_nodes<driven>(nodes.displacement, nodes.velocity, nodes.inverse_mass, step, n,
                                load_force<V>(nodes.force, n));
        store_force<V>(nodes.force, n, {zero, zero, zero});
    }
}

} // namespace

HYBMSS_DEFINE_ORDERED_KERNEL(soa_springs);
HYBMSS_DEFINE_ORDERED_KERNEL(soa_cells);
HYBMSS_DEFINE_ORDERED_KERNEL(soa_spring_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(soa_cell_energy);
HYBMSS_DEFINE_KERNEL(soa_integrate);

} // namespace hybmss::kernels
