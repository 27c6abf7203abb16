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

template <class V>
HYBMSS_INLINE void load_low_ends(const Scalar<V>* first, Vector3<V> (&low)[kTogether<V>]) {
    for (int v = 0; v < kTogether<V>; ++v) {
        low[v] = row_vector<V>(first + 4 * v * kWidth<V>);
    }
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
        for (int lane = 0; lane < kBlockItems; lane += kTogether<V> * kWidth<V>) {
            visit(lane, begin, next);
        }
    }
}

/// Adds the forces of `count` vectors of springs, computed side by side, of runs from the same low nodes: those on the
/// low ends to `sum`. A run has kTogether of them, the first at `lane`.
template <Accuracy accuracy, int count, class V>
HYBMSS_INLINE void add_run_forces(const SpringRun* runs, const SpringRuns<Scalar<V>>& springs,
                                  const PackedNodes<Scalar<V>>& nodes, int lane, const Vector3<V> (&low)[kTogether<V>],
                                  Vector3<V> (&sum)[kTogether<V>]) {
    const auto run_of = [&](int i) -> const SpringRun& { return runs[i / kTogether<V>]; };
    const auto lane_of = [&](int i) { return lane + i % kTogether<V> * kWidth<V>; };
    V s[count], tension[count];
    Vector3<V> d[count];
    for (int i = 0; i < count; ++i) {
        s[i] = run_stretch<V>(run_of(i), springs, lane_of(i), nodes.displacement, low[i % kTogether<V>], d[i]);
    }
    one_minus_rsqrt<accuracy>(s, tension);
    for (int i = 0; i < count; ++i) {
        const V k = load_lanes<V>(springs.stiffnesses[run_of(i).stiffness].lane + lane_of(i));
        const Vector3<V> force = scaled(k * tension[i], d[i]);
        sum[i % kTogether<V>] = sum[i % kTogether<V>] + force;
        V quads[4];
        vector_to_quads(force, quads);
        accumulate_row<false>(quads, nodes.force + run_of(i).high + 4 * lane_of(i));
    }
}

/// f_a += k (1 - l/|d|) d, f_b -= the same, d = r + u_b - u_a.
template <Accuracy accuracy, class V>
void run_springs(const SpringRuns<Scalar<V>>& springs, const PackedNodes<Scalar<V>>& nodes, std::ptrdiff_t begin,
                 std::ptrdiff_t end) {
    constexpr int kVectors = Traits<V>::kAvx512 ? 4 : 2; // as in packed_springs
    constexpr int kRuns = kVectors > kTogether<V> ? kVectors / kTogether<V> : 1;
    for_each_row<V>(springs.runs, begin, end, [&](int lane, std::ptrdiff_t i, std::ptrdiff_t last) {
        const std::ptrdiff_t row = springs.runs[i].low + 4 * lane;
        Vector3<V> low[kTogether<V>], sum[kTogether<V>];
        load_low_ends(nodes.displacement + row, low);
        for (Vector3<V>& of_vector : sum) {
            of_vector = {splat<V>(0), splat<V>(0), splat<V>(0)};
        }
        for (; i + kRuns <= last; i += kRuns) {
            add_run_forces<accuracy, kRuns * kTogether<V>, V>(springs.runs + i, springs, nodes, lane, low, sum);
        }
        for (; i < last; ++i) {
            add_run_forces<accuracy, kTogether<V>, V>(springs.runs + i, springs, nodes, lane, low, sum);
        }
        for (int v = 0; v < kTogether<V>; ++v) {
            V quads[4];
            vector_to_quads(sum[v], quads);
            accumulate_row<true>(quads, nodes.force + row + 4 * v * kWidth<V>);
        }
    });
}

/// Sum of 1/2 k (|d| - l)^2.
template <class V>
double run_spring_energy(const SpringRuns<Scalar<V>>& springs, const PackedNodes<Scalar<V>>& nodes,
                         std::ptrdiff_t begin, std::ptrdiff_t end) {
    double energy = 0;
    for_each_row<V>(springs.runs, begin, end, [&](int lane, std::ptrdiff_t i, std::ptrdiff_t last) {
        Vector3<V> low[kTogether<V>];
        load_low_ends(nodes.displacement + springs.runs[i].low + 4 * lane, low);
        for (; i < last; ++i) {
            const SpringRun& run = springs.runs[i];
            V stored[kTogether<V>];
            for (int v = 0; v < kTogether<V>; ++v) {
                const int at = lane + v * kWidth<V>;
                Vector3<V> d;
                const V s = run_stretch<V>(run, springs, at, nodes.displacement, low[v], d);
                const V k = load_lanes<V>(springs.stiffnesses[run.stiffness].lane + at);
                const V scale =
                    divide(splat<V>(Scalar<V>(0.5)) * k, load_lanes<V>(springs.shapes[run.shape].inverse_length2 + at));
                stored[v] = scale * squared_strain(s);
            }
            add_run(energy, stored);
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
        for (int lane = 0; lane < kBlockItems; lane += kTogether<V> * kWidth<V>) {
            V force[kTogether<V>][4][4];
            for (int v = 0; v < kTogether<V>; ++v) {
                const int at = lane + v * kWidth<V>;
                corner_forces<volume>(run_volume<V>(run, cells, at, nodes.displacement),
                                      load_lanes<V>(cells.kappas[run.weights].lane + at), force[v]);
            }
            // Corners 0 and 1 are often neighbours, and so on: what one writes must not be read at once by the other.
            for (const int corner : {0, 2, 1, 3}) {
                for (int v = 0; v < kTogether<V>; ++v) {
                    const int at = 4 * (lane + v * kWidth<V>);
                    accumulate_row<true>(force[v][corner], nodes.force + run.node[corner] + at);
                }
                for (int v = 0; v < kTogether<V>; ++v) {
                    const int at = 4 * (lane + v * kWidth<V>);
                    accumulate_row<false>(force[v][3 - corner], nodes.force + run.node[4 + corner] + at);
                }
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
        for (int lane = 0; lane < kBlockItems; lane += kTogether<V> * kWidth<V>) {
            V stored[kTogether<V>];
            for (int v = 0; v < kTogether<V>; ++v) {
                const int at = lane + v * kWidth<V>;
                const V dilation = run_volume<V>(run, cells, at, nodes.displacement).dilation;
                const V scale = divide(load_lanes<V>(cells.kappas[run.weights].lane + at),
                                       load_lanes<V>(cells.shapes[run.shape].inverse_volume + at));
                stored[v] = scale * volume_energy<volume>(dilation);
            }
            add_run(energy, stored);
        }
    }
    return energy;
}

} // namespace

HYBMSS_DEFINE_ORDERED_KERNEL(run_springs);
HYBMSS_DEFINE_ORDERED_KERNEL(run_cells);
HYBMSS_DEFINE_ORDERED_KERNEL(run_spring_energy);
HYBMSS_DEFINE_ORDERED_KERNEL(run_cell_energy);

} // namespace hybmss::kernels
