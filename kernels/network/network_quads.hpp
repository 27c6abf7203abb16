#pragma once

// Nodes of four components x y z w, loaded as they lie and transposed in registers: four vectors of quads become the
// vectors x, y, z, w of as many nodes as a vector has lanes, and back.
//
//     q[0] = x0 y0 z0 w0 | x4 y4 z4 w4 | ...            q[0] = x0 x1 x2 x3 | x4 x5 x6 x7 | ...
//     q[1] = x1 y1 z1 w1 | x5 y5 z5 w5 | ...   <--->    q[1] = y0 y1 y2 y3 | y4 ...
//     q[2] = x2 ...                                     q[2] = z0 ...
//     q[3] = x3 ...                                     q[3] = w0 ...
//
// The transposition stays within groups of four lanes. With two lanes a vector (double, SSE2 and NEON) a quad takes two
// vectors: q = { x0 y0, x1 y1, z0 w0, z1 w1 }.

#include "kernels/simd.hpp"
#include "layouts/network/network_blocks.hpp"

namespace hybmss::kernels {
namespace {

/// Transposes; its own inverse.
template <class V>
HYBMSS_INLINE void transpose_quads(V (&q)[4]) {
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        const __m512 t0 = _mm512_unpacklo_ps(q[0], q[1]), t1 = _mm512_unpackhi_ps(q[0], q[1]);
        const __m512 t2 = _mm512_unpacklo_ps(q[2], q[3]), t3 = _mm512_unpackhi_ps(q[2], q[3]);
        q[0] = _mm512_shuffle_ps(t0, t2, 0x44);
        q[1] = _mm512_shuffle_ps(t0, t2, 0xee);
        q[2] = _mm512_shuffle_ps(t1, t3, 0x44);
        q[3] = _mm512_shuffle_ps(t1, t3, 0xee);
    } else {
        const __m512d t0 = _mm512_unpacklo_pd(q[0], q[1]), t1 = _mm512_unpackhi_pd(q[0], q[1]);
        const __m512d t2 = _mm512_unpacklo_pd(q[2], q[3]), t3 = _mm512_unpackhi_pd(q[2], q[3]);
        const __m512i low = _mm512_set_epi64(13, 12, 5, 4, 9, 8, 1, 0);
        const __m512i high = _mm512_set_epi64(15, 14, 7, 6, 11, 10, 3, 2);
        q[0] = _mm512_permutex2var_pd(t0, low, t2);
        q[1] = _mm512_permutex2var_pd(t1, low, t3);
        q[2] = _mm512_permutex2var_pd(t0, high, t2);
        q[3] = _mm512_permutex2var_pd(t1, high, t3);
    }
#elif defined(__AVX2__)
    if constexpr (Traits<V>::kFloat) {
        const __m256 t0 = _mm256_unpacklo_ps(q[0], q[1]), t1 = _mm256_unpackhi_ps(q[0], q[1]);
        const __m256 t2 = _mm256_unpacklo_ps(q[2], q[3]), t3 = _mm256_unpackhi_ps(q[2], q[3]);
        q[0] = _mm256_shuffle_ps(t0, t2, 0x44);
        q[1] = _mm256_shuffle_ps(t0, t2, 0xee);
        q[2] = _mm256_shuffle_ps(t1, t3, 0x44);
        q[3] = _mm256_shuffle_ps(t1, t3, 0xee);
    } else {
        const __m256d t0 = _mm256_unpacklo_pd(q[0], q[1]), t1 = _mm256_unpackhi_pd(q[0], q[1]);
        const __m256d t2 = _mm256_unpacklo_pd(q[2], q[3]), t3 = _mm256_unpackhi_pd(q[2], q[3]);
        q[0] = _mm256_permute2f128_pd(t0, t2, 0x20);
        q[1] = _mm256_permute2f128_pd(t1, t3, 0x20);
        q[2] = _mm256_permute2f128_pd(t0, t2, 0x31);
        q[3] = _mm256_permute2f128_pd(t1, t3, 0x31);
    }
#elif defined(__SSE2__)
    if constexpr (Traits<V>::kFloat) {
        const __m128 t0 = _mm_unpacklo_ps(q[0], q[1]), t1 = _mm_unpackhi_ps(q[0], q[1]);
        const __m128 t2 = _mm_unpacklo_ps(q[2], q[3]), t3 = _mm_unpackhi_ps(q[2], q[3]);
        q[0] = _mm_movelh_ps(t0, t2);
        q[1] = _mm_movehl_ps(t2, t0);
        q[2] = _mm_movelh_ps(t1, t3);
        q[3] = _mm_movehl_ps(t3, t1);
    } else {
        const __m128d t0 = _mm_unpackhi_pd(q[0], q[1]), t2 = _mm_unpackhi_pd(q[2], q[3]);
        q[0] = _mm_unpacklo_pd(q[0], q[1]);
        q[1] = t0;
        q[2] = _mm_unpacklo_pd(q[2], q[3]);
        q[3] = t2;
    }
#else
    if constexpr (Traits<V>::kFloat) {
        const auto wide = [](float32x4_t v) { return vreinterpretq_f64_f32(v); };
        const float64x2_t t0 = wide(vzip1q_f32(q[0], q[1])), t1 = wide(vzip2q_f32(q[0], q[1]));
        const float64x2_t t2 = wide(vzip1q_f32(q[2], q[3])), t3 = wide(vzip2q_f32(q[2], q[3]));
        q[0] = vreinterpretq_f32_f64(vzip1q_f64(t0, t2));
        q[1] = vreinterpretq_f32_f64(vzip2q_f64(t0, t2));
        q[2] = vreinterpretq_f32_f64(vzip1q_f64(t1, t3));
        q[3] = vreinterpretq_f32_f64(vzip2q_f64(t1, t3));
    } else {
        const float64x2_t t0 = vzip2q_f64(q[0], q[1]), t2 = vzip2q_f64(q[2], q[3]);
        q[0] = vzip1q_f64(q[0], q[1]);
        q[1] = t0;
        q[2] = vzip1q_f64(q[2], q[3]);
        q[3] = t2;
    }
#endif
}

/// q[j] gets the quads at base + index[j], base + index[4 + j], ...
template <class V>
HYBMSS_INLINE void load_quads(const Scalar<V>* base, const std::int32_t* index, V (&q)[4]) {
    if constexpr (kWidth<V> == 2) {
        q[0] = load_lanes<V>(base + index[0]);
        q[1] = load_lanes<V>(base + index[1]);
        q[2] = load_lanes<V>(base + index[0] + 2);
        q[3] = load_lanes<V>(base + index[1] + 2);
    } else {
        for (int j = 0; j < 4; ++j) {
            const auto at = [&](int group) { return base + index[4 * group + j]; };
#if defined(__AVX512F__)
            if constexpr (Traits<V>::kFloat) {
                const __m256 low =
                    _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(at(0))), _mm_load_ps(at(1)), 1);
                const __m256 high =
                    _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(at(2))), _mm_load_ps(at(3)), 1);
                q[j] = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
            } else {
                q[j] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_load_pd(at(0))), _mm256_load_pd(at(1)), 1);
            }
