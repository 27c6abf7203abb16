// What no motion of the whole and no naming of the axes can change.
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hybmss::testing {
namespace {

constexpr double kCellSize = 0.5;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

double sum(const std::vector<double>& values) {
    double total = 0;
    for (double v : values) {
        total += v;
    }
    return total;
}

template <class Check>
void for_each_body(unsigned seed, Check check) {
    for (const Material& material : materials()) {
        ++seed;
        for (const SpringForm form : kSpringForms) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(form) + describe(material));
            Random random(seed);
            const Lattice lattice = random_lattice(3, 4, 2, kCellSize, random);
            check(reference::assemble(lattice, with_springs_on(form, material)), random);
        }
    }
}

std::vector<Matrix3d> rotations(Random& random) {
    std::vector<Matrix3d> all;
    for (int axis = 0; axis < 3; ++axis) {
        for (double angle : {std::numbers::pi / 2, std::numbers::pi}) {
            all.push_back(Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix());
        }
    }
    for (int n = 0; n < 3; ++n) {
        all.push_back(Eigen::AngleAxisd(random.between(1, 3), random.direction()).toRotationMatrix());
    }
    return all;
}

TEST(Invariance, FreeBodiesHaveNoTotalForceAndTorque) {
    for_each_body(700, [](const reference::Body& body, Random& random) {
        for (double strain : {1e-6, 0.1, 0.5}) {
            const std::vector<Vector3d> u = random_displacement(body.rest.size(), strain * kCellSize, random);
            const std::vector<Vector3d> f = reference::forces(body, u);
            const double scale = sum(reference::force_scale(body, u));
            Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
            for (std::size_t n = 0; n < f.size(); ++n) {
                force += f[n];
                torque += (body.rest[n] + u[n]).cross(f[n]);
            }
            EXPECT_LE(force.norm(), 4 * kEpsilon * scale);
            EXPECT_LE(torque.norm(), 4 * kEpsilon * scale * 4 * kCellSize);
        }
    });
}

TEST(Invariance, RigidMotionsCostNothing) {
    for_each_body(800, [](const reference::Body& body, Random& random) {
        for (const Matrix3d& rotation : rotations(random)) {
            // Displacements up to some 20 h are rounded to epsilon times that, against edges that turn by about h:
            // forces of 64 epsilon and more, energies of the square.
            const std::vector<Vector3d> u = affine_displacement(body, rotation, random.vector(10 * kCellSize));
            const std::vector<Vector3d> f = reference::forces(body, u);
            const std::vector<double> scale = reference::force_scale(body, u);
            for (std::size_t n = 0; n < f.size(); ++n) {
                EXPECT_LE(f[n].norm(), 256 * kEpsilon * scale[n]);
            }
            const double work = sum(scale) * kCellSize;
            EXPECT_LE(std::abs(reference::energy(body, u).springs), 1e-24 * work);
            EXPECT_LE(std::abs(reference::energy(body, u).volume), 1e-24 * work);
        }
    });
}

TEST(Invariance, ForcesTurnWithTheBody) {
    for_each_body(900, [](const reference::Body& body, Random& random) {
        const std::vector<Vector3d> u = random_displacement(body.rest.size(), 0.2 * kCellSize, random);
        const std::vector<Vector3d> f = reference::forces(body, u);
        const reference::Energy energy = reference::energy(body, u);
        for (const Matrix3d& rotation : rotations(random)) {
            const Vector3d t = random.vector(10 * kCellSize);
            std::vector<Vector3d> moved;
            for (std::size_t n = 0; n < u.size(); ++n) {
                moved.push_back(rotation * (body.rest[n] + u[n]) + t - body.rest[n]);
            }
            const std::vector<Vector3d> turned = reference::forces(body, moved);
            const std::vector<double> scale = reference::force_scale(body, moved);
            for (std::size_t n = 0; n < u.size(); ++n) {
                EXPECT_LE((turned[n] - rotation * f[n]).norm(), 256 * kEpsilon * scale[n]);
            }
            const reference::Energy same = reference::energy(body, moved);
            EXPECT_NEAR(same.springs, energy.springs, 1e-12 * energy.springs);
            EXPECT_NEAR(same.volume, energy.volume, 1e-11 * std::abs(energy.volume));
        }
    });
}

