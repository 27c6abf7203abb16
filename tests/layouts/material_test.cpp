#include "hybmss/material.hpp"
#include "hybmss/moduli.hpp"
#include "reference/body.hpp"
#include "reference/constants.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hybmss::testing {
namespace {

// A few roundings each.
constexpr double kTolerance = 8 * std::numeric_limits<double>::epsilon();

TEST(Material, HandComputedConstants) {
    // E = 10,000, nu = 1/4: G = 4,000 and kappa = 0. h = 1/2 and A = 1: k_c = 6,000/7, k_f = k_c, k_e = 22,000/7.
    const Material material{1e4, 0.25, 1000, 1};
    EXPECT_DOUBLE_EQ(shear_modulus(material), 4000);
    EXPECT_EQ(volume_modulus(material), 0);
    const SpringConstants k = spring_constants(material, 0.5);
    EXPECT_DOUBLE_EQ(k.cube_diagonal, 6000.0 / 7);
    EXPECT_DOUBLE_EQ(k.face_diagonal, 6000.0 / 7);
    EXPECT_DOUBLE_EQ(k.edge, 22000.0 / 7);
    // nu = 0: G = 5,000, kappa = -G.
    EXPECT_DOUBLE_EQ(volume_modulus({1e4, 0, 1000, 1}), -5000);
}

TEST(Material, LibraryAndReferenceAgree) {
    for (const Material& m : materials()) {
        SCOPED_TRACE(describe(m));
        const double g = reference::shear_modulus(m.young_modulus, m.poisson_ratio), h = 0.3;
        const SpringConstants k = spring_constants(m, h);
        EXPECT_NEAR(shear_modulus(m), g, kTolerance * g);
        const double kappa = reference::kappa(m.young_modulus, m.poisson_ratio);
        EXPECT_NEAR(volume_modulus(m), kappa, kTolerance * std::abs(kappa));
        const double r = m.face_diagonal_ratio;
        EXPECT_NEAR(k.edge, reference::edge_stiffness(g, r, h), kTolerance * k.edge);
        EXPECT_NEAR(k.face_diagonal, reference::face_diagonal_stiffness(g, r, h), kTolerance * k.face_diagonal);
        EXPECT_NEAR(k.cube_diagonal, reference::cube_diagonal_stiffness(g, r, h), kTolerance * k.cube_diagonal);
    }
}

TEST(Material, SpringConstantsAreIsotropicAndCarryTheShearModulus) {
    const double h = 0.7;
    for (const Material& m : materials()) {
        SCOPED_TRACE(describe(m));
        const SpringConstants k = spring_constants(m, h);
        EXPECT_NEAR(k.edge, 8.0 / 3 * k.cube_diagonal + k.face_diagonal, kTolerance * k.edge); // (5.10)
        const double g = shear_modulus(m);
        EXPECT_NEAR((4.0 / 3 * k.cube_diagonal + k.face_diagonal) / h, g, kTolerance * g); // (5.11)
        EXPECT_NEAR(k.face_diagonal, m.face_diagonal_ratio * k.cube_diagonal, kTolerance * k.face_diagonal);
    }
}

/// (5.4) and (5.5): E = G (3 kappa + 5 G) / (kappa + 2 G), nu = (kappa + G) / (2 (kappa + 2 G)), K = kappa + 5/3 G.
TEST(Material, InverseRelationsGiveBackTheModuli) {
    const double e = 2e6;
    for (double nu : kPoissonRatios) {
        SCOPED_TRACE(nu);
        const double g = reference::shear_modulus(e, nu), kappa = reference::kappa(e, nu);
        EXPECT_NEAR(g * (3 * kappa + 5 * g) / (kappa + 2 * g), e, 1e-12 * e);
        EXPECT_NEAR((kappa + g) / (2 * (kappa + 2 * g)), nu, 1e-12);
        const double bulk = e / (3 * (1 - 2 * nu));
        EXPECT_NEAR(kappa + 5 * g / 3, bulk, 1e-12 * bulk);
    }
}

TEST(Material, VolumeEnergyFollowsTheSignOfKappa) {
    for (const auto resolve : {resolved_volume_energy, reference::resolve_volume_energy}) {
        for (double nu : {-0.9, -0.5, 0.0, 0.2499}) {
            EXPECT_EQ(resolve({1e4, nu}), VolumeEnergy::mean_stretch) << nu;
        }
        for (double nu : {0.2501, 0.3, 0.45, 0.4999}) {
            EXPECT_EQ(resolve({1e4, nu}), VolumeEnergy::quadratic) << nu;
        }
        for (VolumeEnergy energy : {VolumeEnergy::automatic, VolumeEnergy::quadratic, VolumeEnergy::mean_stretch}) {
            EXPECT_EQ(resolve({1e4, 0.25, 1000, 1, energy}), VolumeEnergy::none);
        }
        for (VolumeEnergy energy : {VolumeEnergy::quadratic, VolumeEnergy::mean_stretch, VolumeEnergy::none}) {
            EXPECT_EQ(resolve({1e4, 0.0, 1000, 1, energy}), energy);
            EXPECT_EQ(resolve({1e4, 0.4, 1000, 1, energy}), energy);
        }
    }
}

TEST(Material, RefusesWhatIsOutOfRange) {
    const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
    EXPECT_NO_THROW(validate(Material{}));
    EXPECT_NO_THROW(validate({1e-3, -0.999, 1e-3, 0}));
    for (double e : {0.0, -1.0, nan, infinity}) {
        expect_refusal([&] { validate({e, 0.25, 1000, 1}); }, {"young_modulus = ", "not allowed", "above 0"});
    }
    for (double nu : {-1.0, 0.5, 0.7, nan}) {
        expect_refusal([&] { validate({1e4, nu, 1000, 1}); }, {"poisson_ratio = ", "not allowed", "(-1, 0.5)"});
    }
    for (double density : {0.0, -5.0, nan, infinity}) {
        expect_refusal([&] { validate({1e4, 0.25, density, 1}); }, {"density = ", "not allowed", "above 0"});
    }
    for (double ratio : {-0.1, nan, infinity}) {
        expect_refusal([&] { validate({1e4, 0.25, 1000, ratio}); }, {"face_diagonal_ratio = ", "at least 0"});
    }
    expect_refusal([] { validate({-3, 0.25, 1000, 1}); }, {"young_modulus = -3 "});
    expect_refusal([] { validate({1e4, 0.5, 1000, 1}); }, {"poisson_ratio = 0.5 "});
}

double smallest_slope(const SpringStiffening& s) {
    double least = 1;
    for (double e = -1; e <= 5; e += 1e-4) {
        least = std::min(least, 1 + 2 * s.quadratic * e + 3 * s.cubic * e * e);
    }
    return least;
}

// The bounds are exact: on them the force's slope reaches zero at some e >= -1, beyond them it is negative there.
TEST(ElasticModuli, AnyTwoMakeTheSameMaterial) {
    for (const double nu : {-0.7, -0.1, 0.2, 0.3, 0.4999}) {
        const double E = 3.7e4, G = E / (2 * (1 + nu)), K = E / (3 * (1 - 2 * nu)), lame = K - 2 * G / 3;
        const double values[5] = {E, nu, G, K, lame};
        for (int a = 0; a < 5; ++a) {
            for (int b = a + 1; b < 5; ++b) {
                ElasticModuli known;
                std::optional<double>* const members[5] = {&known.young_modulus, &known.poisson_ratio,
                                                           &known.shear_modulus, &known.bulk_modulus,
                                                           &known.lame_modulus};
                *members[a] = values[a];
                *members[b] = values[b];
                const YoungAndPoisson found = young_and_poisson(known);
                // 1 - 2 nu is a difference of numbers of the size of one: rounding of nu counts by its inverse.
                EXPECT_NEAR(found.young_modulus, E, 1e-14 * E / (1 - 2 * nu)) << a << b << nu;
                EXPECT_NEAR(found.poisson_ratio, nu, 1e-14 / (1 - 2 * nu)) << a << b << nu;
            }
        }
    }
    const YoungAndPoisson given = young_and_poisson({.young_modulus = 0.1, .poisson_ratio = 0.3});
    EXPECT_EQ(given.young_modulus, 0.1); // as they are, bit by bit
    EXPECT_EQ(given.poisson_ratio, 0.3);
}

TEST(ElasticModuli, WhatMakesNoMaterialIsRefused) {
    expect_refusal([] { young_and_poisson({.young_modulus = 1}); }, {"1 elastic moduli given", "two of"});
    expect_refusal([] { young_and_poisson({.young_modulus = 1, .poisson_ratio = 0.3, .bulk_modulus = 1}); },
                   {"3 elastic moduli given"});
    expect_refusal([] { young_and_poisson({.young_modulus = 1000, .shear_modulus = 300}); },
                   {"young_modulus = 1000 and shear_modulus = 300", "poisson_ratio = 0.666667", "inside (-1, 0.5)"});
    expect_refusal([] { young_and_poisson({.poisson_ratio = 0.3, .lame_modulus = -1}); }, {"lame_modulus = -1"});
    expect_refusal([] { young_and_poisson({.poisson_ratio = 0.0, .lame_modulus = 0.0}); }, {"lame_modulus = 0"});
    expect_refusal([] { young_and_poisson({.poisson_ratio = std::nan(""), .lame_modulus = 1}); }, {"poisson_ratio"});
}

TEST(SpringStiffening, AllowsWhatLeavesTheEnergyConvex) {
    for (double cubic : {0.0, 0.01, 0.2, 1.0 / 3, 0.5, 3.0, 40.0}) {
        const StiffeningRange range = quadratic_stiffening(cubic);
        EXPECT_LE(range.least, 0);
        EXPECT_GT(range.most, 0);
        for (double edge : {range.least, range.most}) {
            EXPECT_NO_THROW(validate(SpringStiffening{edge, cubic}));
            if (cubic > 0.02) { // else e lies beyond what is looked at
                EXPECT_NEAR(smallest_slope({edge, cubic}), 0, 1e-3);
                EXPECT_LT(smallest_slope({1.01 * edge, cubic}), -1e-3) << edge << " " << cubic;
            }
            const double beyond = edge + (edge <= 0 && edge == range.least ? -1e-3 : 1e-3);
            expect_refusal([&] { validate(SpringStiffening{beyond, cubic}); }, {"stiffening.quadratic = ", "cubic = "});
        }
    }
    const double nan = std::nan("");
    for (double cubic : {-0.1, nan, 1e9}) {
        expect_refusal([&] { validate(SpringStiffening{0, cubic}); }, {"stiffening.cubic = ", "at least 0"});
    }
    expect_refusal([&] { validate(SpringStiffening{nan, 1}); }, {"stiffening.quadratic = ", "not allowed"});
    Material material;
    material.stiffening = {3, 0};
    expect_refusal([&] { validate(material); }, {"stiffening.quadratic = 3 ", "[0, 0.5]"});
}

TEST(SpringStiffening, LargestSlopeInReach) {
    EXPECT_EQ(largest_stiffening({}, 0.5), 1);
    EXPECT_DOUBLE_EQ(largest_stiffening({1, 2}, 0.5), 1 + 1 + 1.5);
    EXPECT_DOUBLE_EQ(largest_stiffening({-1, 2}, 0.5), 1 + 1 + 1.5);
}

} // namespace
} // namespace hybmss::testing
