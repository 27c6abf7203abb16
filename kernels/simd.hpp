#pragma once

// The vector operations that the kernels are written in: a thin layer over xsimd.
//
// Everything here lives in an anonymous namespace and is always inlined: this file is compiled once for every
// instruction set, and a shared inline function would let the linker keep the copy that the machine cannot run.
//
// Intrinsics appear where xsimd 8.1 has a hole (with AVX-512: no reciprocal square root, no fused multiply-add) or no
// such operation (a lane shift with a carry, a gather by 32-bit indices for every type). No name here is also one of
// xsimd's: argument-dependent lookup would prefer xsimd::store, which wants aligned memory.

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <xsimd/xsimd.hpp>

#define HYBMSS_INLINE [[gnu::always_inline]] inline

namespace hybmss::kernels {
namespace {

template <class T, class Arch>
using Batch = xsimd::batch<T, Arch>;

/// The instruction set A for vectors whose results are the same bits on every set: a product and a sum are rounded one
/// by one, whether or not the processor could fuse them, and many numbers are added up in one order, whatever the
/// width.
template <class A>
struct Alike : A {};

/// Facts about a batch type V: its scalar, its instruction set, its width.
template <class V>
struct Traits;
template <class T, class A>
struct Traits<xsimd::batch<T, A>> {
    using Scalar = T;
    using Arch = A;
    static constexpr bool kAlike = false;
    static constexpr int kWidth = static_cast<int>(xsimd::batch<T, A>::size);
#if defined(__AVX512F__)
    static constexpr bool kAvx512 = std::is_base_of_v<xsimd::avx512f, A>;
#else
    static constexpr bool kAvx512 = false;
#endif
    static constexpr bool kFloat = sizeof(T) == 4;
#if defined(__FMA__) || defined(__aarch64__)
    static constexpr bool kFuses = true;
#else
    static constexpr bool kFuses = false;
#endif
};
template <class T, class A>
struct Traits<xsimd::batch<T, Alike<A>>> : Traits<xsimd::batch<T, A>> {
    using Arch = Alike<A>;
    static constexpr bool kAlike = true;
    static constexpr bool kFuses = false;
};

template <class V>
using Scalar = typename Traits<V>::Scalar;
template <class V>
inline constexpr int kWidth = Traits<V>::kWidth;

/// How many vectors are added up as one, so that sums do not depend on the width: those of a block of springs or cells,
/// among which a node may occur twice.
template <class V>
inline constexpr int kTogether = Traits<V>::kAlike ? 16 / kWidth<V> : 1;

template <class V>
HYBMSS_INLINE V splat(Scalar<V> value) {
    return V(value);
}
template <class V>
HYBMSS_INLINE V load_lanes(const Scalar<V>* p) {
    return V::load_unaligned(p);
}
template <class V>
HYBMSS_INLINE void store_lanes(Scalar<V>* p, V v) {
    v.store_unaligned(p);
}

/// a b + c, rounded once where the instruction set can and need not be alike.
template <class V>
HYBMSS_INLINE V multiply_add(V a, V b, V c) {
    if constexpr (Traits<V>::kAlike) {
        return a * b + c;
    }
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_fmadd_ps(a, b, c);
    } else {
        return _mm512_fmadd_pd(a, b, c);
    }
#else
    return xsimd::fma(a, b, c);
#endif
}

/// c - a b.
template <class V>
HYBMSS_INLINE V subtract_product(V a, V b, V c) {
    if constexpr (Traits<V>::kAlike) {
        return c - a * b;
    }
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_fnmadd_ps(a, b, c);
    } else {
        return _mm512_fnmadd_pd(a, b, c);
    }
#else
    return xsimd::fnma(a, b, c);
#endif
}

/// a b - c.
template <class V>
HYBMSS_INLINE V multiply_subtract(V a, V b, V c) {
    if constexpr (Traits<V>::kAlike) {
        return a * b - c;
    }
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_fmsub_ps(a, b, c);
    } else {
        return _mm512_fmsub_pd(a, b, c);
    }
