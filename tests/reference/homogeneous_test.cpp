// The lattice under X -> F X: its energy is that of its cells, its interior is in equilibrium; and plane waves on it,
// against the Hessian of a finite one and known cases.
#include "reference/body.hpp"
#include "reference/constants.hpp"
#include "reference/forces.hpp"
#include "reference/homogeneous_lattice.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

namespace hybmss::testing {
namespace {

// Roundings of a sum of some hundred positive terms.
constexpr double kTolerance = 1e-12;

Matrix3d random_deformation(Random& random) {
    const Matrix3d rotation = Eigen::AngleAxisd(random.between(0, 3), random.direction()).toRotationMatrix();
    return rotation * (Matrix3d::Identity() + random.matrix(0.3));
}

/// One cell's springs at full stiffness: sum over the 13 spring vectors of 1/2 k (|F r| - |r|)^2.
double cell_spring_energy(const Material& m, double h, const Matrix3d& f) {
    const double g = m.young_modulus / (2 * (1 + m.poisson_ratio)), a = m.face_diagonal_ratio;
    const double cube = 3 * g * h / (4 + 3 * a), edge = 8.0 / 3 * cube + a * cube;
    double sum = 0;
    for (int z = -1; z <= 1; ++z) {
        for (int y = -1; y <= 1; ++y) {
            for (int x = -1; x <= 1; ++x) {
                if (x + 3 * y + 9 * z > 0) {
                    const Vector3d r = h * Vector3d(x, y, z);
                    const int axes = x * x + y * y + z * z;
                    const double k = axes == 1 ? edge : axes == 2 ? a * cube : cube;
                    sum += 0.5 * k * std::pow((f * r).norm() - r.norm(), 2);
                }
            }
        }
    }
    return sum;
}

/// V0 kappa phi(det F)
double cell_volume_energy(const Material& m, double h, const Matrix3d& f) {
    const double kappa =
        m.young_modulus / (2 * (1 + m.poisson_ratio)) * (4 * m.poisson_ratio - 1) / (1 - 2 * m.poisson_ratio);
    const double j = f.determinant();
    if (m.volume_energy == VolumeEnergy::quadratic) {
        return h * h * h * kappa * (j - 1) * (j - 1) / 2;
    }
    const double phi = j < 0.125 ? 1.125 - 6 * (j - 0.125) : 4.5 * std::pow(std::cbrt(j) - 1, 2);
    return h * h * h * kappa * phi;
}

TEST(HomogeneousDeformation, EnergyIsTheSumOfTheCellsEnergies) {
    unsigned seed = 500;
    const double h = 0.3;
    for (const Material& m : materials()) {
        SCOPED_TRACE("seed " + std::to_string(++seed) + ", " + describe(m));
        Random random(seed);
        for (const bool box : {true, false}) {
            const Lattice lattice = box ? Lattice::box(4, 3, 5, h) : random_lattice(4, 3, 5, h, random, 0.4);
            double scales = 0;
            for (float s : lattice.cell_scales()) {
                scales += static_cast<double>(s);
            }
            for (int n = 0; n < 6; ++n) {
                const reference::Body body = reference::assemble(lattice, with_springs_on(kSpringForms[n % 2], m));
                const Matrix3d f = random_deformation(random);
                const reference::Energy energy = reference::energy(body, affine_displacement(body, f, {5, -3, 2}));
                const double springs = scales * cell_spring_energy(m, h, f);
                const double volume = scales * cell_volume_energy(m, h, f);
                EXPECT_NEAR(energy.springs, springs, kTolerance * springs);
                EXPECT_NEAR(energy.volume, volume, kTolerance * (std::abs(volume) + springs));
            }
        }
    }
}

TEST(HomogeneousDeformation, InteriorIsInEquilibrium) {
    unsigned seed = 600;
    for (const Material& m : materials()) {
        SCOPED_TRACE("seed " + std::to_string(++seed) + ", " + describe(m));
        Random random(seed);
        const Lattice lattice = Lattice::box(4, 4, 3, 0.3);
        for (const SpringForm form : kSpringForms) {
            SCOPED_TRACE(describe(form));
            const reference::Body body = reference::assemble(lattice, with_springs_on(form, m));
            const std::vector<Vector3d> u = affine_displacement(body, random_deformation(random));
            const std::vector<Vector3d> f = reference::forces(body, u);
            const std::vector<double> scale = reference::force_scale(body, u);
            for (int k = 0; k <= 3; ++k) {
                for (int j = 0; j <= 4; ++j) {
                    for (int i = 0; i <= 4; ++i) {
                        const std::size_t n = lattice.grid_node_index(i, j, k);
                        const bool inside = i > 0 && i < 4 && j > 0 && j < 4 && k > 0 && k < 3;
                        if (inside) {
                            EXPECT_LE(f[n].norm(), 1e-14 * scale[n]);
                        } else {
                            EXPECT_GT(f[n].norm(), 1e-5 * scale[n]);
                        }
                    }
                }
            }
        }
    }
}

TEST(HomogeneousDeformation, UniformDilationOfTheMeanStretchEnergy) {
    // (15 G / 2 + 9 kappa / 2) (s - 1)^2 per volume down to s = 1/2; the springs' part is 15 G / 2 with either energy.
    const double h = 0.3;
    const Lattice lattice = Lattice::box(2, 3, 2, h);
    const double block_volume = 12 * h * h * h;
    for (const Material& m : materials()) {
        SCOPED_TRACE(describe(m));
        const double g = reference::shear_modulus(m.young_modulus, m.poisson_ratio);
        const double kappa = reference::kappa(m.young_modulus, m.poisson_ratio);
        const reference::Body body = reference::assemble(lattice, m);
        for (double s : {0.501, 0.7, 0.999, 1.2, 2.0, 4.0}) {
            const auto energy = reference::energy(body, affine_displacement(body, s * Matrix3d::Identity()));
            const double square = (s - 1) * (s - 1) * block_volume;
            EXPECT_NEAR(energy.springs, 7.5 * g * square, kTolerance * energy.springs);
            if (m.volume_energy == VolumeEnergy::mean_stretch) {
                const double total = (7.5 * g + 4.5 * kappa) * square;
                EXPECT_NEAR(energy.total(), total, kTolerance * (energy.springs + std::abs(energy.volume)));
                EXPECT_GT(energy.total(), 0);
            }
        }
    }
}

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
        for (const SpringForm form : kSpringForms) {
            const reference::Body body = reference::assemble(Lattice::box(2, 2, 2, 1), with_springs_on(form, m));
            const Matrix3d f = Matrix3d::Identity() + random.matrix(0.3);
            const auto hessian = reference::hessian(body, affine_displacement(body, f, Vector3d::Zero()));
            const HomogeneousLattice lattice(with_springs_on(form, m), f);
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
}

TEST(HomogeneousLattice, LongWavesSeeTheAcousticTensor) {
    Random random(710);
    for (const Material& m : materials()) {
        for (const SpringForm form : kSpringForms) {
            const HomogeneousLattice lattice(with_springs_on(form, m), Matrix3d::Identity() + random.matrix(0.2));
            const Vector3d n = random.direction();
            const Matrix3d limit = lattice.acoustic_tensor(n);
            // 1 - cos q leaves a relative error of q^2 r^2 / 12 with r^2 <= 3.
            EXPECT_NEAR((lattice.wave_stiffness(1e-4 * n) / 1e-8 - limit).norm(), 0, 1e-8 * limit.norm())
                << describe(m);
        }
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
            EXPECT_NEAR(speeds[2], kappa + 5 * g / 3 + 4 * g / 3, tolerance);
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
