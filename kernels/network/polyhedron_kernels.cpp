// Compiled once for each instruction set: volumes of a network's tetrahedra, pyramids and prisms, in either of its
// layouts; of their own, or as parts of volumes of nodes.
#include "kernels/compiled_set.hpp"
#include "kernels/network/packed.hpp"
#include "kernels/network/soa.hpp"

namespace hybmss::kernels {
namespace {

/// Three vectors a, b, c, or five (PolyhedronVectors in layouts/network/network_geometry.hpp).
template <int nodes, class V>
struct Vectors {
    static constexpr int kCount = nodes == 6 ? 5 : 3;
    Vector3<V> v[kCount];
};

template <class V, class T>
HYBMSS_INLINE V constant(T value) {
    return splat<V>(static_cast<Scalar<V>>(value));
}

/// The corners' values less that of node 0, which keeps digits of a body far from its rest position. Functions of their
/// own, as are the other accesses to nodes: what is made for every variant is its arithmetic alone.
template <int nodes, class V>
[[gnu::noinline]] void load_nodes(const PolyhedronBlock<Scalar<V>>& block, int lane, const Scalar<V>* const (&field)[3],
                                  Vector3<V> (&corner)[nodes]) {
    if (field[1]) {
        const Vector3<V> low = gather_vector<V>(field, block.node[0] + lane);
        for (int c = 1; c < nodes; ++c) {
            corner[c] = gather_vector<V>(field, block.node[c] + lane) - low;
        }
    } else {
        V low[4];
        load_quads(field[0], block.node[0] + lane, low);
        for (int c = 1; c < nodes; ++c) {
            V q[4];
            load_quads(field[0], block.node[c] + lane, q);
            for (int j = 0; j < 4; ++j) {
                q[j] = q[j] - low[j];
            }
            transpose_quads(q);
            corner[c] = {q[0], q[1], q[2]};
        }
    }
}

/// Adds a vector to each corner. No node occurs twice in a block.
template <int nodes, class V>
[[gnu::noinline]] void add_to_nodes(const PolyhedronBlock<Scalar<V>>& block, int lane,
                                    const Vector3<V> (&corner)[nodes], Scalar<V>* const (&sum)[3]) {
    for (int c = 0; c < nodes; ++c) {
        const std::int32_t* const node = block.node[c] + lane;
        if (sum[1]) {
            scatter_vector(gather_vector<V>(sum, node) + corner[c], sum, node);
        } else {
            V q[4];
            vector_to_quads(corner[c], q);
            accumulate_quads<true>(q, sum[0], node);
        }
    }
}

template <int nodes, class V>
[[gnu::noinline]] void add_at_nodes(const PolyhedronBlock<Scalar<V>>& block, int lane, V value, Scalar<V>* sum) {
    for (int c = 0; c < nodes; ++c) {
        scatter_lanes(gather_lanes<V>(sum, block.node[c] + lane) + value, sum, block.node[c] + lane);
    }
}

template <int nodes, class V>
[[gnu::noinline]] V mean_of_nodes(const PolyhedronBlock<Scalar<V>>& block, int lane, const Scalar<V>* field) {
    V sum = gather_lanes<V>(field, block.node[0] + lane);
    for (int c = 1; c < nodes; ++c) {
        sum = sum + gather_lanes<V>(field, block.node[c] + lane);
    }
    return constant<V>(1.0 / nodes) * sum;
}

/// The vectors of corners less node 0.
template <int nodes, class V>
HYBMSS_INLINE Vectors<nodes, V> vectors_of(const Vector3<V> (&p)[nodes]) {
    if constexpr (nodes == 4) {
        return {{p[1], p[2], p[3]}};
    } else if constexpr (nodes == 5) {
        return {{subtract_product(constant<V>(0.25), p[1] + p[2] + p[3], p[4]), p[2], p[3] - p[1]}};
    } else {
        const Vector3<V> high1 = p[4] - p[3], high2 = p[5] - p[3];
        const V half = constant<V>(0.5), third = constant<V>(1.0 / 3);
        return {{scaled(third, p[3] + (p[4] - p[1]) + (p[5] - p[2])), scaled(half, p[1] + high1),
                 scaled(half, p[2] + high2), high1 - p[1], high2 - p[2]}};
    }
}

/// What a gradient by the vectors is by the nodes' places.
template <int nodes, class V>
HYBMSS_INLINE void spread(const Vectors<nodes, V>& by, Vector3<V> (&corner)[nodes]) {
    const V zero = splat<V>(0);
    const Vector3<V> none = {zero, zero, zero};
    const auto& g = by.v;
    if constexpr (nodes == 4) {
        corner[0] = none - (g[0] + g[1] + g[2]);
        corner[1] = g[0];
        corner[2] = g[1];
        corner[3] = g[2];
    } else if constexpr (nodes == 5) {
        const Vector3<V> base = scaled(constant<V>(-0.25), g[0]);
        corner[0] = base - g[1];
        corner[1] = base - g[2];
        corner[2] = base + g[1];
        corner[3] = base + g[2];
        corner[4] = g[0];
    } else {
        const Vector3<V> along = scaled(constant<V>(1.0 / 3), g[0]);
        const Vector3<V> b = scaled(constant<V>(0.5), g[1]), c = scaled(constant<V>(0.5), g[2]);
        const Vector3<V> low1 = b - g[3], low2 = c - g[4], high1 = b + g[3], high2 = c + g[4];
        corner[0] = none - (along + low1 + low2);
        corner[1] = low1 - along;
        corner[2] = low2 - along;
        corner[3] = along - (high1 + high2);
        corner[4] = along + high1;
        corner[5] = along + high2;
    }
}

/// V by a . (b x c ...).
template <int nodes>
constexpr double kFactor = nodes == 6 ? 1.0 / 2 : 1.0 / 6;

/// The deformed vectors of polyhedra, and V' - V0.
template <int nodes, class V>
struct Deformed {
    Vectors<nodes, V> at;
    V change;
};
template <int nodes, class V>
HYBMSS_INLINE Deformed<nodes, V> deformed(const PolyhedronBlock<Scalar<V>>& block, int lane,
                                          const Scalar<V>* const (&displacement)[3]) {
    Vector3<V> corner[nodes];
    load_nodes<nodes>(block, lane, displacement, corner);
    const Vectors<nodes, V> d = vectors_of(corner);
    Vectors<nodes, V> rest;
    Deformed<nodes, V> made;
    for (int i = 0; i < Vectors<nodes, V>::kCount; ++i) {
        rest.v[i] = {load_lanes<V>(block.rest[3 * i] + lane), load_lanes<V>(block.rest[3 * i + 1] + lane),
                     load_lanes<V>(block.rest[3 * i + 2] + lane)};
        made.at.v[i] = rest.v[i] + d.v[i];
    }
    // da . (b x c) + a0 . (db x c + b0 x dc), each term of the first order in the displacement; likewise d and e.
    const auto& v = made.at.v;
    Vector3<V> area = cross(v[1], v[2]), area_change = add_cross(rest.v[1], d.v[2], cross(d.v[1], v[2]));
    if constexpr (nodes == 6) {
        const V twelfth = constant<V>(1.0 / 12);
        area = multiply_add(twelfth, cross(v[3], v[4]), area);
        area_change = multiply_add(twelfth, add_cross(rest.v[3], d.v[4], cross(d.v[3], v[4])), area_change);
    }
    made.change = constant<V>(kFactor<nodes>) * (dot(d.v[0], area) + dot(rest.v[0], area_change));
    return made;
}

/// The derivatives of V' by the vectors, times `scale`.
template <int nodes, class V>
HYBMSS_INLINE Vectors<nodes, V> gradient(const Vectors<nodes, V>& by, V scale) {
    const auto& v = by.v;
    const V s = constant<V>(kFactor<nodes>) * scale;
    const Vector3<V> a = scaled(s, v[0]);
    Vectors<nodes, V> made;
    made.v[0] = scaled(s, cross(v[1], v[2]));
    made.v[1] = cross(v[2], a);
    made.v[2] = cross(a, v[1]);
    if constexpr (nodes == 6) {
        const V twelfth = constant<V>(1.0 / 12);
        made.v[0] = multiply_add(twelfth * s, cross(v[3], v[4]), made.v[0]);
        made.v[3] = scaled(twelfth, cross(v[4], a));
        made.v[4] = scaled(twelfth, cross(a, v[3]));
    }
    return made;
}

/// f_i -= p dV'/dx_i, p = kappa phi'(J), or the mean of the nodes' pressures.
template <int nodes, Pressure pressure, class V>
void polyhedra(const PolyhedronBlock<Scalar<V>>* blocks, const NodalVolumeArrays<Scalar<V>>& nodal,
               const HessianArrays<Scalar<V>>& fields, Range begin, Range end) {
    for (Range i = begin; i < end; ++i) {
        const auto& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const Deformed<nodes, V> cell = deformed<nodes, V>(block, lane, fields.displacement);
            V p;
            if constexpr (pressure == Pressure::of_nodes) {
                p = mean_of_nodes<nodes, V>(block, lane, nodal.pressure);
            } else {
                constexpr Volume kVolume = pressure == Pressure::quadratic ? Volume::quadratic : Volume::mean_stretch;
                p = load_lanes<V>(block.kappa + lane) *
                    volume_slope<kVolume>(cell.change * load_lanes<V>(block.inverse_volume + lane));
            }
            Vector3<V> force[nodes];
            spread(gradient(cell.at, splat<V>(0) - p), force);
            add_to_nodes<nodes>(block, lane, force, fields.product);
        }
    }
}

/// Sum of kappa V0 phi(J).
template <int nodes, Volume volume, class V>
double polyhedron_energy(const PolyhedronBlock<Scalar<V>>* blocks, const HessianArrays<Scalar<V>>& fields, Range begin,
                         Range end) {
    double energy = 0;
    for (Range i = begin; i < end; ++i) {
        const auto& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const V inverse = load_lanes<V>(block.inverse_volume + lane);
            const V j = deformed<nodes, V>(block, lane, fields.displacement).change * inverse;
            add_in_double(energy, divide(load_lanes<V>(block.kappa + lane), inverse) * volume_energy<volume>(j));
        }
    }
    return energy;
}

