#pragma once

namespace hybmss {

/// The polynomial smoother of a level: how many terms, and which part of the spectrum of B K it damps.
struct ChebyshevInterval {
    int degree = 3;
    double low = 0.1, high = 1;
};

/// What Chebyshev's iteration keeps besides the solution. `scratch` is for the level.
template <class Vector>
struct ChebyshevVectors {
    Vector residual, direction, scratch;
};

/// Improves x towards K x = b by Chebyshev's iteration with the preconditioner B of `level`. Where `from_zero`, x is
/// taken as zero whatever it holds.
///
/// level.multiply(p, out): out = K p
/// level.correct(from, product, keep, add, vectors, x): r = from - product, or from where that is null;
/// d = keep d + add B r; x += d, or x = d where `product` is null. `from` may be r, and `product` is `scratch`, which
/// may be overwritten.
template <class Level, class Vector>
void chebyshev(Level& level, const ChebyshevInterval& interval, bool from_zero, const Vector& b, Vector& x,
               ChebyshevVectors<Vector>& vectors) {
    auto& [r, d, product] = vectors;
    const double theta = (interval.high + interval.low) / 2, delta = (interval.high - interval.low) / 2;
    const double sigma = theta / delta;
    double rho = 1 / sigma;
    if (!from_zero) {
        level.multiply(x, product);
    }
    level.correct(b, from_zero ? nullptr : &product, 0, 1 / theta, vectors, x);
    for (int k = 1; k < interval.degree; ++k) {
        level.multiply(d, product);
        const double next = 1 / (2 * sigma - rho);
        level.correct(r, &product, next * rho, 2 * next / delta, vectors, x);
        rho = next;
    }
}

} // namespace hybmss
