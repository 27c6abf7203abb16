// Bodies that turn: rods that hang from a clamp, bodies that supports leave free to rotate, and what serves them.
#include "clamped_cube.hpp"
#include "plan/bodies/layout_table.hpp"
#include "solvers/multigrid/banded.hpp"
#include "solvers/newton/conjugate_gradients.hpp"
#include "solvers/newton/turning.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace hybmss::testing {
namespace {

using Field = std::vector<std::array<double, 3>>;

VectorField<double> view(Field& field) {
    return VectorField<double>::aos(field.data()->data(), field.size());
}

/// The nodes at the low end of z held.
std::vector<PrescribedNode> clamp(const Lattice& lattice) {
    std::vector<PrescribedNode> supports;
    const auto rest = rest_positions(lattice);
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n][2] == 0) {
            supports.push_back({static_cast<std::uint32_t>(n), 7, {}, {}});
        }
    }
    return supports;
}

/// The largest unbalanced force over the largest support force or load, from the forces alone.
double residual(EquilibriumSolver<double>& solver, const Loading& loading, double fraction, Field& u) {
    Field f(u.size());
    solver.get_forces(view(u), view(f));
    std::vector<unsigned> held(u.size(), 0);
    for (const PrescribedNode& p : loading.supports) {
        held[p.node] |= p.axes;
    }
    double unbalanced = 0, scale = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double load = fraction * (solver.masses()[n] * loading.acceleration[c] +
                                            (loading.forces.empty() ? 0 : loading.forces[n][c]));
            double& most = held[n] >> c & 1 ? scale : unbalanced;
            most = std::max(most, std::abs(f[n][c] + load));
            scale = std::max(scale, std::abs(load));
        }
    }
    return scale > 0 ? unbalanced / scale : 0;
}

TEST(BandMatrices, SolveWhatDenseOnesSolve) {
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> draw(-1, 1);
    for (const int width : {0, 1, 4, 40}) {
        constexpr int n = 30;
        BandMatrix band(n, static_cast<std::size_t>(width));
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
        std::vector<double> x(n);
        Eigen::VectorXd b(n);
        for (int i = 0; i < n; ++i) {
            for (int j = std::max(0, i - width); j <= i; ++j) {
                dense(i, j) = dense(j, i) = draw(engine) + (i == j ? 30 : 0);
                band.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) = dense(i, j);
            }
            b[i] = x[static_cast<std::size_t>(i)] = draw(engine);
        }
        band.factor(1e-13);
        band.solve(x);
        const Eigen::VectorXd expected = dense.llt().solve(b);
        EXPECT_LT((Eigen::Map<Eigen::VectorXd>(x.data(), n) - expected).norm(), 1e-14 * expected.norm()) << width;
    }
}

/// One step is exact at rest, whatever the section; with holes and contrasts too.
TEST(Preconditioners, ABandSolvesASlenderLattice) {
    std::mt19937 engine(11);
    std::uniform_real_distribution<double> draw(0, 1);
    for (const auto& [nx, ny, nz] : {std::array{1, 1, 300}, std::array{90, 2, 3}, std::array{2, 64, 1}}) {
        for (const double nu : {0.25, 0.49}) {
            SCOPED_TRACE(::testing::Message() << nx << "x" << ny << "x" << nz << ", nu " << nu);
            std::vector<float> scales(static_cast<std::size_t>(nx * ny * nz), 1.0f);
            for (float& scale : scales) {
                scale = static_cast<float>(std::pow(10.0, draw(engine) - 0.5));
            }
            if (nx == 90) {
                scales[45] = 0;
            }
            const Lattice lattice = Lattice::from_cells(nx, ny, nz, 0.5, scales);
            ASSERT_TRUE(banded_pays(lattice));
            const Material material{.poisson_ratio = nu};
            const auto body = make_body<double>(lattice, material, {});
            Potential<double> potential(*body, BodyScales::of(lattice, material), SolidCells::of(lattice),
                                        Sections::of(lattice));
            State<double> state = body->make_state(false);
            const auto rest = rest_positions(lattice);
            std::vector<PrescribedNode> held;
            for (std::size_t n = 0; n < rest.size(); ++n) {
                if (*std::max_element(rest[n].begin(), rest[n].end()) <= 2) {
                    held.push_back({static_cast<std::uint32_t>(n), 7, {}, {}});
                }
            }
            potential.prescribe(held);
            Field forces(rest.size());
            for (auto& f : forces) {
                f = {draw(engine) - 0.5, draw(engine) - 0.5, draw(engine) - 0.5};
            }
            potential.load(forces, {0, 0, 0});
            NodeVector<double> gradient = potential.space().make(), step = potential.space().make();
            potential.gradient(state, gradient);
            potential.linearise(state);
            Banded<double> banded(*body, lattice, material);
            banded.update(potential);
            ConjugateGradients<double> cg(potential.space());
            const CgResult result =
                cg.solve(potential, banded, gradient, {.relative_residual = 1e-6, .iterations = 100}, step);
            EXPECT_EQ(result.end, CgEnd::converged);
            EXPECT_LE(result.iterations, 3);
        }
    }
}