#elif defined(__AVX2__)
            if constexpr (Traits<V>::kFloat) {
                q[j] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(at(0))), _mm_load_ps(at(1)), 1);
            } else {
                q[j] = _mm256_load_pd(at(0));
            }
#else
            q[j] = load_lanes<V>(at(0));
#endif
        }
    }
}

/// The quad of `group` in a vector, in the smallest vector that holds it.
#if defined(__AVX512F__)
template <int group, class V>
HYBMSS_INLINE auto quad_of(V q) {
    if constexpr (Traits<V>::kFloat) {
        return _mm512_extractf32x4_ps(q, group);
    } else {
        return _mm512_extractf64x4_pd(q, group);
    }
}
#elif defined(__AVX2__)
template <int group, class V>
HYBMSS_INLINE auto quad_of(V q) {
    if constexpr (Traits<V>::kFloat) {
        return _mm256_extractf128_ps(q, group);
    } else {
        return static_cast<__m256d>(q);
    }
}
#else
template <int group, class V>
HYBMSS_INLINE V quad_of(V q) {
    return q;
}
#endif

#if defined(__AVX2__)
HYBMSS_INLINE __m128 changed_quad(const float* p, __m128 q, bool add) {
    return add ? _mm_add_ps(_mm_load_ps(p), q) : _mm_sub_ps(_mm_load_ps(p), q);
}
HYBMSS_INLINE __m256d changed_quad(const double* p, __m256d q, bool add) {
    return add ? _mm256_add_pd(_mm256_load_pd(p), q) : _mm256_sub_pd(_mm256_load_pd(p), q);
}
HYBMSS_INLINE void store_quad(float* p, __m128 q) {
    _mm_store_ps(p, q);
}
HYBMSS_INLINE void store_quad(double* p, __m256d q) {
    _mm256_store_pd(p, q);
}
#else
template <class V>
HYBMSS_INLINE V changed_quad(const Scalar<V>* p, V q, bool add) {
    const V old = load_lanes<V>(p);
    return add ? old + q : old - q;
}
template <class V>
HYBMSS_INLINE void store_quad(Scalar<V>* p, V q) {
    store_lanes(p, q);
}
#endif