/// Adds kappa phi''/V0 (grad V' . q) grad V' + p (hess V') q for the direction q; of nodes, the mean of their changes
/// of pressure in place of the first scale.
template <int nodes, Pressure pressure, class V>
void polyhedron_product(const PolyhedronBlock<Scalar<V>>* blocks, const NodalVolumeArrays<Scalar<V>>& nodal,
                        const HessianArrays<Scalar<V>>& fields, Range begin, Range end) {
    constexpr int kCount = Vectors<nodes, V>::kCount;
    for (Range i = begin; i < end; ++i) {
        const auto& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const Deformed<nodes, V> cell = deformed<nodes, V>(block, lane, fields.displacement);
            Vector3<V> corner[nodes];
            load_nodes<nodes>(block, lane, fields.direction, corner);
            const Vectors<nodes, V> q = vectors_of(corner);
            Vectors<nodes, V> sum = gradient(cell.at, splat<V>(1));
            V along, p;
            if constexpr (pressure == Pressure::of_nodes) {
                p = mean_of_nodes<nodes, V>(block, lane, nodal.pressure);
                along = mean_of_nodes<nodes, V>(block, lane, nodal.pressure_change);
            } else {
                constexpr Volume kVolume = pressure == Pressure::quadratic ? Volume::quadratic : Volume::mean_stretch;
                const V kappa = load_lanes<V>(block.kappa + lane), inverse = load_lanes<V>(block.inverse_volume + lane);
                const VolumeDerivatives<V> phi = volume_derivatives<kVolume>(cell.change * inverse);
                p = kappa * phi.slope;
                along = dot(sum.v[0], q.v[0]);
                for (int e = 1; e < kCount; ++e) {
                    along = along + dot(sum.v[e], q.v[e]);
                }
                along = along * (kappa * phi.curvature * inverse);
            }
            p = p * splat<V>(fields.stiffening.geometric);
            // d(b x c) = qb x c + b x qc, and so on.
            const auto& v = cell.at.v;
            const V s = constant<V>(kFactor<nodes>) * p;
            const Vector3<V> a = scaled(s, v[0]), qa = scaled(s, q.v[0]);
            Vector3<V> area = add_cross(v[1], q.v[2], cross(q.v[1], v[2]));
            const V twelfth = constant<V>(1.0 / 12);
            if constexpr (nodes == 6) {
                area = multiply_add(twelfth, add_cross(v[3], q.v[4], cross(q.v[3], v[4])), area);
                sum.v[3] = multiply_add(twelfth, add_cross(q.v[4], a, cross(v[4], qa)), scaled(along, sum.v[3]));
                sum.v[4] = multiply_add(twelfth, add_cross(a, q.v[3], cross(qa, v[3])), scaled(along, sum.v[4]));
            }
            sum.v[0] = multiply_add(s, area, scaled(along, sum.v[0]));
            sum.v[1] = add_cross(q.v[2], a, add_cross(v[2], qa, scaled(along, sum.v[1])));
            sum.v[2] = add_cross(a, q.v[1], add_cross(qa, v[1], scaled(along, sum.v[2])));
            spread(sum, corner);
            add_to_nodes<nodes>(block, lane, corner, fields.product);
        }
    }
}

