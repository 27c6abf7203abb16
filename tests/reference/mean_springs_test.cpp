// HybMSS-M: what springs on means owe to the energy of the patterns that these do not see. Bending and twisting of bars
// and plates on few cells, no mechanisms, waves.
#include "reference/forces.hpp"
#include "reference/homogeneous_lattice.hpp"
#include "reference/springs.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace hybmss::testing {
namespace {

constexpr double kNu[] = {-0.9, -0.5, 0, 0.25, 0.3, 0.45, 0.499};

Material material(double poisson_ratio, double face_diagonal_ratio = 1) {
    Material m;
    m.poisson_ratio = poisson_ratio;
    m.face_diagonal_ratio = face_diagonal_ratio;
    return m;
}

double shear(const Material& m) {
    return m.young_modulus / (2 * (1 + m.poisson_ratio));
}

Eigen::VectorXd flat(const std::vector<Vector3d>& field) {
    Eigen::VectorXd all(3 * static_cast<Eigen::Index>(field.size()));
    for (std::size_t n = 0; n < field.size(); ++n) {
        all.segment<3>(static_cast<Eigen::Index>(3 * n)) = field[n];
    }
    return all;
}

/// The energy a length of a prismatic body of ny x nz cells of edge 1 along x, for displacements strain(X) plus
/// whatever is the same at all x, and at both z ends too where it is one strip of a plate, and makes the energy least.
/// X counts from the middle.
template <class Strain>
double section_energy(const Material& m, SpringForm form, int ny, int nz, bool plate, const Strain& strain) {
    const Lattice lattice = Lattice::box(1, ny, nz, 1);
    const reference::Body body = reference::assemble(lattice, with_springs_on(form, m));
    std::vector<Vector3d> u(body.rest.size());
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(u.size()), 3 * (ny + 1) * (nz + 1));
    for (int k = 0; k <= nz; ++k) {
        for (int j = 0; j <= ny; ++j) {
            for (int i = 0; i <= 1; ++i) {
                const std::size_t n = lattice.grid_node_index(i, j, k);
                u[n] = strain(body.rest[n] - Vector3d(0.5, ny / 2.0, nz / 2.0));
                const int like = j + (ny + 1) * (plate && k == nz ? 0 : k);
                spread.block<3, 3>(static_cast<Eigen::Index>(3 * n), 3 * like).setIdentity();
            }
        }
    }
    const Eigen::MatrixXd hessian = reference::hessian(body, std::vector<Vector3d>(u.size(), Vector3d::Zero()));
    const Eigen::VectorXd given = flat(u), force = hessian * given;
    const Eigen::MatrixXd reduced = spread.transpose() * hessian * spread; // singular: rigid motions
    const Eigen::VectorXd rest = reduced.completeOrthogonalDecomposition().solve(spread.transpose() * force);
    return given.dot(force) / 2 - rest.dot(spread.transpose() * force) / 2;
}

Vector3d bend(const Vector3d& x) {
    return {-x.x() * x.y(), x.x() * x.x() / 2, 0};
}

/// Stiffness over G J, J/a^4 = 1/3 (1 - 192/pi^5 sum tanh(k pi/2) / k^5) over odd k (Saint-Venant), less 1.
double torsion_error(SpringForm form, int cells) {
    double sum = 0;
    for (int k = 1; k < 100; k += 2) {
        sum += std::tanh(k * std::numbers::pi / 2) / std::pow(k, 5);
    }
    const double j = (1 - 192 / std::pow(std::numbers::pi, 5) * sum) / 3;
    const Material m = material(0.3);
    const double energy = section_energy(m, form, cells, cells, false,
                                         [](const Vector3d& x) { return Vector3d(0, -x.x() * x.z(), x.x() * x.y()); });
    return 2 * energy / (shear(m) * j * std::pow(cells, 4)) - 1;
}

TEST(MeanSprings, BentBarsAndPlatesAreExactOnAnyMesh) {
    for (const double nu : kNu) {
        const Material m = material(nu);
        for (const int n : {1, 2, 3}) {
            const double inertia = std::pow(n, 4) / 12, of_a_plate = std::pow(n, 3) / 12 / (1 - nu * nu);
            EXPECT_NEAR(2 * section_energy(m, SpringForm::means, n, n, false, bend) / (m.young_modulus * inertia), 1,
                        1e-9)
                << "bar, nu = " << nu << ", cells " << n;
            EXPECT_NEAR(2 * section_energy(m, SpringForm::means, n, 1, true, bend) / (m.young_modulus * of_a_plate), 1,
                        1e-9)
                << "plate, nu = " << nu << ", cells " << n;
        }
    }
    // Between nodes the same bar is too stiff: 2/n^2 at nu = 0, where a bar's cells carry nothing but the edges along
    // it.
    EXPECT_GT(2 * section_energy(material(0), SpringForm::nodes, 4, 4, false, bend) / (1e4 * 256 / 12.0), 1.12);
}

