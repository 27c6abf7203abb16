#pragma once

/// \file
/// How deep a point lies in an obstacle, in the obstacle's own axes and about its position.

#include "hybmss/contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hybmss {

using Point = std::array<double, 3>;

inline double dot(const Point& a, const Point& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point& a, const Point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Signed distance below zero inside, where it is exact; outside a box a lower bound. `normal`: of unit length, the
/// way out, also where several are as short: any of them.
struct SurfaceDistance {
    double distance;
    Point normal;
};

inline double distance_to(const PlaneShape& plane, const Point& y) {
    return dot(plane.normal, y);
}
inline SurfaceDistance surface_at(const PlaneShape& plane, const Point& y) {
    return {dot(plane.normal, y), plane.normal};
}

inline double distance_to(const SphereShape& sphere, const Point& y) {
    return std::sqrt(dot(y, y)) - sphere.radius;
}
inline SurfaceDistance surface_at(const SphereShape& sphere, const Point& y) {
    const double r = std::sqrt(dot(y, y));
    // At the centre, where r^2 may also have underflowed, every way is as long.
    return {r - sphere.radius, r > 0 ? Point{y[0] / r, y[1] / r, y[2] / r} : Point{0, 1, 0}};
}

inline double distance_to(const BoxShape& box, const Point& y) {
    return std::max(
        {std::abs(y[0]) - box.size[0] / 2, std::abs(y[1]) - box.size[1] / 2, std::abs(y[2]) - box.size[2] / 2});
}
inline SurfaceDistance surface_at(const BoxShape& box, const Point& y) {
    std::size_t nearest = 0;
    double distance = std::abs(y[0]) - box.size[0] / 2;
    for (std::size_t a = 1; a < 3; ++a) {
        if (const double d = std::abs(y[a]) - box.size[a] / 2; d > distance) {
            distance = d;
            nearest = a;
        }
    }
    Point normal = {0, 0, 0};
    normal[nearest] = y[nearest] < 0 ? -1 : 1;
    return {distance, normal};
}

} // namespace hybmss
