// Iterations of conjugate gradients for a random load on a clamped cube, and that multigrid copes with any body.
#include "clamped_cube.hpp"
#include "plan/bodies/layout_table.hpp"
#include "solvers/multigrid/float_multigrid.hpp"
#include "solvers/newton/conjugate_gradients.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include <random>

namespace hybmss::testing {
namespace {

template <class T>
struct Linear {
    Linear(const Lattice& given, const Material& m, const std::string& layout = "")
        : lattice(given), material(m), body(make_body<T>(lattice, material, {.layout = layout})),
          potential(*body, BodyScales::of(lattice, material), SolidCells::of(lattice), Sections::of(lattice)),
          state(body->make_state(false)), gradient(potential.space().make()), step(potential.space().make()) {}

    /// CG iterations for random forces on the free components.
    int iterations(Preconditioner<T>& preconditioner, unsigned seed = 3) {
        std::mt19937 engine(seed);
        std::uniform_real_distribution<double> draw(-1, 1);
        std::vector<Vector> forces(body->node_count());
        for (auto& f : forces) {
            f = {draw(engine), draw(engine), draw(engine)};
        }
        potential.load(forces, {0, 0, 0});
        potential.gradient(state, gradient);
        potential.linearise(state);
        preconditioner.update(potential);
        ConjugateGradients<T> cg(potential.space());
        const CgResult result =
            cg.solve(potential, preconditioner, gradient, {.relative_residual = 1e-8, .iterations = 3000}, step);
        EXPECT_EQ(result.end, CgEnd::converged);
        return result.iterations;
    }

