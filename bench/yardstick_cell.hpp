#pragma once

/// \file
/// What the yardsticks of the step and of the Hessian share.

#include "bench/yardstick.hpp"

#include <cmath>

namespace hybmss::bench {

inline Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

inline Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Vector3 operator*(double s, const Vector3& a) {
    return {s * a.x, s * a.y, s * a.z};
}

inline double dot(const Vector3& a, const Vector3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The three edge vectors of a cell, each the mean of its four parallel edges.
struct MeanEdges {
    Vector3 a, b, c;
};

/// phi'(J) of the volume energy kappa V0 phi(J).
inline double volume_energy_derivative(VolumeEnergy energy, double volume_ratio) {
    if (energy == VolumeEnergy::mean_stretch) {
        if (volume_ratio < 0.125) {
            return -6.0;
        }
        const double stretch = std::cbrt(volume_ratio);
        return 3.0 * (stretch - 1.0) / (stretch * stretch);
    }
    return volume_ratio - 1.0;
}

} // namespace hybmss::bench