TEST(MeanSprings, TwistedPlatesAreExactAndBarsNearly) {
    const auto twist = [](const Vector3d& x) { return Vector3d(-x.y() * x.z(), x.x() * x.z(), -x.y() * x.x()); };
    for (const double nu : kNu) {
        const Material m = material(nu);
        for (const int n : {1, 2, 3}) {
            const double exact = 4 * shear(m) * std::pow(n, 3) / 12;
            EXPECT_NEAR(2 * section_energy(m, SpringForm::means, n, 1, true, twist) / exact, 1, 1e-9) << "nu = " << nu;
        }
    }
    EXPECT_NEAR(torsion_error(SpringForm::means, 2), 0, 1e-8); // the series is cut
    // Of finer bars the warp is not met exactly, and that of one cell is not seen.
    EXPECT_NEAR(torsion_error(SpringForm::means, 1), -0.557, 0.001);
    EXPECT_NEAR(torsion_error(SpringForm::means, 4), 0.0137, 0.0001);
    EXPECT_NEAR(torsion_error(SpringForm::nodes, 1), 0.524, 0.001);
    EXPECT_NEAR(torsion_error(SpringForm::nodes, 4), 0.0771, 0.0001);
}

/// Tip deflection times E a / F under a force spread over the end face; the bar is 1 x 1 x 10, clamped.
double tip_deflection(double nu, int cells) {
    const Lattice lattice = Lattice::box(10 * cells, cells, cells, 1.0 / cells);
    const Material m = material(nu);
    const reference::Body body = reference::assemble(lattice, with_springs_on(SpringForm::means, m));
    const std::size_t nodes = body.rest.size();
    Eigen::SparseMatrix<double> hessian = reference::hessian(body, std::vector<Vector3d>(nodes, Vector3d::Zero()));
    std::vector<Vector3d> load(nodes, Vector3d::Zero());
    for (std::size_t n = 0; n < nodes; ++n) {
        const Vector3d& x = body.rest[n];
        const auto share = [](double y) { return y < 1e-9 || y > 1 - 1e-9 ? 0.5 : 1.0; };
        if (x.x() > 10 - 1e-9) {
            load[n].y() = share(x.y()) * share(x.z()) / (cells * cells);
        } else if (x.x() < 1e-9) {
            for (Eigen::Index axis = 0; axis < 3; ++axis) {
                hessian.coeffRef(static_cast<Eigen::Index>(3 * n) + axis, static_cast<Eigen::Index>(3 * n) + axis) *=
                    1e9;
            }
        }
    }
    const Eigen::VectorXd f = flat(load);
    return m.young_modulus * f.dot(Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(hessian).solve(f));
}

TEST(MeanSprings, CantileversAreNearlyConvergedOnOneCellAcross) {
    // Extrapolated from 8, 12 and 16 cells across, of several forms that agree to 0.01 %; Timoshenko's beam, whose
    // clamp lets the section contract, has 4024 at nu = 0.
    for (const auto& [nu, converged] : {std::pair{0.0, 4024.05}, {0.3, 4004.2}, {0.45, 3970.9}, {-0.5, 3930.9}}) {
        EXPECT_NEAR(converged / tip_deflection(nu, 1), 1, 0.02) << nu;
        EXPECT_NEAR(converged / tip_deflection(nu, 2), 1, 0.018) << nu;
    }
}

TEST(MeanSprings, NothingButRigidMotionsIsFreeAtRest) {
    for (const double nu : kNu) {
        for (const double ratio : {0.0, 0.1, 1.0}) {
            for (const auto& [nx, ny, nz] :
                 {std::array{1, 1, 1}, {2, 1, 1}, {5, 1, 1}, {2, 2, 1}, {2, 2, 2}, {3, 3, 1}}) {
                SCOPED_TRACE("nu = " + std::to_string(nu) + ", A = " + std::to_string(ratio) + ", cells " +
                             std::to_string(100 * nx + 10 * ny + nz));
                const reference::Body body = reference::assemble(
                    Lattice::box(nx, ny, nz, 0.5), with_springs_on(SpringForm::means, material(nu, ratio)));
                const Eigen::MatrixXd hessian =
                    reference::hessian(body, std::vector<Vector3d>(body.rest.size(), Vector3d::Zero()));
                const Eigen::VectorXd values =
                    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(hessian, Eigen::EigenvaluesOnly).eigenvalues();
                EXPECT_LE(std::abs(values[0]), 1e-12 * values[values.size() - 1]);
                EXPECT_LE(std::abs(values[5]), 1e-12 * values[values.size() - 1]);
                EXPECT_GE(values[6], 0.001 * shear(material(nu)) * 0.5);
            }
        }
    }
}

