// Forces keep their digits at tiny strains: against the position form, straight from the equations, in long double.
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::testing {
namespace {

using Vector3l = Eigen::Matrix<long double, 3, 1>;
using Matrix3l = Eigen::Matrix<long double, 3, 3>;

long double side(std::size_t corner, int axis) {
    return corner >> axis & 1 ? 1.0L : -1.0L;
}

/// Springs on means, each spring and each pair of patterns by itself.
void add_mean_spring_forces(const reference::MeanSprings& cell, const std::vector<Vector3l>& x,
                            std::vector<Vector3l>& f) {
    using Weights = Eigen::Matrix<long double, 8, 1>;
    const auto h = static_cast<long double>(cell.cell_size);
    Eigen::Matrix<long double, 3, 8> corners;
    Weights s[3];
    for (int c = 0; c < 8; ++c) {
        corners.col(c) = x[static_cast<std::size_t>(cell.nodes[static_cast<std::size_t>(c)])];
        for (int axis = 0; axis < 3; ++axis) {
            s[axis][c] = side(static_cast<std::size_t>(c), axis);
        }
    }
    const Weights a[3] = {s[0] / 4, s[1] / 4, s[2] / 4};
    const Weights g[3] = {s[1].cwiseProduct(s[2]) / 8, s[0].cwiseProduct(s[2]) / 8, s[0].cwiseProduct(s[1]) / 8};
    Eigen::Matrix<long double, 3, 8> gradient = Eigen::Matrix<long double, 3, 8>::Zero();
    for (int i = -1; i <= 1; ++i) {
        for (int j = -1; j <= 1; ++j) {
            for (int k = -1; k <= 1; ++k) {
                const int axes = i * i + j * j + k * k;
                if (i + 3 * j + 9 * k > 0) {
                    const Weights w = i * a[0] + j * a[1] + k * a[2];
                    const Vector3l d = corners * w;
                    const auto stiffness = static_cast<long double>(cell.stiffness[static_cast<std::size_t>(axes - 1)]);
                    gradient +=
                        stiffness * (1 - h * std::sqrt(static_cast<long double>(axes)) / d.norm()) * d * w.transpose();
                }
            }
        }
    }
    const auto p = [&](int i, int j) { return (corners * g[i]).dot(corners * a[j]) / h; };
    const auto add = [&](long double q, int i, int j) {
        gradient += q / h * (corners * a[j] * g[i].transpose() + corners * g[i] * a[j].transpose());
    };
    const auto& k = cell.hourglass;
    const Weights fourth = s[0].cwiseProduct(s[1]).cwiseProduct(s[2]) / 8;
    gradient += static_cast<long double>(k.fourth) * (corners * fourth) * fourth.transpose();
    for (int i = 0; i < 3; ++i) {
        add(static_cast<long double>(k.twisting) * p(i, i) +
                static_cast<long double>(k.twist_sum) * (p(0, 0) + p(1, 1) + p(2, 2)),
            i, i);
        for (int j = 0; j < 3; ++j) {
            if (i != j) {
                add(static_cast<long double>(k.bending) * p(i, j) + static_cast<long double>(k.coupling) * p(j, i), i,
                    j);
            }
        }
    }
    for (int c = 0; c < 8; ++c) {
        f[static_cast<std::size_t>(cell.nodes[static_cast<std::size_t>(c)])] -= gradient.col(c);
    }
}

std::vector<Vector3l> forces_in_long_double(const reference::Body& body, const std::vector<Vector3d>& u) {
    std::vector<Vector3l> x, f(u.size(), Vector3l::Zero());
    for (std::size_t n = 0; n < u.size(); ++n) {
        x.push_back(body.rest[n].cast<long double>() + u[n].cast<long double>());
    }
    for (const reference::Spring& s : body.springs) {
        const auto a = static_cast<std::size_t>(s.a), b = static_cast<std::size_t>(s.b);
        const Vector3l d = x[b] - x[a];
        const long double l = (body.rest[b].cast<long double>() - body.rest[a].cast<long double>()).norm();
        const Vector3l on_a = static_cast<long double>(s.stiffness) * (1 - l / d.norm()) * d;
        f[a] += on_a;
        f[b] -= on_a;
    }
    for (const reference::Cell& cell : body.cells) {
        Matrix3l edges = Matrix3l::Zero(), rest = Matrix3l::Zero();
        for (std::size_t c = 0; c < 8; ++c) {
            const auto n = static_cast<std::size_t>(cell.nodes[c]);
            for (int axis = 0; axis < 3; ++axis) {
                edges.col(axis) += side(c, axis) / 4 * x[n];
                rest.col(axis) += side(c, axis) / 4 * body.rest[n].cast<long double>();
            }
        }
        const long double j = edges.determinant() / rest.determinant(), c1 = std::cbrt(j);
        const long double slope = body.volume_energy == VolumeEnergy::quadratic ? j - 1 : 3 * (c1 - 1) / (c1 * c1);
        const Vector3l a = edges.col(0), b = edges.col(1), c = edges.col(2);
        for (std::size_t i = 0; i < 8; ++i) {
            f[static_cast<std::size_t>(cell.nodes[i])] -=
                static_cast<long double>(cell.kappa) * slope / 4 *
                (side(i, 0) * b.cross(c) + side(i, 1) * c.cross(a) + side(i, 2) * a.cross(b));
        }
    }
    for (const reference::MeanSprings& cell : body.mean_springs) {
        add_mean_spring_forces(cell, x, f);
    }
    return f;
}

TEST(SmallStrainAccuracy, ForcesAgreeWithLongDouble) {
    if (std::numeric_limits<long double>::digits < 64) {
        GTEST_SKIP() << "long double has no more digits than double here";
    }
    unsigned seed = 1100;
    for (const Material& material : materials()) {
        for (double strain : {1e-7, 1e-4, 0.1}) {
            ++seed;
            for (const SpringForm form : kSpringForms) {
                SCOPED_TRACE("seed " + std::to_string(seed) + ", strain " + std::to_string(strain) + ", " +
                             describe(form) + describe(material));
                Random random(seed);
                // A cell of 1/2, so that rest positions and edges are exact in both forms.
                const Lattice lattice = random_lattice(3, 4, 2, 0.5, random);
                const reference::Body body = reference::assemble(lattice, with_springs_on(form, material));
                const std::vector<Vector3d> u = random_displacement(body.rest.size(), 0.5 * strain, random);
                const std::vector<Vector3d> f = reference::forces(body, u);
                const std::vector<double> scale = reference::force_scale(body, u);
                const std::vector<Vector3l> exact = forces_in_long_double(body, u);
                // The position form in long double is itself good to some 1e-19 / strain only.
                const double tolerance = 4 * std::numeric_limits<double>::epsilon() + 1e-18 / strain;
                double worst = 0;
                for (std::size_t n = 0; n < u.size(); ++n) {
                    const double error = static_cast<double>((f[n].cast<long double>() - exact[n]).norm());
                    worst = std::max(worst, error / scale[n]);
                }
                EXPECT_LE(worst, tolerance);
            }
        }
    }
}

TEST(SmallStrainAccuracy, ForceScaleIsTheSizeOfTheForces) {
    // A scale far above the forces would make every tolerance measured by it empty.
    unsigned seed = 1500;
    for (const Material& material : materials()) {
        for (double strain : {1e-7, 1e-3, 0.1, 0.5}) {
            ++seed;
            for (const SpringForm form : kSpringForms) {
                SCOPED_TRACE("seed " + std::to_string(seed) + ", strain " + std::to_string(strain) + ", " +
                             describe(form) + describe(material));
                Random random(seed);
                const reference::Body body =
                    reference::assemble(Lattice::box(3, 4, 2, 0.5), with_springs_on(form, material));
                const std::vector<Vector3d> u = random_displacement(body.rest.size(), 0.5 * strain, random);
                const std::vector<Vector3d> f = reference::forces(body, u);
                const std::vector<double> scale = reference::force_scale(body, u);
                double force_sum = 0, scale_sum = 0;
                for (std::size_t n = 0; n < u.size(); ++n) {
                    EXPECT_GE(scale[n], f[n].norm());
                    force_sum += f[n].norm();
                    scale_sum += scale[n];
                }
                // Means and patterns are sums of eight random displacements, smaller than those without signs.
                EXPECT_LE(scale_sum, (form == SpringForm::nodes ? 20 : 55) * force_sum);
            }
        }
    }
}

} // namespace
} // namespace hybmss::testing