#else
    return xsimd::fms(a, b, c);
#endif
}

/// -a b - c.
template <class V>
HYBMSS_INLINE V minus_product_minus(V a, V b, V c) {
    if constexpr (Traits<V>::kAlike) {
        return -(a * b) - c;
    }
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_fnmsub_ps(a, b, c);
    } else {
        return _mm512_fnmsub_pd(a, b, c);
    }
#else
    return xsimd::fnms(a, b, c);
#endif
}

template <class V>
HYBMSS_INLINE V maximum(V a, V b) {
    return xsimd::max(a, b);
}

// Correctly rounded. On ARM, xsimd 8.1 has approximations for floats instead.
template <class V>
HYBMSS_INLINE V square_root(V a) {
#if defined(__aarch64__)
    if constexpr (Traits<V>::kFloat) {
        return vsqrtq_f32(a);
    }
#endif
    return xsimd::sqrt(a);
}
template <class V>
HYBMSS_INLINE V divide(V a, V b) {
#if defined(__aarch64__)
    if constexpr (Traits<V>::kFloat) {
        return vdivq_f32(a, b);
    }
#endif
    return a / b;
}

/// How good reciprocal_square_root_seed is, or that there is none and the exact operations are the faster way.
enum class Seed { none, bits8, bits11, bits14 };

template <class V>
constexpr Seed seed_quality() {
    if constexpr (Traits<V>::kAvx512) {
        return Seed::bits14;
    } else if constexpr (!Traits<V>::kFloat) {
        return Seed::none;
    } else {
#if defined(__wasm__)
        return Seed::none; // its estimates are roots and quotients
#elif defined(__aarch64__) || defined(__ARM_NEON)
        return Seed::bits8;
#else
        return Seed::bits11;
#endif
    }
}

/// 1 / sqrt(a) to the relative error 2^-14, 1.5 * 2^-12 or 2^-8, by seed_quality; a must be above zero.
template <class V>
HYBMSS_INLINE V reciprocal_square_root_seed(V a) {
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_rsqrt14_ps(a);
    } else {
        return _mm512_rsqrt14_pd(a);
    }
#elif defined(__AVX__)
    return _mm256_rsqrt_ps(a);
#elif defined(__SSE2__)
    return _mm_rsqrt_ps(a);
#else
    return vrsqrteq_f32(a);
#endif
}

/// 1 / a, to the same relative error.
template <class V>
HYBMSS_INLINE V reciprocal_seed(V a) {
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_rcp14_ps(a);
    } else {
        return _mm512_rcp14_pd(a);
    }
#elif defined(__AVX__)
    return _mm256_rcp_ps(a);
#elif defined(__SSE2__)
    return _mm_rcp_ps(a);
#else
    return vrecpeq_f32(a);
#endif
}

/// Lane 0 becomes the last lane of `previous`, lane i the lane i - 1 of `current`.
template <class V>
HYBMSS_INLINE V shift_in(V previous, V current) {
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_castsi512_ps(
            _mm512_alignr_epi32(_mm512_castps_si512(current), _mm512_castps_si512(previous), 15));
    } else {
        return _mm512_castsi512_pd(_mm512_alignr_epi64(_mm512_castpd_si512(current), _mm512_castpd_si512(previous), 7));
    }
#elif defined(__AVX2__)
    if constexpr (Traits<V>::kFloat) {
        const __m256i c = _mm256_castps_si256(current);
        const __m256i straddle = _mm256_permute2x128_si256(_mm256_castps_si256(previous), c, 0x21);
        return _mm256_castsi256_ps(_mm256_alignr_epi8(c, straddle, 12));
    } else {
        const __m256d straddle = _mm256_permute2f128_pd(previous, current, 0x21);
        return _mm256_shuffle_pd(straddle, current, 0x5);
    }