/// A rotation in the step becomes one of the body, however long; to first order a turned step is the step.
TEST(Turns, CarryOutRotationsAsSuch) {
    const Lattice lattice = Lattice::box(1, 2, 40, 0.1);
    const auto body = make_body<double>(lattice, Material{}, {});
    const auto rest = rest_positions(lattice);
    Turning<double> turning(*body, Sections::of(lattice));
    ASSERT_TRUE(turning.slender());
    const std::vector<std::uint8_t> held(rest.size(), 0);
    turning.hold(held);
    const VectorSpace<double> space(*body);
    const auto steps = [&](const auto& of) {
        Field field;
        for (const auto& x : rest) {
            field.push_back(of(x));
        }
        NodeVector<double> step = space.make();
        body->write(VectorField<const double>::aos(field.data()->data(), field.size()), 1 / body->length_unit(),
                    step.field);
        return step;
    };
    State<double> state = body->make_state(false);
    const auto rotation = steps([](const auto& x) {
        return Vector{0.9 * x[1], -0.9 * x[0] + 0.4 * x[2], -0.4 * x[1]};
    });
    EXPECT_NEAR(turning.fit(state, rotation), std::hypot(0.9, 0.4), 1e-12);
    turning.move(rotation, 1, state);
    EXPECT_LT(body->energy(state).total(), 1e-24);

    const auto bend = [](const auto& x) {
        return Vector{0.02 * x[2] * x[2], 0.01 * x[0] * x[2], -0.04 * x[2] * x[0] + 0.03 * x[1] * x[1]};
    };
    const auto step = steps(bend);
    double before = 0;
    for (const double part : {1e-2, 1e-3}) {
        state = body->make_state(false);
        turning.fit(state, step);
        turning.move(step, part, state);
        space.for_each([part](const double& p, double& q) { q -= part * p; }, step,
                       *std::make_unique<MutableFieldView<double>>(MutableFieldView<double>{state.displacement}));
        NodeVector<double> difference = space.make();
        const FieldView<double> u{state.displacement};
        space.copy(u, difference);
        const double size = space.largest_component(difference);
        if (before > 0) {
            EXPECT_NEAR(size, 1e-2 * before, 1e-3 * before);
        }
        before = size;
    }
}

/// Forces along z on the faces across x of a cube on rollers: it turns until they pull along one line. No load is too
/// weak for that.
TEST(Turns, ACoupleOnRollersTurnsTheBody) {
    const Lattice lattice = Lattice::box(4, 4, 4, 0.5);
    const auto rest = rest_positions(lattice);
    for (const double force : {1.0, 10.0, 100.0, 1000.0}) {
        SCOPED_TRACE(force);
        EquilibriumSolver<double> solver(lattice, {.young_modulus = 1e5});
        Loading loading;
        loading.forces.assign(rest.size(), {0, 0, 0});
        for (std::size_t n = 0; n < rest.size(); ++n) {
            if (rest[n][1] == 0) {
                loading.supports.push_back({static_cast<std::uint32_t>(n), 2, {}, {}});
            }
            if (rest[n][0] == 0 || rest[n][0] == 2) {
                const double share = (rest[n][1] == 0 || rest[n][1] == 2 ? 0.5 : 1) *
                                     (rest[n][2] == 0 || rest[n][2] == 2 ? 0.5 : 1) / 16;
                loading.forces[n][2] = (rest[n][0] == 0 ? -force : force) * share;
            }
        }
        Field u(rest.size());
        const auto result = solver.solve(loading, view(u));
        ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
        EXPECT_LE(result.newton_iterations, 30);
        EXPECT_LE(residual(solver, loading, 1, u), 1e-8);
        EXPECT_GT(result.min_cell_volume_ratio, 0.9);
        // Turned by a quarter: the forces are 2 m apart and pull, F l / (E A) = F / (2e5 m) longer.
        EXPECT_NEAR(result.potential, -2 * force - force * force / 4e5, 2e-3 * force * force / 4e5);
    }
}

