#pragma once

#include "kernels/hessian_arguments.hpp"
#include "kernels/lattice/lattice_cell.hpp"

namespace hybmss::kernels {
namespace {

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

/// A symmetric 3x3 matrix a lane: xx, yy, zz, xy, xz, yz.
template <class V>
struct Symmetric3 {
    V entry[kBlockEntries];
};

template <class V>
HYBMSS_INLINE Symmetric3<V> operator+(const Symmetric3<V>& a, const Symmetric3<V>& b) {
    Symmetric3<V> sum;
    for (int i = 0; i < kBlockEntries; ++i) {
        sum.entry[i] = a.entry[i] + b.entry[i];
    }
    return sum;
}

/// diagonal I + scale v v^T
template <class V>
HYBMSS_INLINE Symmetric3<V> rank_one(V diagonal, V scale, const Vector3<V>& v) {
    const Vector3<V> w = scaled(scale, v);
    return {{multiply_add(w.x, v.x, diagonal), multiply_add(w.y, v.y, diagonal), multiply_add(w.z, v.z, diagonal),
             w.x * v.y, w.x * v.z, w.y * v.z}};
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
        return {t, one - t};
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
