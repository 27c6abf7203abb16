// The small-strain moduli that the springs and the volume energy make together, in every direction.
#include "reference/body.hpp"
#include "reference/constants.hpp"
#include "reference/forces.hpp"
#include "reference/volume_energy.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>

namespace hybmss::testing {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// Mandel's notation, in which a fourth-order tensor's double contractions are plain matrix products.
Vector6d mandel(const Matrix3d& e) {
    const double r = std::sqrt(2.0);
    Vector6d v;
    v << e(0, 0), e(1, 1), e(2, 2), r * (e(1, 2) + e(2, 1)) / 2, r * (e(0, 2) + e(2, 0)) / 2,
        r * (e(0, 1) + e(1, 0)) / 2;
    return v;
}

Matrix3d mandel_basis(int n) {
    const double r = std::sqrt(0.5);
    constexpr int kRow[] = {0, 1, 2, 1, 0, 0}, kColumn[] = {0, 1, 2, 2, 2, 1};
    Matrix3d e = Matrix3d::Zero();
    e(kRow[n], kColumn[n]) = e(kColumn[n], kRow[n]) = n < 3 ? 1 : r;
    return e;
}

/// The 13 spring vectors of a cell of edge 1: those that start at a node and come to a later one in index order.
std::vector<Vector3d> spring_vectors() {
    std::vector<Vector3d> vectors;
    for (int z = -1; z <= 1; ++z) {
        for (int y = -1; y <= 1; ++y) {
            for (int x = -1; x <= 1; ++x) {
                if (x + 3 * y + 9 * z > 0) {
                    vectors.emplace_back(x, y, z);
                }
            }
        }
    }
    return vectors;
}

/// C = 1/h^3 sum over the 13 springs of k l^2 n n n n + kappa phi''(1) I I: the exact second derivative of the energy
/// density at rest. (phi'(1) = 0, so the second derivative of J does not enter.)
Matrix6d stiffness_of_the_periodic_lattice(const Material& m, double h) {
    const double g = reference::shear_modulus(m.young_modulus, m.poisson_ratio);
    const double a = m.face_diagonal_ratio;
    Matrix6d c = Matrix6d::Zero();
    for (const Vector3d& v : spring_vectors()) {
        const double axes = v.squaredNorm();
        const double k = axes == 1   ? reference::edge_stiffness(g, a, h)
                         : axes == 2 ? reference::face_diagonal_stiffness(g, a, h)
                                     : reference::cube_diagonal_stiffness(g, a, h);
        const Vector3d n = v.normalized();
        const Vector6d nn = mandel(n * n.transpose());
        c += k * axes * h * h / (h * h * h) * nn * nn.transpose();
    }
    const Vector6d identity = mandel(Matrix3d::Identity());
    return c + reference::kappa(m.young_modulus, m.poisson_ratio) *
                   reference::phi_second_derivative(m.volume_energy, 0) * identity * identity.transpose();
}

/// The same from the energy of a block of cells under X -> (I + e) X. The block's faces have halved and quartered
/// springs, so this asks the shares too.
Matrix6d stiffness_of_a_block(const Material& m, SpringForm form, double h) {
    const Lattice lattice = Lattice::box(3, 2, 4, h);
    const reference::Body body = reference::assemble(lattice, with_springs_on(form, m));
    const double block_volume = 24 * h * h * h;
    // The mean of both signs drops the third derivatives; what is left is of the order of strain^2 = 1e-12 of C, and of
    // the 5000 times smaller shear part of C at nu = 0.4999. The displacement form keeps the energy's digits.
    const double strain = 1e-6;
    const auto curvature = [&](const Matrix3d& e) {
        double sum = 0;
        for (double sign : {1.0, -1.0}) {
            sum += reference::energy(body, affine_displacement(body, Matrix3d::Identity() + sign * strain * e)).total();
        }
        return sum / (strain * strain * block_volume);
    };
    Matrix6d c;
    for (int i = 0; i < 6; ++i) {
        c(i, i) = curvature(mandel_basis(i));
    }
    for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < i; ++j) {
            c(i, j) = c(j, i) = (curvature(mandel_basis(i) + mandel_basis(j)) - c(i, i) - c(j, j)) / 2;
        }
    }
    return c;
}

void expect_isotropic(const Matrix6d& c, const Material& m, double tolerance, Random& random) {
    const Matrix6d compliance = c.inverse();
    const double e = m.young_modulus, nu = m.poisson_ratio;
    const double g = e / (2 * (1 + nu)), bulk = e / (3 * (1 - 2 * nu));
    const Vector6d identity = mandel(Matrix3d::Identity());
    EXPECT_NEAR(1 / (identity.dot(compliance * identity)), bulk, tolerance * bulk);
    for (int n = 0; n < 40; ++n) {
        const Vector3d along = random.direction();
        const Vector3d across = along.cross(random.direction()).normalized();
        const Vector6d pull = mandel(along * along.transpose());
        const Vector6d contraction = mandel(across * across.transpose());
        const Vector6d shear = mandel((along * across.transpose() + across * along.transpose()) / 2);
        const double young = 1 / pull.dot(compliance * pull);
        EXPECT_NEAR(young, e, tolerance * e);
        EXPECT_NEAR(-contraction.dot(compliance * pull) * young, nu, tolerance);
        EXPECT_NEAR(1 / (4 * shear.dot(compliance * shear)), g, tolerance * g);
        // From the energy of the shear e, too: e : C : e = 2 G e : e = G.
        EXPECT_NEAR(shear.dot(c * shear), g, tolerance * g);
    }
}

TEST(Isotropy, PeriodicLattice) {
    const unsigned seed = 31;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    EXPECT_EQ(spring_vectors().size(), 13u);
    for (const Material& m : materials()) {
        SCOPED_TRACE(describe(m));
        expect_isotropic(stiffness_of_the_periodic_lattice(m, 0.3), m, 1e-11, random);
    }
}

TEST(Isotropy, BlockOfCells) {
    const unsigned seed = 32;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    for (const Material& m : materials()) {
        for (const SpringForm form : kSpringForms) {
            SCOPED_TRACE(describe(form) + describe(m));
            expect_isotropic(stiffness_of_a_block(m, form, 0.3), m, 1e-6, random);
        }
    }
}

} // namespace
} // namespace hybmss::testing
