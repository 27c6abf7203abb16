#include "hybmss/material.hpp"

#include "hybmss/moduli.hpp"
#include "layouts/messages.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

void require(bool good, const char* name, double value, const std::string& allowed) {
    if (!good) {
        refuse_value(name, value, allowed);
    }
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
    validate(m.stiffening);
    require(m.crush.stiffness >= 0 && m.crush.stiffness <= 1e6, "crush.stiffness", m.crush.stiffness,
            "at least 0 (at most 1e6)");
    require(!m.crush.any() || (m.crush.ratio > 0 && m.crush.ratio < 1), "crush.ratio", m.crush.ratio,
            "inside (0, 1), both ends excluded");
}

// The slope 1 + 2 a e + 3 b e^2 is convex for b >= 0. Its minimum over e >= -1 is at e = -a/(3b) where that is above
// -1, else at -1: for 3 b <= 1 the end decides what a may be, else the vertex. For b < 0 the slope falls without end.
StiffeningRange quadratic_stiffening(double cubic) {
    const double root = std::sqrt(3 * cubic);
    return {0 - root, 3 * cubic <= 1 ? (1 + 3 * cubic) / 2 : root};
}

void validate(const SpringStiffening& s) {
    require(s.cubic >= 0 && s.cubic <= 1e6, "stiffening.cubic", s.cubic, "at least 0 (at most 1e6)");
    const StiffeningRange range = quadratic_stiffening(s.cubic);
    require(s.quadratic >= range.least && s.quadratic <= range.most, "stiffening.quadratic", s.quadratic,
            printed("in [%g, %g] with cubic = %g, so that no spring gives way as it is pulled", range.least, range.most,
                    s.cubic));
}

double largest_stiffening(const SpringStiffening& s, double strain) {
    const auto slope = [&](double e) { return 1 + 2 * s.quadratic * e + 3 * s.cubic * e * e; };
    return std::max({1.0, slope(strain), slope(-strain)});
}

YoungAndPoisson young_and_poisson(const ElasticModuli& known) {
    const auto& [E, nu, G, K, lame] = known;
    std::string given;
    int count = 0;
    const auto note = [&](const char* name, const std::optional<double>& value) {
        if (value) {
            require(std::isfinite(*value), name, *value, "finite");
            given += printed("%s%s = %g", count++ == 0 ? "" : " and ", name, *value);
        }
    };
    note("young_modulus", E);
    note("poisson_ratio", nu);
    note("shear_modulus", G);
    note("bulk_modulus", K);
    note("lame_modulus", lame);
    if (count != 2) {
        throw std::invalid_argument(std::to_string(count) +
                                    " elastic moduli given: two of young_modulus, poisson_ratio, shear_modulus, "
                                    "bulk_modulus and lame_modulus must be");
    }
    YoungAndPoisson found{};
    if (E) {
        // Of E and lambda: nu / ((1 + nu)(1 - 2 nu)) = lambda / E, the root that vanishes with lambda.
        found = {*E, nu  ? *nu
                     : G ? *E / (2 * *G) - 1
                     : K ? 0.5 - *E / (6 * *K)
                         : 2 * *lame / (*E + *lame + std::sqrt(*E * *E + 9 * *lame * *lame + 2 * *E * *lame))};
    } else if (nu) {
        found = {G ? 2 * *G * (1 + *nu) : K ? 3 * *K * (1 - 2 * *nu) : *lame * (1 + *nu) * (1 - 2 * *nu) / *nu, *nu};
    } else {
        // By G and K.
        const double shear = G ? *G : 1.5 * (*K - *lame), bulk = K ? *K : *lame + 2 * *G / 3;
        found = {9 * bulk * shear / (3 * bulk + shear), (3 * bulk - 2 * shear) / (6 * bulk + 2 * shear)};
    }
    if (!(found.young_modulus > 0 && found.poisson_ratio > -1 && found.poisson_ratio < 0.5)) {
        throw std::invalid_argument(
            printed("%s make young_modulus = %g and poisson_ratio = %g, which must be above 0 and inside (-1, 0.5)",
                    given.c_str(), found.young_modulus, found.poisson_ratio));
    }
    return found;
}

double shear_modulus(const Material& m) {
    return m.young_modulus / (2.0 * (1.0 + m.poisson_ratio));
}

double volume_modulus(const Material& m) {
    return shear_modulus(m) * (4.0 * m.poisson_ratio - 1.0) / (1.0 - 2.0 * m.poisson_ratio);
}

double crush_modulus(const Material& m) {
    return m.crush.any() ? shear_modulus(m) * m.crush.stiffness / (m.crush.ratio * m.crush.ratio) : 0;
}

SpringConstants spring_constants(const Material& m, double cell_size) {
    const double ratio = m.face_diagonal_ratio;
    const double scale = shear_modulus(m) * cell_size / (4.0 + 3.0 * ratio);
    return {.edge = scale * (8.0 + 3.0 * ratio), .face_diagonal = 3.0 * scale * ratio, .cube_diagonal = 3.0 * scale};
}

// Twisted plates of any thickness are exact where 3 alpha + beta = 4. A square bar of 2 x 2 cells, whose nodes do not
// warp, has J = I (3 + alpha)/4, and should have Saint-Venant's.
PatternConstants pattern_constants(const Material& m, double cell_size) {
    constexpr double kTorsionOfTheSquare = 0.14057701495515552; // J / a^4; I / a^4 = 1/6
    constexpr double kAlpha = 4 * 6 * kTorsionOfTheSquare - 3;
    const double nu = m.poisson_ratio, unit = 4.0 / 3.0 * cell_size, shear = unit * shear_modulus(m);
    return {.bending = unit * m.young_modulus / (1 - nu * nu),
            .coupling = nu,
            .twist = shear * kAlpha,
            .joint_twist = shear * (4 - 3 * kAlpha),
            .fourth = (m.young_modulus + 2 * shear_modulus(m)) * unit / 3};
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
