#include "hybmss/material.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace hybmss {
namespace {

void require(bool good, const char* name, double value, const char* allowed) {
    if (good) {
        return;
    }
    std::ostringstream message;
    message << name << " = " << value << " is not allowed: it must be " << allowed;
    throw std::invalid_argument(message.str());
}

} // namespace

void validate(const Material& m) {
    // The upper bounds keep every constant finite in float; no material comes near them.
    require(m.young_modulus > 0 && m.young_modulus <= 1e18, "young_modulus", m.young_modulus,
            "finite and above 0 (at most 1e18 Pa)");
    require(m.poisson_ratio > -1 && m.poisson_ratio < 0.5, "poisson_ratio", m.poisson_ratio,
            "inside (-1, 0.5), both ends excluded");
    require(m.density > 0 && m.density <= 1e12, "density", m.density, "finite and above 0 (at most 1e12 kg/m^3)");
    require(m.face_diagonal_ratio >= 0 && m.face_diagonal_ratio <= 1e6, "face_diagonal_ratio", m.face_diagonal_ratio,
            "finite and at least 0 (at most 1e6)");
}

double shear_modulus(const Material& m) {
    return m.young_modulus / (2.0 * (1.0 + m.poisson_ratio));
}

double volume_modulus(const Material& m) {
    return shear_modulus(m) * (4.0 * m.poisson_ratio - 1.0) / (1.0 - 2.0 * m.poisson_ratio);
}

SpringConstants spring_constants(const Material& m, double cell_size) {
    const double ratio = m.face_diagonal_ratio;
    const double scale = shear_modulus(m) * cell_size / (4.0 + 3.0 * ratio);
    return {.edge = scale * (8.0 + 3.0 * ratio), .face_diagonal = 3.0 * scale * ratio, .cube_diagonal = 3.0 * scale};
}

VolumeEnergy resolved_volume_energy(const Material& m) {
    const double kappa = volume_modulus(m);
    if (kappa == 0.0) {
        return VolumeEnergy::none;
    }
    if (m.volume_energy != VolumeEnergy::automatic) {
        return m.volume_energy;
    }
    return kappa > 0 ? VolumeEnergy::quadratic : VolumeEnergy::mean_stretch;
}

} // namespace hybmss