#elif defined(__wasm__)
    if constexpr (Traits<V>::kFloat) {
        return static_cast<__m128>(wasm_i32x4_shuffle(__m128(previous), __m128(current), 3, 4, 5, 6));
    } else {
        return static_cast<__m128d>(wasm_i64x2_shuffle(__m128d(previous), __m128d(current), 1, 2));
    }
#elif defined(__SSE2__)
    if constexpr (Traits<V>::kFloat) {
        return _mm_castsi128_ps(
            _mm_or_si128(_mm_slli_si128(_mm_castps_si128(current), 4), _mm_srli_si128(_mm_castps_si128(previous), 12)));
    } else {
        return _mm_shuffle_pd(previous, current, 0x1);
    }
#else
    if constexpr (Traits<V>::kFloat) {
        return vextq_f32(previous, current, 3);
    } else {
        return vextq_f64(previous, current, 1);
    }
#endif
}

/// Lane i from base[index[i]].
template <class V>
HYBMSS_INLINE V gather_lanes(const Scalar<V>* base, const std::int32_t* index) {
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        return _mm512_i32gather_ps(_mm512_loadu_si512(index), base, 4);
    } else {
        return _mm512_i32gather_pd(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(index)), base, 8);
    }
#else
    alignas(64) Scalar<V> lanes[kWidth<V>];
    for (int i = 0; i < kWidth<V>; ++i) {
        lanes[i] = base[index[i]];
    }
    return V::load_aligned(lanes);
#endif
}

/// Lane i to base[index[i]]; no index may occur twice.
template <class V>
HYBMSS_INLINE void scatter_lanes(V v, Scalar<V>* base, const std::int32_t* index) {
#if defined(__AVX512F__)
    if constexpr (Traits<V>::kFloat) {
        _mm512_i32scatter_ps(base, _mm512_loadu_si512(index), v, 4);
    } else {
        _mm512_i32scatter_pd(base, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(index)), v, 8);
    }
#else
    alignas(64) Scalar<V> lanes[kWidth<V>];
    v.store_aligned(lanes);
    for (int i = 0; i < kWidth<V>; ++i) {
        base[index[i]] = lanes[i];
    }
#endif
}

/// `a` with its fraction rounded to the given number of bits: to a multiple of 2^-bits just above 1, of half as much
/// below. By integer addition, which carries into the exponent as it should.
template <int bits, class V>
HYBMSS_INLINE V round_fraction(V a) {
    constexpr int kDropped = (Traits<V>::kFloat ? 23 : 52) - bits;
    using Word = std::conditional_t<Traits<V>::kFloat, std::int32_t, std::int64_t>;
    using Integer = xsimd::batch<Word, typename Traits<V>::Arch>;
    const Integer half(Word(1) << (kDropped - 1)), mask(~((Word(1) << kDropped) - 1));
    return xsimd::bitwise_cast<V>((xsimd::bitwise_cast<Integer>(a) + half) & mask);
}

/// cbrt(a) to a relative error below 4 %, by dividing the exponent by three; a in [2^-120, 2^120].
template <class V>
HYBMSS_INLINE V cube_root_seed(V a) {
    if constexpr (Traits<V>::kFloat) {
        using Integer = xsimd::batch<std::int32_t, typename Traits<V>::Arch>;
        const V logarithm = xsimd::to_float(xsimd::bitwise_cast<Integer>(a));
        const V third = multiply_add(logarithm, splat<V>(1.0f / 3.0f), splat<V>(709960000.0f));
#if defined(__wasm__)
        // Its SSE2 rounds lane by lane, for numbers that no integer holds.
        return static_cast<__m128>(wasm_i32x4_trunc_sat_f32x4(__m128(third)));
#else
        return xsimd::bitwise_cast<V>(xsimd::to_int(third));
#endif
    } else {
        // The high 32 bits as a double: placed below the exponent of 2^52. Conversions of 64-bit integers exist only
        // with AVX-512.
        using Integer = xsimd::batch<std::uint64_t, typename Traits<V>::Arch>;
        const V two52 = splat<V>(4503599627370496.0);
        const Integer high = (xsimd::bitwise_cast<Integer>(a) >> 32) | xsimd::bitwise_cast<Integer>(two52);
        const V logarithm = xsimd::bitwise_cast<V>(high) - two52;
        const V third = multiply_add(logarithm, splat<V>(1.0 / 3.0), splat<V>(715095000.0)) + two52;
        return xsimd::bitwise_cast<V>(xsimd::bitwise_cast<Integer>(third) << 32);
    }
}

