// Cells that resist being crushed: the energy, its derivatives, and what it leaves alone.
#include "reference/forces.hpp"
#include "reference/homogeneous_lattice.hpp"
#include "reference/volume_energy.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>

namespace hybmss::testing {
namespace {

constexpr double kCellSize = 0.5;

Material resisting(double nu, double beta, double ratio) {
    Material material{1e4, nu};
    material.crush = {beta, ratio};
    return material;
}

reference::Cell cell_of(const Material& material) {
    return reference::assemble(Lattice::box(1, 1, 1, kCellSize), material).cells.at(0);
}

// G V0 beta (J0 - J)^3 / (3 J0^2), J0 = 0.7, also for cells turned inside out.
TEST(CrushResistance, IsTheFormulaBelowItsRatio) {
    const Material material = resisting(0.25, 20, 0.7);
    const reference::Cell cell = cell_of(material);
    for (const double ratio : {0.69, 0.5, 0.1, 0.0, -0.3, -2.0}) {
        const double expected = 4000 * 20 * std::pow(0.7 - ratio, 3) / (3 * 0.49);
        EXPECT_NEAR(volume_energy_density(VolumeEnergy::none, cell, ratio - 1), expected, 1e-12 * expected);
    }
}

// Zero at J0 and above, with two derivatives; from below it gets there without a jump.
TEST(CrushResistance, BeginsWithTwoContinuousDerivatives) {
    const reference::Cell cell = cell_of(resisting(0.25, 20, 0.7));
    for (const double ratio : {0.7, 0.71, 1.0, 3.0}) {
        const auto w = volume_derivatives(VolumeEnergy::none, cell, ratio - 1);
        EXPECT_EQ(volume_energy_density(VolumeEnergy::none, cell, ratio - 1), 0);
        EXPECT_EQ(w.first, 0);
        EXPECT_EQ(w.second, 0);
    }
    const double step = 1e-6;
    const auto w = volume_derivatives(VolumeEnergy::none, cell, 0.7 - step - 1);
    EXPECT_NEAR(w.first, 0, 4000 * 20 * 2.1 * step * step);
    EXPECT_NEAR(w.second, 0, 4000 * 20 * 4.2 * step);
    EXPECT_LT(w.first, 0);
    EXPECT_GT(w.second, 0);
}

// All cells pressed well below J0: the energy's third derivative jumps there. Differences as in derivative_test.cpp.
TEST(CrushResistance, ForceAndHessianAreItsDerivatives) {
    constexpr double kStep = 1e-3 * kCellSize;
    unsigned seed = 40;
    for (const double nu : {-0.3, 0.25, 0.45}) {
        for (const SpringForm form : kSpringForms) {
            Random random(++seed);
            SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(form));
            const Lattice lattice = random_lattice(2, 3, 2, kCellSize, random);
            const reference::Body body = reference::assemble(lattice, with_springs_on(form, resisting(nu, 20, 0.8)));
            const Matrix3d pressed = Vector3d(0.85, 0.9, 0.75).asDiagonal();
            std::vector<Vector3d> u = affine_displacement(body, pressed);
            for (Vector3d& one : u) {
                one += random.vector(0.03 * kCellSize);
            }
            const auto at = [&](std::size_t n, int axis, double by, const auto& measure) {
                const double before = u[n][axis];
                u[n][axis] += by;
                const auto found = measure(body, u);
                u[n][axis] = before;
                return found;
            };
            const std::vector<Vector3d> force = reference::forces(body, u);
            const Eigen::MatrixXd hessian = reference::hessian(body, u);
            double most = 0;
            for (const Vector3d& f : force) {
                most = std::max(most, f.norm());
            }
            for (std::size_t n = 0; n < u.size(); ++n) {
                for (int axis = 0; axis < 3; ++axis) {
                    const auto energy = [&](double by) {
                        return at(n, axis, by,
                                  [](const auto& b, const auto& x) { return reference::energy(b, x).total(); });
                    };
                    const double slope =
                        (8 * (energy(kStep) - energy(-kStep)) - (energy(2 * kStep) - energy(-2 * kStep))) /
                        (12 * kStep);
                    ASSERT_NEAR(force[n][axis], -slope, 1e-7 * most);
                    const auto forces = [&](double by) {
                        return at(n, axis, by, [](const auto& b, const auto& x) { return reference::forces(b, x); });
                    };
                    const auto f1 = forces(kStep), b1 = forces(-kStep), f2 = forces(2 * kStep), b2 = forces(-2 * kStep);
                    for (std::size_t m = 0; m < u.size(); ++m) {
                        const Vector3d column = (8 * (f1[m] - b1[m]) - (f2[m] - b2[m])) / (12 * kStep);
                        const auto row = static_cast<Eigen::Index>(3 * m);
                        ASSERT_LE((column + hessian.block<3, 1>(row, static_cast<Eigen::Index>(3 * n) + axis)).norm(),
                                  1e-7 * hessian.cwiseAbs().maxCoeff());
                    }
                }
            }
        }
    }
}

TEST(CrushResistance, RotationsChangeNothing) {
    Random random(9);
    const reference::Body body = reference::assemble(Lattice::box(3, 2, 2, kCellSize), resisting(0.3, 20, 0.9));
    const Matrix3d pressed = Vector3d(0.8, 1, 0.9).asDiagonal();
    const Matrix3d turn = Eigen::AngleAxisd(2.5, random.direction()).toRotationMatrix();
    const auto before = affine_displacement(body, pressed), after = affine_displacement(body, turn * pressed);
    const double energy = reference::energy(body, before).volume;
    EXPECT_GT(energy, 0);
    EXPECT_NEAR(reference::energy(body, after).volume, energy, 1e-12 * energy);
    const auto f = reference::forces(body, before), g = reference::forces(body, after);
    for (std::size_t n = 0; n < f.size(); ++n) {
        EXPECT_LE((turn * f[n] - g[n]).norm(), 1e-10 * f[0].norm());
    }
}

// A lattice's row of the Hessian and its plane waves agree, as do stress and energy: both know the resistance.
TEST(CrushResistance, HomogeneousLatticesHaveIt) {
    const Matrix3d pressed = 0.8 * Matrix3d::Identity();
    const reference::HomogeneousLattice with(resisting(0.3, 20, 0.7), pressed), without({1e4, 0.3}, pressed);
    const double g = 1e4 / 2.6, depth = 0.7 - 0.512, slope = -g * 20 * depth * depth / 0.49;
    EXPECT_NEAR(with.energy_density() - without.energy_density(), -slope * depth / 3, 1e-9 * g);
    EXPECT_LE((with.stress() - without.stress() - slope * 0.64 * Matrix3d::Identity()).norm(), 1e-9 * g);
    const Vector3d n = Vector3d(1, 2, -1).normalized();
    const double curvature = 2 * g * 20 * depth / 0.49;
    EXPECT_LE(
        (with.acoustic_tensor(n) - without.acoustic_tensor(n) - curvature * 0.64 * 0.64 * n * n.transpose()).norm(),
        1e-9 * g);
}

} // namespace
} // namespace hybmss::testing
