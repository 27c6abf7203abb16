// The lattice under X -> F X: its energy is that of its cells, its interior is in equilibrium.
#include "tests/random_bodies.hpp"
#include "reference/assembly.hpp"
#include "reference/constants.hpp"
#include "reference/forces.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include <cmath>

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
            const reference::Body body = reference::assemble(lattice, m);
            for (int n = 0; n < 3; ++n) {
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
        const reference::Body body = reference::assemble(lattice, m);
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

} // namespace
} // namespace hybmss::testing
