#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"

#include <cstddef>
#include <functional>
#include <span>

namespace hybmss {

/// Upper bounds of omega^2, the largest eigenvalue of M^-1 K, near rest, 1/s^2.
struct FrequencyBounds {
    double body = 0;    ///< of all forces
    double springs = 0; ///< of the springs alone
    double crushed = 0; ///< what cells pressed to half of their crush ratio J0 add to those of all forces, at most

    /// A step of semi-implicit Euler that is stable near rest, s. With springs damped by c = beta k, beta = the
    /// `stiffness_damping` in s, taken at the old velocity, a mode with the stiffness k, damping c and mass m by its
    /// shape is stable where dt^2 k + 2 dt c < 4 m: that is so where dt^2 omega^2 + 2 dt beta omega_springs^2 <= 4.
    /// `further`: what is added to omega^2 far from rest, >= 0. Infinite where nothing resists.
    double critical_time_step(double stiffness_damping = 0, double further = 0) const;
};

/// By the largest eigenvalues of one cell's stiffness by its share of the masses: no assembly of cells has a larger one
/// (Irons and Treharne's theorem on element eigenvalues).
FrequencyBounds lattice_frequencies(const Lattice& lattice, const Material& material);

/// By the largest row sum of M^-1 K (Gershgorin), each 3x3 block by its norm; a cell with springs on its means has its
/// largest eigenvalue in place of a row sum.
FrequencyBounds network_frequencies(const Network& network);

/// The largest eigenvalue of a symmetric positive semidefinite operator of `size` rows, by Lanczos' method from a fixed
/// start: approached from below, usually to a thousandth after some thirty products. Stops where it has settled to
/// `tolerance`, relative. 0 where there is none above rounding.
double largest_eigenvalue(std::size_t size,
                          const std::function<void(std::span<const double> in, std::span<double> out)>& multiply,
                          int most_products = 200, double tolerance = 1e-5);

} // namespace hybmss
