#pragma once

#include "dynamics/contact/obstacle_distance.hpp"

#include <array>
#include <cmath>
#include <cstddef>

namespace hybmss {

/// Row by row.
using Matrix = std::array<double, 9>;

inline Point to_space(const Matrix& r, const Point& y) {
    return {r[0] * y[0] + r[1] * y[1] + r[2] * y[2], r[3] * y[0] + r[4] * y[1] + r[5] * y[2],
            r[6] * y[0] + r[7] * y[1] + r[8] * y[2]};
}
/// By the transposed matrix.
inline Point from_space(const Matrix& r, const Point& x) {
    return {r[0] * x[0] + r[3] * x[1] + r[6] * x[2], r[1] * x[0] + r[4] * x[1] + r[7] * x[2],
            r[2] * x[0] + r[5] * x[1] + r[8] * x[2]};
}
inline Point plus(const Point& a, double factor, const Point& b) {
    return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
inline double length(const Point& a) {
    return std::sqrt(dot(a, a));
}

/// `r` turned further by the vector `angle` (Rodrigues), column by column.
inline Matrix turned(const Matrix& r, const Point& angle) {
    const double phi = length(angle);
    if (phi == 0) {
        return r;
    }
    const double sine = std::sin(phi), half = std::sin(phi / 2), versine = 2 * half * half;
    const Point n = {angle[0] / phi, angle[1] / phi, angle[2] / phi};
    Matrix out{};
    for (std::size_t c = 0; c < 3; ++c) {
        const Point p = {r[c], r[3 + c], r[6 + c]}, q = cross(n, p), qq = cross(n, q);
        for (std::size_t a = 0; a < 3; ++a) {
            out[3 * a + c] = p[a] + sine * q[a] + versine * qq[a];
        }
    }
    return out;
}

} // namespace hybmss
