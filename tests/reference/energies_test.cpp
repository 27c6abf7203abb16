// The energies of a spring and of a cell, with their derivatives.
#include "reference/springs.hpp"
#include "reference/volume_energy.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hybmss::testing {
namespace {

using namespace reference;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

template <class Function>
double central_difference(Function f, double x, double step) {
    return (8 * (f(x + step) - f(x - step)) - (f(x + 2 * step) - f(x - 2 * step))) / (12 * step);
}

TEST(VolumeEnergy, PhiIsTheFormulaOfTheVolumeRatio) {
    for (double j : {0.126, 0.3, 0.9, 1.0, 1.1, 2.0, 5.0}) {
        EXPECT_NEAR(phi(VolumeEnergy::quadratic, j - 1), 0.5 * (j - 1) * (j - 1), 1e-15);
        EXPECT_NEAR(phi(VolumeEnergy::mean_stretch, j - 1), 4.5 * std::pow(std::cbrt(j) - 1, 2), 1e-14);
    }
    EXPECT_DOUBLE_EQ(phi(VolumeEnergy::mean_stretch, 7), 4.5);
    EXPECT_DOUBLE_EQ(phi(VolumeEnergy::mean_stretch, -1), 1.125 + 0.75);
    EXPECT_DOUBLE_EQ(phi(VolumeEnergy::mean_stretch, -2), 1.125 + 6.75);
    EXPECT_EQ(phi(VolumeEnergy::none, 0.5), 0);
    EXPECT_EQ(phi_derivative(VolumeEnergy::none, 0.5), 0);
}

TEST(VolumeEnergy, DerivativesOfPhi) {
    // Fourth-order differences with a step of 1e-4: truncation near 1e-16 phi^(5), rounding near epsilon / 1e-4.
    const double step = 1e-4;
    for (VolumeEnergy energy : kVolumeEnergies) {
        for (double j : {-3.0, -1.0, -0.9, -0.8760, -0.8740, -0.8, -0.5, -0.01, 0.0, 0.01, 0.5, 3.0}) {
            SCOPED_TRACE(j);
            const double first = phi_derivative(energy, j), second = phi_second_derivative(energy, j);
            EXPECT_NEAR(central_difference([&](double x) { return phi(energy, x); }, j, step), first,
                        1e-9 * (1 + std::abs(first)));
            EXPECT_NEAR(central_difference([&](double x) { return phi_derivative(energy, x); }, j, step), second,
                        1e-9 * (1 + std::abs(second)));
            EXPECT_NEAR(central_difference([&](double x) { return phi_second_derivative(energy, x); }, j, step),
                        phi_third_derivative(energy, j), 1e-8 * (1 + std::abs(second)));
        }
        EXPECT_DOUBLE_EQ(phi_second_derivative(energy, 0), 1); // the small-strain moduli
        EXPECT_EQ(phi_derivative(energy, 0), 0);
        EXPECT_EQ(phi(energy, 0), 0);
    }
}

TEST(VolumeEnergy, MeanStretchIsContinuousAtOneEighth) {
    const double kink = -7.0 / 8, before = std::nextafter(kink, -2), after = std::nextafter(kink, 0);
    const VolumeEnergy energy = VolumeEnergy::mean_stretch;
    EXPECT_NEAR(phi(energy, before), phi(energy, after), 1e-14);
    EXPECT_NEAR(phi_derivative(energy, before), phi_derivative(energy, after), 1e-13);
    EXPECT_DOUBLE_EQ(phi_derivative(energy, before), -6);
    EXPECT_EQ(phi_second_derivative(energy, before), 0);
    EXPECT_NEAR(phi_second_derivative(energy, after), 48, 1e-10);
}

TEST(VolumeEnergy, TinyVolumeChangesKeepTheirDigits) {
    for (double j : {1e-3, 1e-7, -1e-7, 1e-12, -1e-15, 1e-200}) {
        // phi' = j - j^2 + 26/27 j^3 + O(j^4), phi = j^2/2 - j^3/3 + O(j^4)
        EXPECT_NEAR(phi_derivative(VolumeEnergy::mean_stretch, j) / j, 1 - j + 26.0 / 27 * j * j,
                    8 * kEpsilon + std::abs(j * j * j));
        EXPECT_EQ(phi_derivative(VolumeEnergy::quadratic, j), j);
    }
    EXPECT_NEAR(phi(VolumeEnergy::mean_stretch, 1e-9) / 1e-18, 0.5, 1e-9);
    // A dilation by 1 + s changes the volume by 3 s + 3 s^2 + s^3, whatever the size of s.
    for (double s : {1e-3, 1e-8, 1e-14}) {
        const double change = volume_ratio_change(0.7 * Matrix3d::Identity(), 0.7 * s * Matrix3d::Identity());
        EXPECT_NEAR(change / (3 * s + 3 * s * s + s * s * s), 1, 16 * kEpsilon);
    }
}

TEST(VolumeEnergy, MeanEdgesAndVolumeOfAnAffineCell) {
    const unsigned seed = 21;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    for (int n = 0; n < 20; ++n) {
        const Matrix3d edges = Matrix3d::Identity() + random.matrix(0.4), change = random.matrix(0.4);
        const Vector3d origin = random.vector(5);
        Corners corners;
        for (std::size_t c = 0; c < 8; ++c) {
            const Vector3d local(static_cast<double>(c & 1), static_cast<double>(c >> 1 & 1),
                                 static_cast<double>(c >> 2));
            corners[c] = origin + edges * local;
        }
        EXPECT_LE((mean_edges(corners) - edges).norm(), 1e-14);
        EXPECT_NEAR(volume(edges), edges.determinant(), 1e-14);
        EXPECT_NEAR(volume_ratio_change(edges, change), (edges + change).determinant() / edges.determinant() - 1,
                    1e-13 / std::abs(volume(edges)));
    }
}

TEST(VolumeEnergy, GradientAndHessianOfTheVolume) {
    const unsigned seed = 22;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Corners x;
    for (std::size_t c = 0; c < 8; ++c) {
        x[c] = Vector3d(static_cast<double>(c & 1), static_cast<double>(c >> 1 & 1), static_cast<double>(c >> 2)) +
               random.vector(0.3);
    }
    const Corners gradient = volume_gradient(mean_edges(x));
    const Matrix24d hessian = volume_hessian(mean_edges(x));
    // V' is a cubic in each coordinate, so the differences are exact up to rounding.
    for (std::size_t c = 0; c < 8; ++c) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto moved = [&](double by) {
                Corners y = x;
                y[c][axis] += by;
                return mean_edges(y);
            };
            EXPECT_NEAR(central_difference([&](double by) { return volume(moved(by)); }, 0, 0.1), gradient[c][axis],
                        1e-13);
            for (std::size_t d = 0; d < 8; ++d) {
                for (int other = 0; other < 3; ++other) {
                    const double difference =
                        central_difference([&](double by) { return volume_gradient(moved(by))[d][other]; }, 0, 0.1);
                    EXPECT_NEAR(difference, hessian(static_cast<int>(3 * d) + other, static_cast<int>(3 * c) + axis),
                                1e-13);
                }
            }
        }
    }
}