/// Adds kappa phi''/V0 (grad V')(grad V')^T, node by node: V' is linear in each.
template <int nodes, Volume volume, class V>
void polyhedron_diagonal(const PolyhedronBlock<Scalar<V>>* blocks, const HessianArrays<Scalar<V>>& fields,
                         const DiagonalBlocks<Scalar<V>>& diagonal, Range begin, Range end) {
    for (Range i = begin; i < end; ++i) {
        const auto& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const Deformed<nodes, V> cell = deformed<nodes, V>(block, lane, fields.displacement);
            const V inverse = load_lanes<V>(block.inverse_volume + lane);
            const V scale = load_lanes<V>(block.kappa + lane) * inverse *
                            volume_derivatives<volume>(cell.change * inverse).curvature;
            Vector3<V> corner[nodes];
            spread(gradient(cell.at, splat<V>(1)), corner);
            const bool packed = !fields.displacement[1];
            for (int c = 0; c < nodes; ++c) {
                const Symmetric3<V> h = rank_one(splat<V>(0), scale, corner[c]);
                for (int e = 0; e < kBlockEntries; ++e) {
                    alignas(64) Scalar<V> lanes[kWidth<V>];
                    store_lanes(lanes, h.entry[e]);
                    for (int l = 0; l < kWidth<V>; ++l) {
                        const std::int32_t at = block.node[c][lane + l];
                        diagonal.entry[e][packed ? at / 4 : at] += lanes[l];
                    }
                }
            }
        }
    }
}

