// Compiled once for each instruction set: runs of a packed network, sixteen springs or cells whose nodes lie in rows
// (layouts/network/item_runs.hpp). Rows are loaded and stored as whole vectors; what comes out of the transposition is
// not in the order of the nodes, and the values of a run are stored in that same order.
#include "kernels/compiled_set.hpp"
#include "kernels/network/packed.hpp"

namespace hybmss::kernels {
namespace {

template <class V>
HYBMSS_INLINE Vector3<V> row_vector(const Scalar<V>* first) {
    V q[4];
    load_row(first, q);
    transpose_quads(q);
    return {q[0], q[1], q[2]};
}

/// s = |d|^2 / l^2 - 1 and d of the springs at `lane` of a run; `low` is the displacement of their low ends.
template <class V>
HYBMSS_INLINE V run_stretch(const SpringRun& run, const SpringRuns<Scalar<V>>& springs, int lane, const Scalar<V>* u,
                            const Vector3<V>& low, Vector3<V>& d) {
    const SpringRunShape<Scalar<V>>& shape = springs.shapes[run.shape];
    const Vector3<V> rest = {load_lanes<V>(shape.rest[0] + lane), load_lanes<V>(shape.rest[1] + lane),
                             load_lanes<V>(shape.rest[2] + lane)};
    const Vector3<V> du = row_vector<V>(u + run.high + 4 * lane) - low;
    d = rest + du;
    return load_lanes<V>(shape.inverse_length2 + lane) * multiply_add(splat<V>(2), dot(rest, du), dot(du, du));
}

/// Calls visit(lane, begin, end) for all parts of runs [begin, end) from the same sixteen low nodes.
template <class V, class Visit>
HYBMSS_INLINE void for_each_row(const SpringRun* runs, std::ptrdiff_t begin, std::ptrdiff_t end, const Visit& visit) {
    for (std::ptrdiff_t next = begin; begin < end; begin = next) {
        while (next < end && runs[next].low == runs[begin].low) {
            ++next;
        }
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            visit(lane, begin, next);
        }
    }
}

/// Adds the forces of `count` runs from the same low nodes, computed side by side: those on the low ends to `sum`.
template <Accuracy accuracy, int count, class V>
HYBMSS_INLINE void add_run_forces(const SpringRun* runs, const SpringRuns<Scalar<V>>& springs,
                                  const PackedNodes<Scalar<V>>& nodes, int lane, const Vector3<V>& low,
                                  Vector3<V>& sum) {
    V s[count], tension[count];
    Vector3<V> d[count];
    for (int i = 0; i < count; ++i) {
        s[i] = run_stretch<V>(runs[i], springs, lane, nodes.displacement, low, d[i]);
    }
    one_minus_rsqrt<accuracy>(s, tension);
    for (int i = 0; i < count; ++i) {
        const V k = load_lanes<V>(springs.stiffnesses[runs[i].stiffness].lane + lane);
        const Vector3<V> force = scaled(k * tension[i], d[i]);
        sum = sum + force;
        V quads[4];
        vector_to_quads(force, quads);
        accumulate_row<false>(quads, nodes.force + runs[i].high + 4 * lane);
    }
}

/// f_a += k (1 - l/|d|) d, f_b -= the same, d = r + u_b - u_a.
template <Accuracy accuracy, class V>
void run_springs(const SpringRuns<Scalar<V>>& springs, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                 std::ptrdiff_t end) {
    constexpr int kCount = Traits<V>::kAvx512 ? 4 : 2; // as in packed_springs
    for_each_row<V>(springs.runs, begin, end, [&](int lane, std::ptrdiff_t i, std::ptrdiff_t last) {
        const std::ptrdiff_t row = springs.runs[i].low + 4 * lane;
        const Vector3<V> low = row_vector<V>(nodes.displacement + row);
        Vector3<V> sum = {splat<V>(0), splat<V>(0), splat<V>(0)};
        for (; i + kCount <= last; i += kCount) {
            add_run_forces<accuracy, kCount, V>(springs.runs + i, springs, nodes, lane, low, sum);
        }
        for (; i < last; ++i) {
            add_run_forces<accuracy, 1, V>(springs.runs + i, springs, nodes, lane, low, sum);
        }
        V quads[4];
        vector_to_quads(sum, quads);
        accumulate_row<true>(quads, nodes.force + row);
    });
}

/// Sum of 1/2 k (|d| - l)^2.
template <class V>
double run_spring_energy(const SpringRuns<Scalar<V>>& springs, const PackedNodes<Scalar<V>>& nodes,
                         std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for_each_row<V>(springs.runs, begin, end, [&](int lane, std::ptrdiff_t i, std::ptrdiff_t last) {
        const Vector3<V> low = row_vector<V>(nodes.displacement + springs.runs[i].low + 4 * lane);
        for (; i < last; ++i) {
            const SpringRun& run = springs.runs[i];
            Vector3<V> d;
            const V s = run_stretch<V>(run, springs, lane, nodes.displacement, low, d);
            const V scale = splat<V>(Scalar<V>(0.5)) * load_lanes<V>(springs.stiffnesses[run.stiffness].lane + lane) /
                            load_lanes<V>(springs.shapes[run.shape].inverse_length2 + lane);
            energy += sum_in_double(scale * squared_strain(s));
        }
    });
    return energy;
}

template <class V>
HYBMSS_INLINE BlockVolume<V> run_volume(const CellRun& run, const CellRuns<Scalar<V>>& cells, int lane,
                                        const Scalar<V>* u) {
    V diagonal[4][4];
    for (int corner = 0; corner < 4; ++corner) {
        V low[4];
        load_row(u + run.node[corner] + 4 * lane, low);
        load_row(u + run.node[7 - corner] + 4 * lane, diagonal[corner]);
        for (int j = 0; j < 4; ++j) {
            diagonal[corner][j] = diagonal[corner][j] - low[j];
        }
    }
    Vector3<V> change[3];
    mean_edges(diagonal, change);
    return deformed_volume(cells.shapes[run.shape], lane, change);
}

/// f_i -= kappa phi'(J) dV'/dx_i, dV'/dx_i = 1/4 (+-(b x c) +- (c x a) +- (a x b)).
template <Volume volume, class V>
void run_cells(const CellRuns<Scalar<V>>& cells, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
               std::ptrdiff_t end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const CellRun& run = cells.runs[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            V force[4][4];
            corner_forces<volume>(run_volume<V>(run, cells, lane, nodes.displacement),
                                  load_lanes<V>(cells.kappas[run.weights].lane + lane), force);
            // Corners 0 and 1 are often neighbours, and so on: what one writes must not be read at once by the other.
            for (const int corner : {0, 2}) {
                accumulate_row<true>(force[corner], nodes.force + run.node[corner] + 4 * lane);
                accumulate_row<false>(force[3 - corner], nodes.force + run.node[4 + corner] + 4 * lane);
            }
            for (const int corner : {1, 3}) {
                accumulate_row<true>(force[corner], nodes.force + run.node[corner] + 4 * lane);
                accumulate_row<false>(force[3 - corner], nodes.force + run.node[4 + corner] + 4 * lane);
            }
        }
    }
}

/// Sum of kappa V0 phi(J).
template <Volume volume, class V>
double run_cell_energy(const CellRuns<Scalar<V>>& cells, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                       std::ptrdiff_t end) {
    double energy = 0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
        const CellRun& run = cells.runs[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const V dilation = run_volume<V>(run, cells, lane, nodes.displacement).dilation;
            const V scale = load_lanes<V>(cells.kappas[run.weights].lane + lane) /
                            load_lanes<V>(cells.shapes[run.shape].inverse_volume + lane);
            energy += sum_in_double(scale * volume_energy<volume>(dilation));
        }
    }
    return energy;
}

} // namespace

HYBMSS_DEFINE_KERNEL(run_springs);
HYBMSS_DEFINE_KERNEL(run_cells);
HYBMSS_DEFINE_KERNEL(run_spring_energy);
HYBMSS_DEFINE_KERNEL(run_cell_energy);

} // namespace hybmss::kernels
