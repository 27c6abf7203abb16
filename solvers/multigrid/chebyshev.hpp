#pragma once

#include <type_traits>

namespace hybmss {

/// The polynomial smoother of a level: how many terms, and which part of the spectrum of B K it damps.
struct ChebyshevInterval {
    int degree = 3;
    double low = 0.1, high = 1;
};

/// What Chebyshev's iteration keeps besides the solution.
template <class Vector>
struct ChebyshevVectors {
    Vector residual, direction, scratch;
};

/// Improves x towards K x = b by Chebyshev's iteration with the preconditioner B of `level`. Where `from_zero`, x is
/// taken as zero whatever it holds.
///
/// level.multiply(p, out): out = K p;  level.precondition(r, z): z = B r;  level.for_each(map, vectors...).
template <class Level, class Vector>
void chebyshev(Level& level, const ChebyshevInterval& interval, bool from_zero, const Vector& b, Vector& x,
               ChebyshevVectors<Vector>& vectors) {
    auto& [r, d, z] = vectors;
    const double theta = (interval.high + interval.low) / 2, delta = (interval.high - interval.low) / 2;
    const double sigma = theta / delta;
    double rho = 1 / sigma;
    if (from_zero) {
        level.for_each([](const auto& from, auto& to) { to = from; }, b, r);
        level.for_each([](auto& to) { to = 0; }, x);
    } else {
        level.multiply(x, r);
        level.for_each([](const auto& from, auto& to) { to = from - to; }, b, r);
    }
    level.precondition(r, z);
    level.for_each(
        [theta](const auto& from, auto& step, auto& to) {
            using T = std::remove_cvref_t<decltype(to)>;
            step = static_cast<T>(1 / theta) * from;
            to += step;
        },
        z, d, x);
    for (int k = 1; k < interval.degree; ++k) {
        level.multiply(d, z);
        level.for_each([](const auto& by, auto& to) { to -= by; }, z, r);
        level.precondition(r, z);
        const double next = 1 / (2 * sigma - rho), keep = next * rho, add = 2 * next / delta;
        level.for_each(
            [keep, add](const auto& from, auto& step, auto& to) {
                using T = std::remove_cvref_t<decltype(to)>;
                step = static_cast<T>(keep) * step + static_cast<T>(add) * from;
                to += step;
            },
            z, d, x);
        rho = next;
    }
}

} // namespace hybmss
