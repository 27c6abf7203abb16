#pragma once

// A spring's force, energy and second derivatives, from s = |d|^2 / l^2 - 1.

#include "kernels/vectors.hpp"

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
/// carries the result. (Without the rounding the relative error at s = 1e-6 is 7e-6 with a 14-bit estimate.)
///
/// The root's argument is bounded below, so that coincident ends give a finite factor: that of the estimate by 2^-20,
/// that of the rounded root by 2^-20 in float and 2^-40 in double. Below that 1 + s is mostly rounding.
///
/// Several springs at a time, step by step side by side: they do not depend on each other, their steps do.
template <Accuracy accuracy, class V, std::size_t count>
HYBMSS_INLINE void one_minus_rsqrt(const V (&s)[count], V (&out)[count]) {
    using T = Scalar<V>;
    constexpr Seed kSeed = seed_quality<V>();
    const auto c = [](double value) { return splat<V>(static_cast<T>(value)); };
    const auto each = [](auto step) {
        for (std::size_t i = 0; i < count; ++i) {
            step(i);
        }
    };
    if constexpr (accuracy == Accuracy::fast && (kSeed == Seed::bits11 || kSeed == Seed::bits14)) {
        // s / (w + sqrt(w)), w = 1 + s, sqrt(w) = w t: its error is the estimates' own at any s.
        V w[count], t[count];
        each([&](std::size_t i) { w[i] = s[i] + c(1.0 + 0x1p-20); });
        each([&](std::size_t i) { t[i] = reciprocal_square_root_seed(w[i]); });
        each([&](std::size_t i) { w[i] = reciprocal_seed(multiply_add(w[i], t[i], w[i])); });
        each([&](std::size_t i) { out[i] = s[i] * w[i]; });
        // From 11 bits the series below takes so many operations that root and quotient, in a unit otherwise idle, are
        // faster.
    } else if constexpr (accuracy == Accuracy::exact || kSeed == Seed::none || kSeed == Seed::bits11) {
        // s / ((1 + s) + sqrt(1 + s))
        V w[count], root[count];
        each([&](std::size_t i) { w[i] = maximum(s[i] + c(1.0), c(Traits<V>::kFloat ? 0x1p-20 : 0x1p-40)); });
        each([&](std::size_t i) { root[i] = square_root(w[i]); });
        each([&](std::size_t i) { out[i] = divide(s[i], w[i] + root[i]); });
    } else {
        // Half a step below 1, 2^-(bits + 2), must exceed the estimate's error.
        constexpr int kBits = kSeed == Seed::bits14 ? 11 : 5;
        // The coefficients of r, r^2, ...; what is left out is below an epsilon of the result:
        // |r| < 2^-10.6 and 2^-4.7, and |y| > |r| / 3 wherever r is that large.
        constexpr double kSeries[] = {1.0 / 2, 3.0 / 8, 5.0 / 16, 35.0 / 128, 63.0 / 256};
        constexpr int kTerms = Traits<V>::kFloat && kSeed == Seed::bits14 ? 2 : 5;
        V t[count], y[count], r[count], series[count];
        each([&](std::size_t i) { t[i] = reciprocal_square_root_seed(s[i] + c(1.0 + 0x1p-20)); });
        each([&](std::size_t i) { t[i] = round_fraction<kBits>(t[i]); });
        each([&](std::size_t i) { y[i] = c(1.0) - t[i]; });
        each([&](std::size_t i) { r[i] = subtract_product(s[i], t[i], y[i]); });
        each([&](std::size_t i) { r[i] = multiply_add(t[i], r[i], y[i]); });
        each([&](std::size_t i) { series[i] = multiply_add(c(kSeries[kTerms - 1]), r[i], c(kSeries[kTerms - 2])); });
        for (int term = kTerms - 3; term >= 0; --term) {
            each([&](std::size_t i) { series[i] = multiply_add(series[i], r[i], c(kSeries[term])); });
        }
        each([&](std::size_t i) { out[i] = subtract_product(r[i] * t[i], series[i], y[i]); });
    }
}

/// The level, or the one that is the same operations by one_minus_rsqrt: where there is no estimate, all are the
/// rounded root's; where it has 11 bits, `accurate` is; where it has 8, `fast` is refined too.
template <class V>
constexpr Accuracy distinct_level(Accuracy accuracy) {
    constexpr Seed kSeed = seed_quality<V>();
    const bool same = kSeed == Seed::none || (kSeed == Seed::bits11 && accuracy == Accuracy::exact) ||
                      (kSeed == Seed::bits8 && accuracy == Accuracy::fast);
    return same ? Accuracy::accurate : accuracy;
}

template <Accuracy accuracy, class V>
HYBMSS_INLINE V one_minus_rsqrt(V s) {
    const V in[1] = {s};
    V out[1];
    one_minus_rsqrt<accuracy>(in, out);
    return out[0];
}

