// Force = minus the gradient of the energy, Hessian = derivative of the force.
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hybmss::testing {
namespace {

constexpr double kCellSize = 0.5;

// Fourth-order central differences: truncation is about (step / h)^4 = 1e-12 of the value; rounding is epsilon times
// the body's energy over (force x step), also about 1e-12.
constexpr double kStep = 1e-3 * kCellSize;
constexpr double kTolerance = 1e-7;

struct Case {
    reference::Body body;
    std::vector<Vector3d> u;
};

/// The cases of one seed: random masks, scales and displacements of 0.1 h.
std::vector<Case> make_cases(const Material& material, SpringForm form, unsigned seed) {
    Random random(seed);
    std::vector<Case> cases;
    for (const auto& [nx, ny, nz] : {std::array{1, 1, 1}, std::array{3, 4, 2}}) {
        const Lattice lattice = random_lattice(nx, ny, nz, kCellSize, random);
        reference::Body body = reference::assemble(lattice, with_springs_on(form, material));
        std::vector<Vector3d> u = random_displacement(body.rest.size(), 0.1 * kCellSize, random);
        cases.push_back({std::move(body), std::move(u)});
    }
    return cases;
}

/// Those of all tests, and springs that stiffen: pressed less than stretched, and alike.
std::vector<Material> stiffening_too() {
    std::vector<Material> all = materials();
    for (const SpringStiffening& law : {SpringStiffening{0.5, 0}, SpringStiffening{-3, 5}, SpringStiffening{0, 20}}) {
        all.push_back(all.front());
        all.back().stiffening = law;
    }
    return all;
}

/// Three seeds of every material and form of springs.
template <class Check>
void for_each_case(unsigned seed, Check check) {
    for (const Material& material : stiffening_too()) {
        for (int round = 0; round < 3; ++round) {
            ++seed;
            for (const SpringForm form : kSpringForms) {
                SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(form) + describe(material));
                for (Case& c : make_cases(material, form, seed)) {
                    check(c);
                }
            }
        }
    }
}

double largest(const std::vector<Vector3d>& field) {
    double most = 0;
    for (const Vector3d& v : field) {
        most = std::max(most, v.norm());
    }
    return most;
}

TEST(Derivatives, ForceIsMinusTheGradientOfTheEnergy) {
    for_each_case(200, [](Case& c) {
        const std::vector<Vector3d> f = reference::forces(c.body, c.u);
        const double scale = largest(f);
        for (std::size_t n = 0; n < c.u.size(); ++n) {
            for (int axis = 0; axis < 3; ++axis) {
                const double at = c.u[n][axis];
                const auto energy = [&](double by) {
                    c.u[n][axis] = at + by;
                    const double total = reference::energy(c.body, c.u).total();
                    c.u[n][axis] = at;
                    return total;
                };
                const double slope =
                    (8 * (energy(kStep) - energy(-kStep)) - (energy(2 * kStep) - energy(-2 * kStep))) / (12 * kStep);
                ASSERT_NEAR(f[n][axis], -slope, kTolerance * scale) << "node " << n << " axis " << axis;
            }
        }
    });
}

TEST(Derivatives, HessianIsMinusTheDerivativeOfTheForce) {
    for_each_case(1300, [](Case& c) {
        const Eigen::MatrixXd hessian = reference::hessian(c.body, c.u);
        const double scale = hessian.cwiseAbs().maxCoeff();
        EXPECT_LE((hessian - hessian.transpose()).cwiseAbs().maxCoeff(), 1e-13 * scale);
        for (std::size_t n = 0; n < c.u.size(); ++n) {
            for (int axis = 0; axis < 3; ++axis) {
                const double at = c.u[n][axis];
                const auto forces = [&](double by) {
                    c.u[n][axis] = at + by;
                    std::vector<Vector3d> f = reference::forces(c.body, c.u);
                    c.u[n][axis] = at;
                    return f;
                };
                const auto f1 = forces(kStep), b1 = forces(-kStep), f2 = forces(2 * kStep), b2 = forces(-2 * kStep);
                const auto column = static_cast<Eigen::Index>(3 * n) + axis;
                for (std::size_t m = 0; m < c.u.size(); ++m) {
                    const Vector3d slope = (8 * (f1[m] - b1[m]) - (f2[m] - b2[m])) / (12 * kStep);
                    const Vector3d block = hessian.block<3, 1>(static_cast<Eigen::Index>(3 * m), column);
                    ASSERT_LE((block + slope).norm(), kTolerance * scale) << "nodes " << m << ", " << n;
                }
            }
        }
    });
}

TEST(Derivatives, HessianProductAndDiagonalAreTheHessians) {
    for_each_case(2300, [](Case& c) {
        Random random(9);
        const std::vector<Vector3d> p = random_displacement(c.u.size(), 1, random);
        const std::vector<Vector3d> product = reference::hessian_product(c.body, c.u, p);
        Eigen::VectorXd direction(3 * static_cast<Eigen::Index>(p.size()));
        for (std::size_t n = 0; n < p.size(); ++n) {
            direction.segment<3>(static_cast<Eigen::Index>(3 * n)) = p[n];
        }
        const Eigen::MatrixXd hessian = reference::hessian(c.body, c.u);
        const Eigen::VectorXd expected = hessian * direction;
        const std::vector<Matrix3d> blocks = reference::hessian_diagonal(c.body, c.u);
        for (std::size_t n = 0; n < p.size(); ++n) {
            ASSERT_LE((product[n] - expected.segment<3>(static_cast<Eigen::Index>(3 * n))).norm(),
                      1e-13 * expected.cwiseAbs().maxCoeff());
            const auto row = static_cast<Eigen::Index>(3 * n);
            ASSERT_LE((blocks[n] - hessian.block<3, 3>(row, row)).norm(), 1e-13 * hessian.cwiseAbs().maxCoeff());
        }
    });
}

} // namespace
} // namespace hybmss::testing