TEST(MeanSprings, AtRestTheRatioDoesNotMatter) {
    for (const double nu : kNu) {
        const Lattice lattice = Lattice::box(2, 1, 1, 0.5);
        const auto hessian_at_rest = [&](double ratio) {
            const reference::Body body =
                reference::assemble(lattice, with_springs_on(SpringForm::means, material(nu, ratio)));
            return Eigen::MatrixXd(reference::hessian(body, std::vector<Vector3d>(body.rest.size(), Vector3d::Zero())));
        };
        const Eigen::MatrixXd without = hessian_at_rest(0);
        EXPECT_LE((hessian_at_rest(10) - without).norm(), 1e-13 * without.norm());
    }
}

/// visit(phases) on a grid of one octant of the Brillouin zone.
template <class Visit>
void for_each_wave(const Visit& visit) {
    for (int n = 1; n < 216; ++n) {
        visit(std::numbers::pi / 5 * Vector3d(n % 6, n / 6 % 6, n / 36));
    }
}

TEST(MeanSprings, WavesAreHeldUnderLargeStrain) {
    // Relative to a plain grid of stiffness G, as the stability map has it (studies/stability/stability_map.hpp).
    const auto least = [](const Material& m, SpringForm form, const Vector3d& stretches) {
        double weakest = 1;
        const reference::HomogeneousLattice lattice(with_springs_on(form, m), stretches.asDiagonal());
        for_each_wave([&](const Vector3d& q) {
            const Eigen::Array3d sine = (q / 2).array().sin();
            const Matrix3d d = lattice.wave_stiffness(q);
            const double value = Eigen::SelfAdjointEigenSolver<Matrix3d>(d, Eigen::EigenvaluesOnly).eigenvalues()[0];
            weakest = std::min(weakest, value / (shear(m) * 4 * sine.square().sum()));
        });
        return weakest;
    };
    for (const double ratio : {0.0, 1.0}) {
        for (const double nu : kNu) {
            EXPECT_GT(least(material(nu, ratio), SpringForm::means, {1, 1, 1}), 0.08) << nu;
        }
        for (const double stretch : {0.8, 0.9, 1.2, 1.5}) {
            for (const double nu : {0.0, 0.25, 0.499}) {
                EXPECT_GT(least(material(nu, ratio), SpringForm::means, {1, stretch, 1}), 0.1) << nu << " " << stretch;
            }
        }
    }
    // Where springs between nodes without face diagonals have nothing left.
    EXPECT_LT(least(material(0.25, 0), SpringForm::nodes, {1, 0.8, 1}), -0.1);
}

/// A wave moves each of a node's eight cells like a part of the body: 1/8 of the wave's stiffness a node is at most the
/// largest eigenvalue of a cell. So a cell bounds the stable step of all bodies.
TEST(MeanSprings, ACellBoundsTheStiffestWave) {
    for (const double nu : kNu) {
        const Material m = material(nu);
        const auto largest = [&](SpringForm form) {
            const reference::Body cell = reference::assemble(Lattice::box(1, 1, 1, 1), with_springs_on(form, m));
            const Eigen::MatrixXd hessian = reference::hessian(cell, std::vector<Vector3d>(8, Vector3d::Zero()));
            return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(hessian, Eigen::EigenvaluesOnly).eigenvalues()[23];
        };
        const reference::HomogeneousLattice lattice(with_springs_on(SpringForm::means, m), Matrix3d::Identity());
        double stiffest = 0;
        for_each_wave([&](const Vector3d& q) {
            const Matrix3d d = lattice.wave_stiffness(q);
            stiffest =
                std::max(stiffest, Eigen::SelfAdjointEigenSolver<Matrix3d>(d, Eigen::EigenvaluesOnly).eigenvalues()[2]);
        });
        EXPECT_LE(stiffest, 8 * largest(SpringForm::means) * (1 + 1e-12)) << nu;
        // Against springs between nodes: the same from nu = 1/4 on, below by at most 4 %.
        EXPECT_NEAR(largest(SpringForm::means) / largest(SpringForm::nodes), nu < 0.25 ? 1.04 : 1, 0.005) << nu;
    }
}

} // namespace
} // namespace hybmss::testing