/// (|d| - l)^2 / l^2 from s = |d|^2 / l^2 - 1, without cancellation: (s / (1 + sqrt(1 + s)))^2.
template <class V>
HYBMSS_INLINE V squared_strain(V s) {
    using T = Scalar<V>;
    const V w = maximum(s + splat<V>(T(1)), splat<V>(T(0)));
    const V strain = divide(s, splat<V>(T(1)) + square_root(w));
    return strain * strain;
}

// ---- second derivatives
//
// The second derivative of a spring's energy: H = k [ t I + (1 - t) n n^T ], t = 1 - l/|d|, n = d/|d|.
//
// t is the factor of the spring's force, without cancellation; l n = (1 - t) d. Where the ends nearly coincide and the
// force's factor is bounded, to T = 1 - (|d|^2/l^2 + b)^(-1/2), the same formula is the derivative of that force, since
// dT/ds = (1 - T)^3 / 2, and stays finite.

/// l n
template <class V>
HYBMSS_INLINE Vector3<V> spring_axis(V t, const Vector3<V>& d) {
    return scaled(splat<V>(1) - t, d);
}

/// e = |d|/l - 1 from s = e (2 + e) and t = e/(1 + e), without cancellation and without a division: t (1 - t) (1 + s).
/// Coincident ends give -1: there t is bounded, and what stands for 1 + s is too.
template <class V>
HYBMSS_INLINE V strain(V s, V t) {
    using T = Scalar<V>;
    const V one = splat<V>(1);
    const V w = maximum(s + one, splat<V>(static_cast<T>(Traits<V>::kFloat ? 0x1p-20 : 0x1p-40)));
    return maximum(t * (one - t) * w, splat<V>(-1));
}

/// The numbers of a law's block k [ isotropic I + axial n n^T ].
template <class V>
struct LawFactors {
    V isotropic, axial;
};
template <SpringLaw law, class V>
HYBMSS_INLINE LawFactors<V> law_factors(V s, V t, const StiffeningConstants<Scalar<V>>& c) {
    const V one = splat<V>(1);
    if constexpr (law == SpringLaw::elastic) {
        const V bounded = maximum(t, splat<V>(c.least_tension));
        return {bounded, one - bounded};
    } else if constexpr (law == SpringLaw::damping) {
        return {splat<V>(0), one};
    } else {
        // g = e^2 (quadratic + cubic e), g' = e (2 quadratic + 3 cubic e), 1/(1 + e) = 1 - t
        const V e = strain(s, t), quadratic = splat<V>(c.quadratic), cubic = splat<V>(c.cubic);
        const V isotropic = e * e * multiply_add(cubic, e, quadratic) * (one - t);
        if constexpr (law == SpringLaw::stiffening) {
            return {isotropic, splat<V>(0)};
        } else {
            return {isotropic,
                    multiply_subtract(e, multiply_add(splat<V>(3) * cubic, e, quadratic + quadratic), isotropic)};
        }
    }
}

/// What a law makes of p; for `stiffening`, p is d.
template <SpringLaw law, class V>
HYBMSS_INLINE Vector3<V> law_product(V k, V s, V t, V inverse_length2, const Vector3<V>& d, const Vector3<V>& p,
                                     const StiffeningConstants<Scalar<V>>& c) {
    const LawFactors<V> factor = law_factors<law>(s, t, c);
    if constexpr (law == SpringLaw::stiffening) {
        return scaled(k * factor.isotropic, p);
    } else {
        const Vector3<V> axis = spring_axis(t, d);
        const V axial = k * factor.axial * inverse_length2 * dot(axis, p);
        if constexpr (law == SpringLaw::damping) {
            return scaled(axial, axis);
        } else {
            return multiply_add(axial, axis, scaled(k * factor.isotropic, p));
        }
    }
}

/// quadratic e^3/3 + cubic e^4/4: a spring's stiffening energy by k l^2, from s = |d|^2/l^2 - 1.
template <class V>
HYBMSS_INLINE V stiffening_energy(V s, const StiffeningConstants<Scalar<V>>& c) {
    using T = Scalar<V>;
    const V one = splat<V>(1), e = divide(s, one + square_root(maximum(s + one, splat<V>(0))));
    return e * e * e *
           multiply_add(splat<V>(c.cubic * T(0.25)), e, splat<V>(static_cast<T>(c.quadratic * T(1.0 / 3.0))));
}

/// A law's block, for the laws that have one.
template <SpringLaw law, class V>
HYBMSS_INLINE Symmetric3<V> law_block(V k, V s, V t, V inverse_length2, const Vector3<V>& d,
                                      const StiffeningConstants<Scalar<V>>& c) {
    const LawFactors<V> factor = law_factors<law>(s, t, c);
    return rank_one(k * factor.isotropic, k * factor.axial * inverse_length2, spring_axis(t, d));
}

} // namespace
} // namespace hybmss::kernels