/// Adds each quad to the one at its index, or subtracts it; quads as in load_quads, none may occur twice. All are
/// loaded before one is stored: a load soon after a store of unknown address may wait for it in vain.
template <bool add, class V>
HYBMSS_INLINE void accumulate_quads(const V (&q)[4], Scalar<V>* base, const std::int32_t* index) {
    if constexpr (kWidth<V> == 2) {
        const V sum[4] = {changed_quad(base + index[0], q[0], add), changed_quad(base + index[1], q[1], add),
                          changed_quad(base + index[0] + 2, q[2], add), changed_quad(base + index[1] + 2, q[3], add)};
        store_quad(base + index[0], sum[0]);
        store_quad(base + index[1], sum[1]);
        store_quad(base + index[0] + 2, sum[2]);
        store_quad(base + index[1] + 2, sum[3]);
    } else {
        decltype(quad_of<0>(q[0])) sum[kWidth<V>];
        for (int j = 0; j < 4; ++j) {
            sum[j] = changed_quad(base + index[j], quad_of<0>(q[j]), add);
            if constexpr (kWidth < V >> 4) {
                sum[4 + j] = changed_quad(base + index[4 + j], quad_of<1>(q[j]), add);
            }
            if constexpr (kWidth < V >> 8) {
                sum[8 + j] = changed_quad(base + index[8 + j], quad_of<2>(q[j]), add);
                sum[12 + j] = changed_quad(base + index[12 + j], quad_of<3>(q[j]), add);
            }
        }
        for (int i = 0; i < kWidth<V>; ++i) {
            store_quad(base + index[i], sum[i]);
        }
    }
}

/// The first elements of a run's nodes, in the order of its rows, from that of lane 0.
template <class V>
struct RowIndices {
    std::int32_t index[kBlockItems]{};
    constexpr RowIndices() {
        for (std::size_t i = 0; i < kBlockItems; ++i) {
            index[i] = static_cast<std::int32_t>(4 * lane_of_row(i, kWidth<V>));
        }
    }
};
template <class V>
constexpr RowIndices<V> kRow{};

/// The quads of as many nodes in a row as a vector has lanes.
template <class V>
HYBMSS_INLINE void load_row(const Scalar<V>* first, V (&q)[4]) {
    constexpr bool kHalves = kWidth<V> == 2; // as in load_quads
    for (int j = 0; j < 4; ++j) {
        q[j] = load_lanes<V>(first + (kHalves ? j % 2 * 4 + j / 2 * 2 : j * kWidth<V>));
    }
}

/// Adds quads to nodes in a row, or subtracts them.
template <bool add, class V>
HYBMSS_INLINE void accumulate_row(const V (&q)[4], Scalar<V>* first) {
    constexpr bool kHalves = kWidth<V> == 2;
    V sum[4];
    load_row(first, sum);
    for (int j = 0; j < 4; ++j) {
        store_lanes(first + (kHalves ? j % 2 * 4 + j / 2 * 2 : j * kWidth<V>), add ? sum[j] + q[j] : sum[j] - q[j]);
    }
}

/// sum + what a run's vectors hold; of those that are alike in the order of the nodes, not of the lanes.
template <class V>
HYBMSS_INLINE void add_run(double& sum, const V (&held)[kTogether<V>]) {
    if constexpr (Traits<V>::kAlike) {
        Scalar<V> of_node[kBlockItems];
        for (int v = 0; v < kTogether<V>; ++v) {
            alignas(64) Scalar<V> lanes[kWidth<V>];
            store_lanes(lanes, held[v]);
            for (int i = 0; i < kWidth<V>; ++i) {
                of_node[kRow<V>.index[v * kWidth<V> + i] / 4] = lanes[i];
            }
        }
        for (const Scalar<V> value : of_node) {
            sum += static_cast<double>(value);
        }
    } else {
        add_in_double(sum, held[0]);
    }
}

} // namespace
} // namespace hybmss::kernels
