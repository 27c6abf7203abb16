// Vibrations against the dense eigenvalues of the reference's second derivatives, and in closed form.
#include "clamped_cube.hpp"
#include "hybmss/equilibrium.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
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

/// A column of 2 x 2 x 8 cells on its foot, pressed by a force on its head.
struct Column {
    Lattice lattice = Lattice::box(2, 2, 8, 0.3);
    Loading loading;

    explicit Column(double force) {
        std::vector<std::uint32_t> grid = lattice.nodes();
        loading.forces.assign(grid.size(), {0, 0, 0});
        for (std::uint32_t n = 0; n < grid.size(); ++n) {
            const auto x = lattice.rest_position(grid[n]);
            if (x[2] < 1e-9) {
                loading.supports.push_back({n, 7, {0, 0, 0}, {0, 0, 0}});
            } else if (x[2] > 2.4 - 1e-9) {
                loading.forces[n] = {0, 0, -force / 9};
            }
        }
    }
};

/// The least -1/value > 0 of the reference's K_g x = value K x, K_g by differences about its own linear solution.
std::vector<double> dense_buckling(const Column& column, const Material& material) {
    const reference::Body body = reference::assemble(column.lattice, material);
    const std::size_t nodes = column.loading.forces.size();
    std::vector<Eigen::Index> free;
    for (std::size_t c = 0; c < 3 * nodes; ++c) {
        const auto& held = column.loading.supports;
        if (std::none_of(held.begin(), held.end(), [&](const PrescribedNode& p) { return p.node == c / 3; })) {
            free.push_back(static_cast<Eigen::Index>(c));
        }
    }
    std::vector<Vector3d> u(nodes, Vector3d::Zero());
    const auto stiffness = [&] { return Eigen::MatrixXd(Eigen::MatrixXd(reference::hessian(body, u))(free, free)); };
    const Eigen::MatrixXd at_rest = stiffness();
    Eigen::VectorXd force(static_cast<Eigen::Index>(3 * nodes));
    for (std::size_t n = 0; n < nodes; ++n) {
        force.segment<3>(static_cast<Eigen::Index>(3 * n)) = Vector3d(column.loading.forces[n].data());
    }
    const Eigen::VectorXd answer = at_rest.ldlt().solve(force(free));
    const double part = 1e-4 * 0.3 / answer.cwiseAbs().maxCoeff();
    const auto moved = [&](double by) {
        for (std::size_t f = 0; f < free.size(); ++f) {
            u[static_cast<std::size_t>(free[f] / 3)][free[f] % 3] = by * answer[static_cast<Eigen::Index>(f)];
        }
        return stiffness();
    };
    const Eigen::MatrixXd change = (moved(part) - moved(-part)) / (2 * part);
    const Eigen::VectorXd values =
        Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(change, at_rest).eigenvalues();
    std::vector<double> factors;
    for (Eigen::Index i = 0; i < values.size() && values[i] < 0; ++i) {
        factors.push_back(-1 / values[i]);
    }
    return factors;
}

TEST(Buckling, IsThatOfTheDensePencil) {
    for (const SpringForm springs : {SpringForm::nodes, SpringForm::means}) {
        const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3, .springs = springs};
        const Column column(100);
        EquilibriumSolver<double> solver(column.lattice, material);
        const BucklingResult found = solver.buckling(column.loading, {.count = 4});
        EXPECT_TRUE(found.converged) << found.message;
        const std::vector<double> dense = dense_buckling(column, material);
        ASSERT_EQ(found.loads.size(), 4u);
        for (std::size_t i = 0; i < 4; ++i) {
            EXPECT_NEAR(found.loads[i].factor, dense[i], 1e-6 * dense[i]) << i;
            EXPECT_LE(found.loads[i].residual, 1e-6);
        }
        // Half the load, twice the factor, whatever its size; and a shape that moves by 1 m at most.
        EXPECT_NEAR(solver.buckling(Column(5e-7).loading, {.count = 1}).loads.at(0).factor, 2e8 * dense[0],
                    1e-3 * dense[0] * 2e8);
        double most = 0;
        for (const auto& u : found.loads[0].shape) {
            most = std::max(most, std::hypot(u[0], u[1], u[2]));
        }
        EXPECT_NEAR(most, 1, 1e-12);
    }
}

/// Where omega^2 of the column under the load itself comes to zero, but for the column's shortening of some percent.
TEST(Buckling, IsWhereVibrationsBecomeSlow) {
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    const Column column(1);
    EquilibriumSolver<double> solver(column.lattice, material);
    const double factor = solver.buckling(column.loading, {.count = 1}).loads.at(0).factor;
    const auto slowest = [&](double part) {
        const Column loaded(part * factor);
        std::vector<double> u(3 * solver.node_count(), 0.0);
        const auto field = VectorField<double>::aos(u.data(), solver.node_count());
        EXPECT_EQ(solver.solve(loaded.loading, field).status, EquilibriumStatus::converged);
        return solver.modes(loaded.loading.supports, field, {.count = 1}).modes.at(0).eigenvalue;
    };
    const double at_rest = slowest(0);
    EXPECT_NEAR(slowest(0.01) / at_rest, 0.99, 2e-3); // the shapes of both are not quite the same
    EXPECT_GT(slowest(0.9), 0);
    EXPECT_LT(slowest(1.1), 0);
}

TEST(Buckling, SaysWhereThereIsNone) {
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    Column column(1);
    EquilibriumSolver<double> solver(column.lattice, material);
    Loading none = column.loading;
    none.forces.clear();
    EXPECT_EQ(solver.buckling(none).message, "the loading moves nothing");
    Loading free = column.loading;
    free.supports.clear();
    EXPECT_TRUE(solver.buckling(free).loads.empty());
    EXPECT_FALSE(solver.buckling(free).message.empty());
    EXPECT_THROW(solver.buckling(column.loading, {.count = 0}), std::invalid_argument);
    EXPECT_THROW(EquilibriumSolver<float>(column.lattice, material).buckling(column.loading), std::invalid_argument);
}

/// A block under pressure all around is softer; its own pressure must be told, for it turns with the faces.
TEST(Modes, KnowPressuresThatAreGiven) {
    const Lattice lattice = Lattice::box(3, 3, 3, 0.3);
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    EquilibriumSolver<double> solver(lattice, material);
    const std::vector<SurfaceFace> faces = surface_faces(lattice);
    solver.press(faces);
    std::vector<double> u(3 * solver.node_count(), 0.0);
    const auto field = VectorField<double>::aos(u.data(), solver.node_count());
    Loading loading;
    loading.supports = {{0, 7, {0, 0, 0}, {0, 0, 0}}, {3, 6, {0, 0, 0}, {0, 0, 0}}, {12, 4, {0, 0, 0}, {0, 0, 0}}};
    loading.pressures.assign(faces.size(), 500);
    ASSERT_EQ(solver.solve(loading, field).status, EquilibriumStatus::converged);
    // Turns of the body cost nothing only where its pressure turns with it.
    EXPECT_EQ(solver.modes({}, field, {.count = 1, .pressures = loading.pressures}).rigid_motions, 6);
    EXPECT_EQ(solver.modes({}, field, {.count = 1}).rigid_motions, 3);
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