/// The sum of the lanes in double, in lane order.
template <class V>
HYBMSS_INLINE double sum_in_double(V v) {
    alignas(64) Scalar<V> lanes[kWidth<V>];
    v.store_aligned(lanes);
    double sum = 0;
    for (int i = 0; i < kWidth<V>; ++i) {
        sum += static_cast<double>(lanes[i]);
    }
    return sum;
}

/// sum + the lanes; vectors that are alike one lane after the other, since their number is no matter of the sum.
template <class V>
HYBMSS_INLINE void add_in_double(double& sum, V v) {
    if constexpr (Traits<V>::kAlike) {
        alignas(64) Scalar<V> lanes[kWidth<V>];
        v.store_aligned(lanes);
        for (int i = 0; i < kWidth<V>; ++i) {
            sum += static_cast<double>(lanes[i]);
        }
    } else {
        sum += sum_in_double(v);
    }
}

/// Whether any lane is above zero.
template <class V>
HYBMSS_INLINE bool any_positive(V v) {
    return xsimd::any(v > splat<V>(0));
}

/// `value` where gate > 0, else 0.
template <class V>
HYBMSS_INLINE V where_positive(V gate, V value) {
    return xsimd::select(gate > splat<V>(0), value, splat<V>(0));
}
/// 1 where gate > 0, else 0.
template <class V>
HYBMSS_INLINE V one_where_positive(V gate) {
    return where_positive(gate, splat<V>(1));
}

/// The same number, but the compiler cannot tell. Loads at the result are made again, close to their use, where it
/// would otherwise keep what it loaded before, and spill it: on a Zen 4, stores hold up multiply-adds.
HYBMSS_INLINE std::ptrdiff_t forget(std::ptrdiff_t n) {
    asm("" : "+r"(n));
    return n;
}

} // namespace
} // namespace hybmss::kernels

// Registers of Alike<A> are those of A.
namespace xsimd::types {
template <class T, class A>
struct simd_register<T, hybmss::kernels::Alike<A>> : simd_register<T, A> {
    using register_type = typename simd_register<T, A>::register_type;
    simd_register(register_type value) noexcept : simd_register<T, A>{value} {}
    simd_register() = default;
};
template <class T, class A>
struct has_simd_register<T, hybmss::kernels::Alike<A>> : has_simd_register<T, A> {};
template <class T, class A>
struct get_bool_simd_register<T, hybmss::kernels::Alike<A>> : get_bool_simd_register<T, A> {};
} // namespace xsimd::types

#if defined(__aarch64__)
// xsimd 8.1 passes neon64's own vectors on here, which are no Alike<neon64>.
namespace xsimd::kernel {
template <>
inline auto broadcast(float value, requires_arch<neon64>) noexcept -> batch<float, hybmss::kernels::Alike<neon64>> {
    return vdupq_n_f32(value);
}
template <>
inline auto broadcast(std::int32_t value, requires_arch<neon64>) noexcept
    -> batch<std::int32_t, hybmss::kernels::Alike<neon64>> {
    return vdupq_n_s32(value);
}
template <>
inline auto broadcast(std::int64_t value, requires_arch<neon64>) noexcept
    -> batch<std::int64_t, hybmss::kernels::Alike<neon64>> {
    return vdupq_n_s64(value);
}
} // namespace xsimd::kernel
#endif
