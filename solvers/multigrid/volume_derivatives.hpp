#pragma once

#include "hybmss/material.hpp"

#include <cmath>

namespace hybmss {

/// phi'(J) and phi''(J) of a volume energy at J = 1 + j; see VolumeEnergy.
struct VolumeDerivatives {
    double first, second;
};

inline VolumeDerivatives volume_derivatives(VolumeEnergy energy, double j) {
    if (energy == VolumeEnergy::quadratic) {
        return {j, 1};
    }
    if (energy != VolumeEnergy::mean_stretch) {
        return {0, 0};
    }
    if (j < -7.0 / 8.0) {
        return {-6, 0};
    }
    const double c = std::cbrt(1 + j), c2 = c * c;
    return {3 * (c - 1) / c2, (2 - c) / (c2 * c2 * c)};
}

} // namespace hybmss