TEST(Invariance, CoincidentNodesHaveFiniteForces) {
    const auto expect_finite = [](const reference::Body& body, const std::vector<Vector3d>& u) {
        for (const Vector3d& f : reference::forces(body, u)) {
            EXPECT_TRUE(f.allFinite());
        }
        for (double scale : reference::force_scale(body, u)) {
            EXPECT_TRUE(std::isfinite(scale));
        }
        EXPECT_TRUE(std::isfinite(reference::energy(body, u).total()));
        EXPECT_TRUE(Eigen::MatrixXd(reference::hessian(body, u)).allFinite());
    };
    for (const Material& material : materials()) {
        for (const SpringForm form : kSpringForms) {
            SCOPED_TRACE(describe(form) + describe(material));
            const reference::Body body =
                reference::assemble(Lattice::box(2, 1, 1, kCellSize), with_springs_on(form, material));
            for (const reference::Spring& spring : body.springs) {
                std::vector<Vector3d> u(body.rest.size(), Vector3d::Zero());
                u[static_cast<std::size_t>(spring.b)] = -spring.rest_vector;
                expect_finite(body, u);
            }
            std::vector<Vector3d> collapsed;
            for (const Vector3d& x : body.rest) {
                collapsed.push_back(-x);
            }
            expect_finite(body, collapsed);
        }
    }
}

TEST(Invariance, PermutedAxesGivePermutedForces) {
    unsigned seed = 1000;
    const auto check = [&](const Material& material, SpringForm form) {
        Random random(seed);
        const std::array<int, 3> size{3, 4, 2};
        const Lattice lattice = random_lattice(size[0], size[1], size[2], kCellSize, random);
        const reference::Body body = reference::assemble(lattice, with_springs_on(form, material));
        const std::vector<Vector3d> u = random_displacement(body.rest.size(), 0.2 * kCellSize, random);
        const std::vector<Vector3d> f = reference::forces(body, u);
        const std::vector<double> scale = reference::force_scale(body, u);

        std::array<std::size_t, 3> order{0, 1, 2}; // axis a of the permuted body is axis order[a] of the first
        while (std::next_permutation(order.begin(), order.end())) {
            const auto permuted = [&](const Vector3d& v) {
                return Vector3d(v[static_cast<int>(order[0])], v[static_cast<int>(order[1])],
                                v[static_cast<int>(order[2])]);
            };
            Lattice other = Lattice::box(size[order[0]], size[order[1]], size[order[2]], kCellSize);
            for (int k = 0; k < size[2]; ++k) {
                for (int j = 0; j < size[1]; ++j) {
                    for (int i = 0; i < size[0]; ++i) {
                        const std::array<int, 3> cell{i, j, k};
                        other.set_cell_scale(cell[order[0]], cell[order[1]], cell[order[2]],
                                             lattice.cell_scale(i, j, k));
                    }
                }
            }
            const reference::Body other_body = reference::assemble(other, with_springs_on(form, material));
            ASSERT_EQ(other_body.rest.size(), body.rest.size());
            std::vector<std::size_t> image;
            std::vector<Vector3d> other_u(u.size());
            for (std::size_t n = 0; n < u.size(); ++n) {
                const auto at = std::find(other_body.rest.begin(), other_body.rest.end(), permuted(body.rest[n]));
                ASSERT_NE(at, other_body.rest.end());
                image.push_back(static_cast<std::size_t>(at - other_body.rest.begin()));
                other_u[image[n]] = permuted(u[n]);
            }
            const std::vector<Vector3d> other_f = reference::forces(other_body, other_u);
            for (std::size_t n = 0; n < u.size(); ++n) {
                EXPECT_LE((other_f[image[n]] - permuted(f[n])).norm(), 8 * kEpsilon * scale[n]);
            }
        }
    };
    for (const Material& material : materials()) {
        ++seed;
        for (const SpringForm form : kSpringForms) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", " + describe(form) + describe(material));
            check(material, form);
        }
    }
}

} // namespace
} // namespace hybmss::testing