/// A clamped rod that its weight bends down: it hangs, straight but for some 20 cells at the clamp.
TEST(Turns, ALongRodHangsFromItsClamp) {
    const Lattice lattice = Lattice::box(1, 1, 1000, 0.01);
    for (const double density : {1000.0, 100.0}) {
        SCOPED_TRACE(density);
        EquilibriumSolver<double> solver(lattice, {.young_modulus = 1e7, .density = density});
        Field u(solver.node_count());
        Loading loading;
        loading.supports = clamp(lattice);
        loading.acceleration = {0, -9.81, 0};
        const auto result = solver.solve(loading, view(u));
        ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
        EXPECT_EQ(result.preconditioner, "banded");
        EXPECT_LE(result.newton_iterations, 80);
        EXPECT_LE(residual(solver, loading, 1, u), 1e-8);
        // The lever (E I / w)^(1/3) of the bend is 0.26 and 0.55 m; it stretches by w L / (2 E A), 0.5 and 0.05 %.
        EXPECT_LT(u.back()[1], -9.4);
        EXPECT_GT(u.back()[1], -10.1);
        EXPECT_NEAR(u.back()[2], -10, 0.7);
    }
}

/// What is left of a solve that fails is in balance with the part of the loading that the result says.
TEST(FailedSolves, LeaveAStateThatTheirResidualDescribes) {
    const Lattice lattice = Lattice::box(4, 4, 4, 0.5);
    EquilibriumSolver<double> solver(lattice, {});
    Field u(solver.node_count());
    const Loading crushed = plates(lattice, translated({0, -1.4, 0}));
    const auto at_last = solver.solve(crushed, view(u));
    ASSERT_EQ(at_last.status, EquilibriumStatus::inverted);
    EXPECT_GT(at_last.load_fraction, 0.2);
    EXPECT_LE(at_last.residual, 1e-8);
    EXPECT_NEAR(residual(solver, crushed, at_last.load_fraction, u), at_last.residual, 1e-10);
    EXPECT_NEAR(u.back()[1], -1.4 * at_last.load_fraction, 1e-12);
    EXPECT_NE(at_last.message.find("left is the equilibrium at"), std::string::npos) << at_last.message;

    // Rounding ends it early: what is left is as good as it gets, at the whole loading.
    u.assign(u.size(), {0, 0, 0});
    EquilibriumOptions options;
    options.tolerance = 1e-16;
    const Loading pressed = plates(lattice, translated({0.01, -0.1, 0}));
    const auto rounded = solver.solve(pressed, view(u), options);
    ASSERT_EQ(rounded.status, EquilibriumStatus::no_descent) << rounded.message;
    EXPECT_EQ(rounded.load_fraction, 1);
    EXPECT_NEAR(u.back()[1], -0.1, 1e-12);
    EXPECT_LT(rounded.residual, 1e-12);
    EXPECT_NEAR(residual(solver, pressed, 1, u), rounded.residual, 1e-14);
    EXPECT_NE(rounded.message.find("left is the state"), std::string::npos) << rounded.message;

    // Nothing was found at all.
    u.assign(u.size(), {0, 0, 0});
    EquilibriumSolver<double> endless(lattice, {.poisson_ratio = -0.5, .volume_energy = VolumeEnergy::quadratic});
    Loading torn;
    torn.supports = clamp(lattice);
    torn.acceleration = {0, 0, 1e9};
    const auto none = endless.solve(torn, view(u));
    ASSERT_NE(none.status, EquilibriumStatus::converged);
    EXPECT_EQ(none.load_fraction, 0);
    EXPECT_LT(none.residual, 1e-8);
    EXPECT_EQ(u.back(), (std::array<double, 3>{0, 0, 0}));
    EXPECT_NE(none.message.find("left is the start"), std::string::npos) << none.message;
}

// A column pressed by a tenth, its head a hundredth of a cell aside: Newton's method passes states that curve downwards
// and ends at a saddle, bent into an S. From there it goes on to the bow that has half of the energy.
TEST(SlenderBodies, LeaveASaddleThatTheWayPointsTo) {
    const Lattice column = Lattice::box(1, 1, 20, 0.1);
    EquilibriumSolver<double> solver(column, {1e5, 0.3});
    Loading loading;
    const std::vector<std::uint32_t> nodes = column.nodes();
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const double z = column.rest_position(nodes[n])[2];
        if (z < 0.01 || z > 1.99) {
            const bool head = z > 1;
            loading.supports.push_back(
                {static_cast<std::uint32_t>(n), 7, {head ? 1e-3 : 0, 0, head ? -0.2 : 0}, {0, 0, 0}});
        }
    }
    std::vector<double> u(3 * solver.node_count(), 0.0);
    const auto result = solver.solve(loading, VectorField<double>::aos(u.data(), solver.node_count()));
    ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_LT(result.potential, 4); // 3.34 J; the saddle has 5.96
}

} // namespace
} // namespace hybmss::testing
