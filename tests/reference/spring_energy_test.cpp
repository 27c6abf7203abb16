#include "tests/random_bodies.hpp"
#include "reference/spring_energy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hybmss::testing {
namespace {

TEST(SpringEnergy, HandComputedStretch) {
    // l = 2 along x, stretched to 3, k = 10: W = 5, the ends pull each other with 10 N.
    const Vector3d r(2, 0, 0), du(1, 0, 0);
    EXPECT_DOUBLE_EQ(reference::elongation(r, du), 1);
    EXPECT_DOUBLE_EQ(reference::spring_energy(10, r, du), 5);
    EXPECT_LE((reference::spring_force(10, r, du) - Vector3d(10, 0, 0)).norm(), 1e-14);
    // Along the spring the stiffness is k, across it k (1 - l/|d|) = 10/3.
    const Vector3d diagonal(10, 10.0 / 3, 10.0 / 3);
    EXPECT_LE((reference::spring_hessian(10, r, du) - Matrix3d(diagonal.asDiagonal())).norm(), 1e-14);
}

TEST(SpringEnergy, CompressionPushesAndTurnsIndefinite) {
    const Vector3d r(0, 0, 1), du(0, 0, -0.5);
    EXPECT_LE((reference::spring_force(2, r, du) - Vector3d(0, 0, -1)).norm(), 1e-15);
    const Vector3d diagonal(-2, -2, 2); // t = -1
    EXPECT_LE((reference::spring_hessian(2, r, du) - Matrix3d(diagonal.asDiagonal())).norm(), 1e-14);
}

TEST(SpringEnergy, CoincidentEndsAreFinite) {
    const Vector3d r(0.3, -0.4, 1.2);
    EXPECT_EQ(reference::spring_force(7, r, -r), Vector3d::Zero());
    EXPECT_TRUE(reference::spring_hessian(7, r, -r).allFinite());
    EXPECT_DOUBLE_EQ(reference::spring_energy(7, r, -r), 0.5 * 7 * 1.3 * 1.3);
    EXPECT_TRUE(std::isfinite(reference::spring_force_scale(7, r, -r)));
    // Close to coincidence the force has the magnitude k l.
    EXPECT_NEAR(reference::spring_force(7, r, -r + Vector3d(1e-9, 0, 0)).norm(), 7 * 1.3, 1e-7);
}

TEST(SpringEnergy, TinyElongationsKeepTheirDigits) {
    // Along the spring the elongation is the displacement itself, at any size.
    for (double size : {1e-3, 1e-7, 1e-12, 1e-18}) {
        const Vector3d r(1, 2, 2);
        EXPECT_NEAR(reference::elongation(r, size * r) / (3 * size), 1, 8 * std::numeric_limits<double>::epsilon());
    }
}

TEST(SpringEnergy, ForceScaleBoundsTheForceAndIsItsSize) {
    const unsigned seed = 11;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    for (double strain : {1e-7, 1e-3, 0.1, 0.5}) {
        double forces = 0, scales = 0;
        for (int n = 0; n < 1000; ++n) {
            const Vector3d r = random.direction(), du = random.vector(strain);
            const double force = reference::spring_force(3, r, du).norm(),
                         scale = reference::spring_force_scale(3, r, du);
            EXPECT_GE(scale, force);
            forces += force;
            scales += scale;
        }
        EXPECT_LT(scales, 8 * forces) << strain;
    }
}

} // namespace
} // namespace hybmss::testing
