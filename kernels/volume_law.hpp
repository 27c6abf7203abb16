#pragma once

// The volume energy of a cell, as a function of J - 1.

#include "kernels/arguments.hpp"
#include "kernels/simd.hpp"

namespace hybmss::kernels {
namespace {

/// cbrt(1 + j) - 1 for 1 + j >= 1/8, with a small relative error as j goes to zero.
///
/// Halley's step improves the seed c; c is rounded to a grid coarser than its error, so that y = c - 1 is exactly 0
/// near j = 0; the residual R = (1 + j) - c^3 = j - y (3 + y (3 + y)) has no cancellation, and one more step of the
/// third order, c R / (3 c^3 + R), adds the rest. Double takes a last Newton step.
template <class V>
HYBMSS_INLINE V cube_root_minus_one(V j) {
    using T = Scalar<V>;
    const auto k = [](double value) { return splat<V>(static_cast<T>(value)); };
    const V x = j + k(1.0);
    const V seed = cube_root_seed(x);
    const V seed3 = seed * seed * seed;
    const V halley = divide(seed * multiply_add(k(2.0), x, seed3), multiply_add(k(2.0), seed3, x));
    const V c = round_fraction<12>(halley);
    const V y = c - k(1.0);
    const V residual = subtract_product(y, multiply_add(y, y + k(3.0), k(3.0)), j);
    const V root = y + divide(c * residual, multiply_add(k(3.0) * c, c * c, residual));
    if constexpr (Traits<V>::kFloat) {
        return root;
    } else {
        const V last = subtract_product(root, multiply_add(root, root + k(3.0), k(3.0)), j);
        const V refined = root + k(1.0);
        return root + divide(last, k(3.0) * refined * refined);
    }
}

/// phi'(J) as a function of j = J - 1.
///     quadratic:     j
///     mean stretch:  3 (c - 1) / c^2, c = cbrt(J); -6 below J = 1/8
template <Volume volume, class V>
HYBMSS_INLINE V volume_slope(V j) {
    using T = Scalar<V>;
    if constexpr (volume == Volume::quadratic) {
        return j;
    } else {
        const V e = cube_root_minus_one(maximum(j, splat<V>(T(-0.875))));
        const V c = e + splat<V>(T(1));
        return divide(splat<V>(T(3)) * e, c * c);
    }
}

/// phi'(J) and phi''(J).
template <class V>
struct VolumeDerivatives {
    V slope, curvature;
};

/// phi'' is 1 (quadratic), or (2 - c) / c^5 and 0 below J = 1/8, where phi goes on linearly.
template <Volume volume, class V>
HYBMSS_INLINE VolumeDerivatives<V> volume_derivatives(V j) {
    using T = Scalar<V>;
    if constexpr (volume == Volume::quadratic) {
        return {j, splat<V>(T(1))};
    } else {
        const V bound = splat<V>(T(-0.875));
        const V e = cube_root_minus_one(maximum(j, bound));
        const V inverse = divide(splat<V>(T(1)), splat<V>(T(1)) + e), inverse2 = inverse * inverse;
        const V curvature = (splat<V>(T(1)) - e) * inverse * (inverse2 * inverse2);
        return {splat<V>(T(3)) * e * inverse2, curvature * one_where_positive(j - bound)};
    }
}

/// phi(J): j^2 / 2, or 9/2 (c - 1)^2 continued with the slope -6 below J = 1/8.
template <Volume volume, class V>
HYBMSS_INLINE V volume_energy(V j) {
    using T = Scalar<V>;
    if constexpr (volume == Volume::quadratic) {
        return splat<V>(T(0.5)) * j * j;
    } else {
        const V bounded = maximum(j, splat<V>(T(-0.875)));
        const V e = cube_root_minus_one(bounded);
        return multiply_add(splat<V>(T(6)), bounded - j, splat<V>(T(4.5)) * e * e);
    }
}

/// Of what resists being crushed, (J0 - J)^3 / 3: as a function of how far J is below J0, >= 0.
template <class V>
HYBMSS_INLINE VolumeDerivatives<V> crush_derivatives(V depth) {
    return {splat<V>(0) - depth * depth, depth + depth};
}
template <class V>
HYBMSS_INLINE V crush_energy(V depth) {
    return splat<V>(static_cast<Scalar<V>>(1.0 / 3.0)) * (depth * depth * depth);
}

} // namespace
} // namespace hybmss::kernels