TEST(VolumeEnergy, UnitCubeGradientIsAQuarter) {
    // Moving one face's four corners outwards by 1 adds the volume 1: each corner a quarter.
    const Corners gradient = volume_gradient(Matrix3d::Identity());
    EXPECT_EQ(gradient[7], Vector3d(0.25, 0.25, 0.25));
    EXPECT_EQ(gradient[1], Vector3d(0.25, -0.25, -0.25));
    EXPECT_EQ(gradient[1] + gradient[3] + gradient[5] + gradient[7], Vector3d(1, 0, 0));
}

TEST(VolumeEnergy, ForceOfCrushedAndInvertedCellsIsMinusTheGradient) {
    const unsigned seed = 23;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Cell cell{{0, 1, 2, 3, 4, 5, 6, 7}, Matrix3d::Identity(), -2.0};
    for (VolumeEnergy energy : kVolumeEnergies) {
        for (double height : {0.3, 0.14, 0.10, 0.05, 0.0, -0.5}) { // J is about the height: on both sides of 1/8
            Corners u;
            for (std::size_t c = 0; c < 8; ++c) {
                u[c] = Vector3d(0, c >> 1 & 1 ? height - 1 : 0, 0) + random.vector(0.002);
            }
            const Corners forces = cell_forces(energy, cell, u);
            for (std::size_t c = 0; c < 8; ++c) {
                for (int axis = 0; axis < 3; ++axis) {
                    const double slope = central_difference(
                        [&](double by) {
                            Corners v = u;
                            v[c][axis] += by;
                            return cell_energy(energy, cell, v);
                        },
                        0, 1e-4);
                    EXPECT_NEAR(-slope, forces[c][axis], 1e-7 * cell_force_scale(energy, cell, u)) << height;
                }
            }
        }
    }
}

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
    EXPECT_TRUE(std::isfinite(reference::spring_force_scale(7, r, -r, r.cwiseAbs())));
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
                         scale = reference::spring_force_scale(3, r, du, du.cwiseAbs());
            EXPECT_GE(scale, force);
            forces += force;
            scales += scale;
        }
        EXPECT_LT(scales, 8 * forces) << strain;
    }
}

} // namespace
} // namespace hybmss::testing