/// Adds (V' - V0) / nodes to each node, and how it changes along the direction.
template <int nodes, bool directed, class V>
void nodal_dilations(const PolyhedronBlock<Scalar<V>>* blocks, const NodalVolumeArrays<Scalar<V>>& nodal,
                     const HessianArrays<Scalar<V>>& fields, Range begin, Range end) {
    for (Range i = begin; i < end; ++i) {
        const auto& block = blocks[i];
        for (int lane = 0; lane < kBlockItems; lane += kWidth<V>) {
            const Deformed<nodes, V> cell = deformed<nodes, V>(block, lane, fields.displacement);
            const V part = constant<V>(1.0 / nodes);
            add_at_nodes<nodes>(block, lane, part * cell.change, nodal.dilation);
            if constexpr (directed) {
                Vector3<V> corner[nodes];
                load_nodes<nodes>(block, lane, fields.direction, corner);
                const Vectors<nodes, V> q = vectors_of(corner), by = gradient(cell.at, part);
                V change = dot(by.v[0], q.v[0]);
                for (int e = 1; e < Vectors<nodes, V>::kCount; ++e) {
                    change = change + dot(by.v[e], q.v[e]);
                }
                add_at_nodes<nodes>(block, lane, change, nodal.dilation_change);
            }
        }
    }
}

/// pressure = kappa phi'(J), pressure_change = kappa phi''(J) dJ.
template <Volume volume, bool directed, class V>
void nodal_pressures(const NodalVolumeArrays<Scalar<V>>& nodal, Range begin, Range end) {
    for (Range n = begin; n < end; n += kWidth<V>) {
        const V kappa = load_lanes<V>(nodal.kappa + n), inverse = load_lanes<V>(nodal.inverse_volume + n);
        const V j = load_lanes<V>(nodal.dilation + n) * inverse;
        if constexpr (directed) {
            const VolumeDerivatives<V> phi = volume_derivatives<volume>(j);
            store_lanes(nodal.pressure + n, kappa * phi.slope);
            store_lanes(nodal.pressure_change + n,
                        kappa * phi.curvature * (load_lanes<V>(nodal.dilation_change + n) * inverse));
        } else {
            store_lanes(nodal.pressure + n, kappa * volume_slope<volume>(j));
        }
    }
}

/// Sum of kappa V0 phi(J); where there is no node, kappa is 0 and 1 / V0 is 1.
template <Volume volume, class V>
double nodal_energy(const NodalVolumeArrays<Scalar<V>>& nodal, Range begin, Range end) {
    double energy = 0;
    for (Range n = begin; n < end; n += kWidth<V>) {
        const V inverse = load_lanes<V>(nodal.inverse_volume + n);
        const V stored = volume_energy<volume>(load_lanes<V>(nodal.dilation + n) * inverse);
        add_in_double(energy, divide(load_lanes<V>(nodal.kappa + n), inverse) * stored);
    }
    return energy;
}

} // namespace

HYBMSS_DEFINE_KERNEL(polyhedra);
HYBMSS_DEFINE_ORDERED_KERNEL(polyhedron_energy);
HYBMSS_DEFINE_COMMON_KERNEL(polyhedron_product);
HYBMSS_DEFINE_COMMON_KERNEL(polyhedron_diagonal);
HYBMSS_DEFINE_KERNEL(nodal_dilations);
HYBMSS_DEFINE_KERNEL(nodal_pressures);
HYBMSS_DEFINE_ORDERED_KERNEL(nodal_energy);

} // namespace hybmss::kernels