    Lattice lattice;
    Material material;
    std::unique_ptr<Body<T>> body;
    Potential<T> potential;
    State<T> state;
    NodeVector<T> gradient, step;
};

int multigrid_iterations(const Lattice& lattice, double poisson_ratio, SpringForm springs = SpringForm::nodes) {
    Linear<double> linear(lattice, {.poisson_ratio = poisson_ratio, .springs = springs});
    linear.potential.prescribe(plates(lattice, translated({0, 0, 0})).supports);
    FloatMultigrid multigrid(*linear.body, lattice, linear.material, {.layout = linear.body->describe().layout});
    return linear.iterations(multigrid);
}

/// Block Jacobi takes 62, 121 and (nu = 0.499) 580, 1533.
TEST(Preconditioners, MultigridDoesNotSeeTheMesh) {
    EXPECT_LE(multigrid_iterations(Lattice::box(8, 8, 8, 0.5), 0.25), 8);
    EXPECT_LE(multigrid_iterations(Lattice::box(16, 16, 16, 0.5), 0.25), 8);
    EXPECT_LE(multigrid_iterations(Lattice::box(13, 17, 11, 0.5), 0.25), 9);
    EXPECT_LE(multigrid_iterations(Lattice::box(8, 8, 8, 0.5), 0.25, SpringForm::means), 12);
    EXPECT_LE(multigrid_iterations(Lattice::box(16, 16, 16, 0.5), 0.25, SpringForm::means), 12);
    EXPECT_LE(multigrid_iterations(Lattice::box(13, 17, 11, 0.5), 0.45, SpringForm::means), 20);
    EXPECT_LE(multigrid_iterations(Lattice::box(8, 8, 8, 0.5), 0), 8);
    EXPECT_LE(multigrid_iterations(Lattice::box(8, 8, 8, 0.5), 0.499), 14);
    EXPECT_LE(multigrid_iterations(Lattice::box(16, 16, 16, 0.5), 0.499), 18);
}

/// Holes, corners that touch, odd sizes, stiffness contrasts and rods, by lattice and by network layout.
TEST(Preconditioners, MultigridSolvesAnyLattice) {
    std::mt19937 engine(11);
    std::uniform_real_distribution<double> draw(0, 1);
    for (const auto& [nx, ny, nz] : {std::array{1, 1, 1}, std::array{1, 1, 9}, std::array{9, 1, 1}, std::array{1, 7, 2},
                                     std::array{5, 6, 7}, std::array{8, 3, 11}}) {
        for (double nu : {-0.5, 0.25, 0.49}) {
            for (const char* layout : {"", "network"}) {
                std::vector<float> scales(static_cast<std::size_t>(nx * ny * nz), 1.0f);
                if (scales.size() > 100) {
                    for (float& scale : scales) {
                        scale = draw(engine) < 0.2 ? 0.0f : static_cast<float>(std::pow(10.0, draw(engine) - 0.5));
                    }
                }
                const Lattice lattice = Lattice::from_cells(nx, ny, nz, 0.5, scales);
                SCOPED_TRACE(::testing::Message() << nx << "x" << ny << "x" << nz << ", nu " << nu << " " << layout);
                Linear<double> linear(lattice, {.poisson_ratio = nu}, layout);
                // The low end of x held along all axes, the high end along y alone.
                const auto rest = rest_positions(lattice);
                std::vector<PrescribedNode> held;
                for (std::size_t n = 0; n < rest.size(); ++n) {
                    if (rest[n][0] == 0 || rest[n][0] == nx * 0.5) {
                        held.push_back({static_cast<std::uint32_t>(n), std::uint8_t(rest[n][0] == 0 ? 7 : 2), {}, {}});
                    }
                }
                linear.potential.prescribe(held);
                FloatMultigrid multigrid(*linear.body, lattice, linear.material,
                                         {.layout = linear.body->describe().layout});
                const int iterations = linear.iterations(multigrid);
                BlockJacobi<double> jacobi;
                EXPECT_LE(iterations, std::max(12, linear.iterations(jacobi) / 2));
            }
        }
    }
}

// A cycle in float stands for one in double: as many iterations, with materials and loads of any size.
TEST(Preconditioners, CyclesInFloatPreconditionDouble) {
    const Lattice lattice = Lattice::box(14, 12, 10, 0.1);
    for (const double nu : {0.25, 0.499}) {
        int iterations = 0;
        for (const double modulus : {1e4, 1e-40, 1e17}) {
            EquilibriumSolver<double> solver(lattice, {.young_modulus = modulus, .poisson_ratio = nu});
            std::vector<double> u(3 * solver.node_count(), 0.0);
            EquilibriumOptions options;
            options.preconditioner = PreconditionerKind::multigrid;
            options.nested = false;
            const auto result = solver.solve(plates(lattice, translated({0, -1e-4, 0})),
                                             VectorField<double>::aos(u.data(), solver.node_count()), options);
            ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
            iterations = iterations == 0 ? static_cast<int>(result.cg_iterations) : iterations;
            EXPECT_NEAR(static_cast<double>(result.cg_iterations), iterations, 1) << modulus;
            EXPECT_LE(result.cg_iterations, nu < 0.4 ? 20 : 45);
        }
    }
}

template <class T>
EquilibriumResult compress(PreconditionerKind kind, double nu, double tolerance, double ratio = 1,
                           bool leave_saddles = false) {
    constexpr int n = 6;
    const Lattice lattice = Lattice::box(n, n, n, 0.5);
    EquilibriumSolver<T> solver(lattice, {.poisson_ratio = nu, .face_diagonal_ratio = ratio});
    std::vector<std::array<T, 3>> u(solver.node_count());
    EquilibriumOptions options;
    options.leave_saddles = leave_saddles;
    options.preconditioner = kind;
    options.tolerance = tolerance;
    const auto result = solver.solve(plates(lattice, translated({0, -0.15 * n * 0.5, 0})),
                                     VectorField<T>::aos(u[0].data(), u.size()), options);
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_EQ(result.preconditioner, name(kind));
    return result;
}

/// Under compression the second derivatives are no longer those at rest; both find one minimum.
TEST(Preconditioners, BothFindTheSameEquilibrium) {
    for (double nu : {0.0, 0.25, 0.49}) {
        const auto jacobi = compress<double>(PreconditionerKind::block_jacobi, nu, 1e-8);
        const auto multigrid = compress<double>(PreconditionerKind::multigrid, nu, 1e-8);
        EXPECT_NEAR(multigrid.potential, jacobi.potential, 1e-9 * jacobi.potential);
        EXPECT_LT(3 * multigrid.cg_iterations, jacobi.cg_iterations);
        compress<float>(PreconditionerKind::multigrid, nu, 1e-4);
    }
}

/// With weak face diagonals the compressed lattice wrinkles, but by symmetry no force asks it to.
TEST(Preconditioners, BothLeaveASaddle) {
    const auto straight = compress<double>(PreconditionerKind::block_jacobi, 0.25, 1e-8, 0.1);
    for (const auto kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
        const auto wrinkled = compress<double>(kind, 0.25, 1e-8, 0.1, true);
        EXPECT_LT(wrinkled.potential, 0.99 * straight.potential) << name(kind);
        EXPECT_GT(wrinkled.negative_curvatures, 0);
        EXPECT_EQ(compress<double>(kind, 0.25, 1e-8, 1, true).negative_curvatures, 0);
    }
}

TEST(Preconditioners, TheChoiceFollowsSizeAndMaterial) {
    const auto pays = [](int n, double nu) {
        return multigrid_pays(Lattice::box(n, n, n, 0.5), {.poisson_ratio = nu});
    };
    EXPECT_FALSE(pays(10, 0.25));
    EXPECT_TRUE(pays(64, 0.25));
    EXPECT_TRUE(pays(32, 0.499));
    const auto in_step = [](const Lattice& lattice, double nu, double reach) {
        return multigrid_pays_in_step(lattice, {.poisson_ratio = nu}, reach);
    };
    const Lattice cube = Lattice::box(10, 10, 10, 0.5);
    EXPECT_FALSE(in_step(cube, 0.25, 2));
    EXPECT_TRUE(in_step(cube, 0.25, 20));
    EXPECT_FALSE(in_step(cube, 0.499, 6)); // where cycles are dear
    EXPECT_TRUE(in_step(cube, 0.499, 100));
    EXPECT_FALSE(in_step(Lattice::box(60, 1, 1, 0.5), 0.25, 20)); // and where they do little
    EXPECT_TRUE(in_step(Lattice::box(60, 4, 4, 0.5), 0.25, 20));
    EXPECT_FALSE(in_step(Lattice::box(1, 1, 1, 0.5), 0.25, 1000));
}

/// A step that no support moves in begins with Newton's method where the body is, and makes the matrices of multigrid
/// once; where supports move, their neighbours come along first.
TEST(Preconditioners, StepsOfTimeComeToTheSameWithEither) {
    for (const bool moving : {false, true}) {
        const Lattice lattice = Lattice::box(6, 6, 6, 0.5);
        std::vector<double> results[2];
        for (const auto kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
            EquilibriumSolver<double> solver(lattice, {});
            std::vector<double> u(3 * solver.node_count()), v(u.size());
            Loading loading;
            loading.acceleration = {0.1, -0.1, 0};
            for (std::uint32_t n = 0; n < 49; ++n) { // the face z = 0
                loading.supports.push_back({.node = n, .axes = 7});
            }
            for (int step = 1; step <= 3; ++step) {
                for (PrescribedNode& support : loading.supports) {
                    support.displacement[0] = moving ? 0.02 * step : 0;
                }
                EquilibriumOptions options;
                options.preconditioner = kind;
                options.tolerance = 1e-10;
                const auto field = [](std::vector<double>& values) {
                    return VectorField<double>::aos(values.data(), values.size() / 3);
                };
                ASSERT_EQ(solver.step(loading, 0.5, 0.1, field(u), field(v), options).status,
                          EquilibriumStatus::converged);
            }
            results[kind == PreconditionerKind::multigrid] = u;
        }
        const double largest = *std::max_element(results[0].begin(), results[0].end());
        EXPECT_GT(largest, 1e-3);
        for (std::size_t i = 0; i < results[0].size(); ++i) {
            EXPECT_NEAR(results[0][i], results[1][i], 1e-7 * largest); // residuals of 1e-10, stiffnesses apart by 1e3
        }
    }
}

/// The volume's pressure right after a step turns the matrix indefinite; multigrid must not lose its way in that.
TEST(Preconditioners, StiffVolumesTakeFewNewtonIterations) {
    EXPECT_LE(compress<double>(PreconditionerKind::multigrid, 0.499, 1e-8).newton_iterations, 20);
}

/// Where a coarser mesh's equilibrium has been interpolated, volumes that are all but kept are a hundred times too far
/// off. 17 iterations at nu = 0.499 by the true derivatives alone.
TEST(Preconditioners, AFineMeshTakesFewNewtonIterations) {
    const Lattice lattice = Lattice::box(16, 16, 16, 5.0 / 16);
    for (const double nu : {0.0, 0.25, 0.4, 0.45, 0.49, 0.499}) {
        Material material{.poisson_ratio = nu};
        material.crush.stiffness = 20;
        for (const auto kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
            EquilibriumSolver<double> solver(lattice, material);
            std::vector<double> u(3 * solver.node_count(), 0.0);
            EquilibriumOptions options;
            options.preconditioner = kind;
            options.tolerance = 1e-6;
            const auto result = solver.solve(plates(lattice, translated({0, -1, 0})),
                                             VectorField<double>::aos(u.data(), solver.node_count()), options);
            EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
            EXPECT_EQ(result.coarser_meshes, 1);
            EXPECT_GT(result.min_cell_volume_ratio, 0.5);
            EXPECT_LE(result.newton_iterations, 8) << nu << " " << name(kind);
        }
    }
}

TEST(Preconditioners, MultigridIsForLattices) {
    EquilibriumSolver<double> solver(Network::from_lattice(Lattice::box(1, 1, 1, 0.5), {}));
    std::vector<std::array<double, 3>> u(solver.node_count());
    EquilibriumOptions options;
    options.preconditioner = PreconditionerKind::multigrid;
    EXPECT_THROW(solver.solve(Loading{}, VectorField<double>::aos(u[0].data(), u.size()), options),
                 std::invalid_argument);
}

} // namespace
} // namespace hybmss::testing
