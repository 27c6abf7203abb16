// Vibrations against the dense eigenvalues of the reference's second derivatives, and in closed form.
#include "clamped_cube.hpp"
#include "hybmss/equilibrium.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hybmss::testing {
namespace {

using reference::Vector3d;

/// omega^2 of all free components, from the lowest on.
Eigen::VectorXd dense_eigenvalues(const Lattice& lattice, const Material& material,
                                  const std::vector<PrescribedNode>& supports, const std::vector<Vector3d>& u) {
    const reference::Body body = reference::assemble(lattice, material);
    std::vector<Eigen::Index> free;
    for (std::size_t c = 0; c < 3 * u.size(); ++c) {
        bool held = false;
        for (const PrescribedNode& p : supports) {
            held = held || (p.node == c / 3 && (p.axes >> (c % 3) & 1));
        }
        if (!held) {
            free.push_back(static_cast<Eigen::Index>(c));
        }
    }
    Eigen::VectorXd scale(static_cast<Eigen::Index>(3 * u.size()));
    for (Eigen::Index c = 0; c < scale.size(); ++c) {
        scale[c] = 1 / std::sqrt(body.mass[static_cast<std::size_t>(c / 3)]);
    }
    const Eigen::MatrixXd all = scale.asDiagonal() * Eigen::MatrixXd(reference::hessian(body, u)) * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(all(free, free)).eigenvalues();
}

Lattice with_hole() {
    Lattice lattice = Lattice::box(4, 3, 4, 0.3);
    lattice.set_cell_scale(1, 1, 1, 0);
    lattice.set_cell_scale(3, 2, 3, 0);
    return lattice;
}

void expect_dense(const Lattice& lattice, const Material& material, const std::vector<PrescribedNode>& supports,
                  std::vector<Vector3d> u, int rigid, PreconditionerKind kind = PreconditionerKind::automatic) {
    EquilibriumSolver<double> solver(lattice, material);
    constexpr int kCount = 7;
    const auto field = VectorField<const double>::aos(u.front().data(), u.size());
    const ModesResult result =
        solver.modes(supports, field, {.count = kCount, .tolerance = 1e-7, .preconditioner = kind});
    EXPECT_TRUE(result.converged);
    EXPECT_EQ(result.rigid_motions, rigid);
    ASSERT_EQ(result.modes.size(), static_cast<std::size_t>(kCount));
    const Eigen::VectorXd dense = dense_eigenvalues(lattice, material, supports, u);
    for (int m = 0; m < kCount; ++m) {
        const Mode& mode = result.modes[static_cast<std::size_t>(m)];
        EXPECT_NEAR(mode.eigenvalue, dense[m + rigid], 1e-9 * std::abs(dense[kCount + rigid])) << m;
        EXPECT_NEAR(mode.frequency() * std::abs(mode.frequency()) * 4 * std::numbers::pi * std::numbers::pi,
                    mode.eigenvalue, 1e-12 * std::abs(mode.eigenvalue));
        double norm = 0;
        for (std::size_t n = 0; n < mode.shape.size(); ++n) {
            norm += solver.masses()[n] * Vector3d(mode.shape[n].data()).squaredNorm();
        }
        EXPECT_NEAR(norm, 1, 1e-9);
    }
}

std::vector<Vector3d> at_rest(const Lattice& lattice) {
    return std::vector<Vector3d>(lattice.nodes().size(), Vector3d::Zero());
}

TEST(Modes, AreThoseOfTheDenseMatrix) {
    for (const SpringForm springs : {SpringForm::nodes, SpringForm::means}) {
        for (const double nu : {0.0, 0.3, 0.49}) {
            const Material material{.poisson_ratio = nu, .springs = springs};
            for (const Lattice& lattice : {with_hole(), Lattice::box(1, 1, 1, 0.3), Lattice::box(2, 2, 9, 0.3)}) {
                SCOPED_TRACE("nu = " + std::to_string(nu) + ", " + std::to_string(lattice.cell_count()) + " cells");
                expect_dense(lattice, material, {}, at_rest(lattice), 6);
                // Free to turn about z and to move along it; then held altogether.
                expect_dense(lattice, material, {{0, 3, {0, 0, 0}, {0, 0, 0}}}, at_rest(lattice), 4);
                std::vector<PrescribedNode> base;
                for (std::uint32_t n = 0; n < (lattice.cell_count() == 1 ? 4u : 7u); ++n) {
                    base.push_back({n, 7, {0, 0, 0}, {0, 0, 0}});
                }
                expect_dense(lattice, material, base, at_rest(lattice), 0);
            }
        }
    }
}

TEST(Modes, AreFoundWithEitherPreconditioner) {
    const Lattice lattice = Lattice::box(5, 4, 6, 0.3);
    for (const PreconditionerKind kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
        expect_dense(lattice, {.poisson_ratio = 0.3}, {}, at_rest(lattice), 6, kind);
        expect_dense(lattice, {.poisson_ratio = 0.3}, plates(lattice, translated({0, 0, 0})).supports, at_rest(lattice),
                     0, kind);
    }
}

/// Squeezed between plates until it would rather bulge: some omega^2 are below zero.
TEST(Modes, TellWhatIsNotStable) {
    const Lattice lattice = Lattice::box(2, 10, 2, 0.3);
    const Loading pressed = plates(lattice, translated({0, -0.6, 0}));
    std::vector<Vector3d> u;
    for (const std::uint32_t node : lattice.nodes()) {
        u.emplace_back(0, -0.2 * lattice.rest_position(node)[1], 0);
    }
    EXPECT_LT(dense_eigenvalues(lattice, {}, pressed.supports, u)[0], 0);
    expect_dense(lattice, {}, pressed.supports, u, 0);
}

TEST(Modes, RefuseWhatIsNotAllowed) {
    EquilibriumSolver<double> solver(Lattice::box(1, 1, 1, 1), {});
    std::vector<double> u(24, 0.0);
    EXPECT_THROW(solver.modes({}, VectorField<double>::aos(u.data(), 8), {.count = 0}), std::invalid_argument);
    EXPECT_THROW(solver.modes({}, VectorField<double>::aos(u.data(), 8), {.tolerance = 0}), std::invalid_argument);
    EXPECT_THROW(solver.modes({}, VectorField<double>::aos(u.data(), 7)), std::invalid_argument);
}

} // namespace
} // namespace hybmss::testing
