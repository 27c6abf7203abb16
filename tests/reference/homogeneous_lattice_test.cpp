// Plane waves on the homogeneously deformed, infinite lattice, against the Hessian of a finite one and known cases.
#include "tests/random_bodies.hpp"
#include "reference/assembly.hpp"
#include "reference/constants.hpp"
#include "reference/forces.hpp"
#include "reference/homogeneous_lattice.hpp"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

namespace hybmss::testing {
namespace {

using reference::HomogeneousLattice;

Material material(double poisson_ratio, double face_diagonal_ratio,
                  VolumeEnergy volume_energy = VolumeEnergy::automatic) {
    Material m;
    m.poisson_ratio = poisson_ratio;
    m.face_diagonal_ratio = face_diagonal_ratio;
    m.volume_energy = volume_energy;
    return m;
}

double shear(const Material& m) {
    return reference::shear_modulus(m.young_modulus, m.poisson_ratio);
}

Vector3d eigenvalues(const Matrix3d& matrix) {
    return Eigen::SelfAdjointEigenSolver<Matrix3d>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

/// D(q) U is what a wave does to the middle node of 2^3 cells, all of whose neighbours are there.
TEST(HomogeneousLattice, WaveStiffnessIsARowOfTheHessian) {
    unsigned seed = 700;
    for (const Material& m : materials()) {
        SCOPED_TRACE("seed " + std::to_string(++seed) + ", " + describe(m));
        Random random(seed);
        const reference::Body body = reference::assemble(Lattice::box(2, 2, 2, 1), m);
        const Matrix3d f = Matrix3d::Identity() + random.matrix(0.3);
        const auto hessian = reference::hessian(body, affine_displacement(body, f, Vector3d::Zero()));
        const HomogeneousLattice lattice(m, f);
        const Eigen::Index middle = 13;
        for (int n = 0; n < 5; ++n) {
            const Vector3d phase = random.vector(std::numbers::pi);
            Eigen::Matrix3cd expected = Eigen::Matrix3cd::Zero();
            for (Eigen::Index node = 0; node < 27; ++node) {
                const auto index = static_cast<std::size_t>(node);
                const double angle = phase.dot(body.rest[index] - body.rest[static_cast<std::size_t>(middle)]);
                expected += Matrix3d(hessian.block(3 * middle, 3 * node, 3, 3)).cast<std::complex<double>>() *
                            std::polar(1.0, angle);
            }
            // Sums of some hundred terms of the size of the diagonal block.
            const double tolerance = 1e-13 * Matrix3d(hessian.block(3 * middle, 3 * middle, 3, 3)).norm();
            const Matrix3d computed = lattice.wave_stiffness(phase);
            EXPECT_NEAR((computed - expected.real()).norm(), 0, tolerance);
            EXPECT_NEAR(expected.imag().norm(), 0, tolerance);
        }
    }
}

TEST(HomogeneousLattice, LongWavesSeeTheAcousticTensor) {
    Random random(710);
    for (const Material& m : materials()) {
        const HomogeneousLattice lattice(m, Matrix3d::Identity() + random.matrix(0.2));
        const Vector3d n = random.direction();
        const Matrix3d limit = lattice.acoustic_tensor(n);
        // 1 - cos q leaves a relative error of q^2 r^2 / 12 with r^2 <= 3.
        EXPECT_NEAR((lattice.wave_stiffness(1e-4 * n) / 1e-8 - limit).norm(), 0, 1e-8 * limit.norm()) << describe(m);
    }
}

TEST(HomogeneousLattice, StressIsTheDerivativeOfTheEnergy) {
    Random random(720);
    for (const Material& m : materials()) {
        const Matrix3d f = Matrix3d::Identity() + random.matrix(0.3), change = random.matrix(1);
        const double step = 1e-5;
        const double slope = (HomogeneousLattice(m, f + step * change).energy_density() -
                              HomogeneousLattice(m, f - step * change).energy_density()) /
                             (2 * step);
        const double computed = HomogeneousLattice(m, f).stress().cwiseProduct(change).sum();
        // Central differences: step^2 and epsilon / step.
        EXPECT_NEAR(computed, slope, 1e-8 * (std::abs(slope) + m.young_modulus)) << describe(m);
    }
}

/// Isotropic at rest: rho c^2 is G for transverse and K + 4G/3 for longitudinal waves, in every direction, for every A.
TEST(HomogeneousLattice, LongWavesAtRestAreThoseOfLinearElasticity) {
    Random random(730);
    for (const double nu : {-0.9, 0.0, 0.25, 0.4999}) {
        for (const double ratio : {0.0, 0.1, 1.0, 10.0}) {
            const Material m = material(nu, ratio);
            const double g = shear(m), kappa = reference::kappa(m.young_modulus, nu);
            const Vector3d speeds =
                eigenvalues(HomogeneousLattice(m, Matrix3d::Identity()).acoustic_tensor(random.direction()));
            const double tolerance = 1e-12 * (g + std::abs(kappa));
            EXPECT_NEAR(speeds[0], g, tolerance);
            EXPECT_NEAR(speeds[1], g, tolerance);
            EXPECT_NEAR(speeds[2], reference::bulk_modulus(g, kappa) + 4 * g / 3, tolerance);
        }
    }
}

/// Without face diagonals, columns of nodes glide past each other: the wave (pi, pi, 0) along z has no stiffness.
TEST(HomogeneousLattice, OnlyFaceDiagonalsHoldTheCheckerboard) {
    const Vector3d checkerboard(std::numbers::pi, std::numbers::pi, 0);
    for (const double nu : {-0.5, 0.25, 0.49}) {
        const Material bare = material(nu, 0), full = material(nu, 1);
        EXPECT_NEAR(eigenvalues(HomogeneousLattice(bare, Matrix3d::Identity()).wave_stiffness(checkerboard))[0], 0,
                    1e-12 * shear(bare));
        EXPECT_GT(eigenvalues(HomogeneousLattice(full, Matrix3d::Identity()).wave_stiffness(checkerboard))[0],
                  shear(full));
        // The edges' tension alone is left: 4 k_e t, negative under the least compression along x.
        const double stretch = 0.999, edge = 2 * shear(bare);
        const Matrix3d pressed = Vector3d(stretch, 1, 1).asDiagonal();
        EXPECT_NEAR(HomogeneousLattice(bare, pressed).wave_stiffness(checkerboard)(2, 2), 4 * edge * (1 - 1 / stretch),
                    1e-12 * edge);
    }
}

/// Uniform dilation by s: W = 15/2 G (s - 1)^2 + kappa phi(s^3); with mean stretch that is 9/2 K (s - 1)^2.
TEST(HomogeneousLattice, DilationFollowsItsClosedForms) {
    for (const double s : {0.6, 0.9, 1.1, 1.5}) {
        for (const double ratio : {0.0, 1.0}) {
            const Material quadratic = material(0, ratio, VolumeEnergy::quadratic), mean = material(0, ratio);
            const double g = shear(mean), volume = s * s * s - 1, bulk = 2 * g / 3; // K at nu = 0
            EXPECT_NEAR(HomogeneousLattice(quadratic, s * Matrix3d::Identity()).energy_density(),
                        7.5 * g * (s - 1) * (s - 1) - g * volume * volume / 2, 1e-12 * g);
            EXPECT_NEAR(HomogeneousLattice(mean, s * Matrix3d::Identity()).energy_density(),
                        4.5 * bulk * (s - 1) * (s - 1), 1e-12 * g);
        }
    }
}

} // namespace
} // namespace hybmss::testing
