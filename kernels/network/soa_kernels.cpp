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
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        Vector3<V> rest, du;
        const V s = spring_stretch<V>(springs, nodes.displacement, i, rest, du);
        const V tension = load_lanes<V>(springs.stiffness + i) * one_minus_rsqrt<accuracy>(s);
        const Vector3<V> d = rest + du;
        const NodeLanes a = node_lanes(springs.a, springs.in_row, i), b = node_lanes(springs.b, springs.in_row, i);
        scatter_vector(multiply_add(tension, d, gather_vector<V>(nodes.force, a)), nodes.force, a);
        scatter_vector(subtract_product(tension, d, gather_vector<V>(nodes.force, b)), nodes.force, b);
    }
}

/// f_i -= kappa phi'(J) dV'/dx_i, dV'/dx_i = 1/4 (+-(b x c) +- (c x a) +- (a x b)), for the cells of one colour.
template <Volume volume, class V>
void soa_cells(const NetworkCells<Scalar<V>>& cells, const NodeArrays<Scalar<V>>& nodes, std::ptrdiff_t begin,
               std::ptrdiff_t end) {
    using T = Scalar<V>;
    for (std::ptrdiff_t i = begin; i < end; i += kWidth<V>) {
        const HexahedronVolume<V> cell = hexahedron_volume<V>(cells, nodes.displacement, i);
        const V pressure = load_lanes<V>(cells.kappa + i) * splat<V>(T(0.25)) * volume_slope<volume>(cell.dilation);
        const Vector3<V> plus = cell.bc + cell.ca, minus = cell.bc - cell.ca;
        // Gradients of the corners 7, 6, 5, 4; those of 0, 1, 2, 3 are opposite.
        const Vector3<V> gradient[4] = {plus + cell.ab, cell.ab - minus, minus + cell.ab, cell.ab - plus};
        for (int corner = 0; corner < 4; ++corner) {
            const NodeLanes low = node_lanes(cells.node[corner], cells.in_row, i),
                            high = node_lanes(cells.node[7 - corner], cells.in_row, i);
            scatter_vector(multiply_add(pressure, gradient[corner], gather_vector<V>(nodes.force, low)), nodes.force,
                           low);
            scatter_vector(subtract_product(pressure, gradient[corner], gather_vector<V>(nodes.force, high)),
                           nodes.force, high);
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
        energy += sum_in_double(k * squared_strain(s));
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
        energy += sum_in_double(scale * volume_energy<volume>(dilation));
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

HYBMSS_DEFINE_KERNEL(soa_springs);
HYBMSS_DEFINE_KERNEL(soa_cells);
HYBMSS_DEFINE_KERNEL(soa_spring_energy);
HYBMSS_DEFINE_KERNEL(soa_cell_energy);
HYBMSS_DEFINE_KERNEL(soa_integrate);

} // namespace hybmss::kernels
