#pragma once

#include "kernels/arguments.hpp"
#include "kernels/simd.hpp"

namespace hybmss::kernels {
namespace {

/// The factor of the spring force k (1 - l/|d|) d as a function of s = |d|^2 / l^2 - 1: 1 - 1 / sqrt(1 + s).
///
/// Its relative error must stay near epsilon as s goes to zero, so the difference is never formed from 1 and a rounded
/// quotient. With an estimate t of 1 / sqrt(1 + s), the residual r = 1 - t^2 (1 + s) = y + t (y - s t), y = 1 - t,
/// gives
///
///     1 - 1 / sqrt(1 + s) = y - t ((1 - r)^(-1/2) - 1) = y - t r (1/2 + 3/8 r + 5/16 r^2 + ...)
///
/// This cancels where |y| is much larger than the result, that is where |s| is below the estimate's error. So t is
/// first rounded to a grid coarser than that error: near s = 0 it becomes exactly 1, y exactly 0, and the series alone
/// carries the result. (Without the rounding the relative error at s = 1e-6 is 7e-6 with a 14-bit estimate, 1e-4 with
/// 11 bits.)
///
/// The argument of the estimate is bounded below by 2^-20, so that coincident ends give a finite factor.
template <Accuracy accuracy, class V>
HYBMSS_INLINE V one_minus_rsqrt(V s) {
    using T = Scalar<V>;
    constexpr Seed kSeed = seed_quality<V>();
    const auto c = [](double value) { return splat<V>(static_cast<T>(value)); };
    if constexpr (accuracy == Accuracy::exact || kSeed == Seed::none) {
        // s / ((1 + s) + sqrt(1 + s))
        const V w = maximum(s + c(1.0), c(0x1p-40));
        return s / (w + square_root(w));
    } else {
        const V raw = reciprocal_square_root_seed(s + c(1.0 + 0x1p-20));
        // Half a step below 1, 2^-(bits + 2), must exceed the estimate's error.
        constexpr int kBits = kSeed == Seed::bits14 ? 11 : kSeed == Seed::bits11 ? 9 : 5;
        const V t = round_fraction<kBits>(raw);
        const V y = c(1.0) - t;
        const V r = multiply_add(t, subtract_product(s, t, y), y);
        V series;
        if constexpr (!Traits<V>::kFloat) {
            // |r| < 2^-10.6, |y| > 2^-12.1 where r is that large: the term left out is below 2^-53 of the result.
            series = multiply_add(c(63.0 / 256), r, c(35.0 / 128));
            series = multiply_add(series, r, c(5.0 / 16));
            series = multiply_add(series, r, c(3.0 / 8));
        } else if constexpr (kSeed == Seed::bits14) {
            series = c(3.0 / 8);
        } else if constexpr (kSeed == Seed::bits11) {
            series = multiply_add(c(5.0 / 16), r, c(3.0 / 8));
        } else {
            series = multiply_add(c(63.0 / 256), r, c(35.0 / 128));
            series = multiply_add(series, r, c(5.0 / 16));
            series = multiply_add(series, r, c(3.0 / 8));
        }
        series = multiply_add(series, r, c(1.0 / 2));
        return subtract_product(r * t, series, y);
    }
}

/// (|d| - l)^2 / l^2 from s = |d|^2 / l^2 - 1, without cancellation: (s / (1 + sqrt(1 + s)))^2.
template <class V>
HYBMSS_INLINE V squared_strain(V s) {
    using T = Scalar<V>;
    const V w = maximum(s + splat<V>(T(1)), splat<V>(T(0)));
    const V strain = s / (splat<V>(T(1)) + square_root(w));
    return strain * strain;
}

} // namespace
} // namespace hybmss::kernels
