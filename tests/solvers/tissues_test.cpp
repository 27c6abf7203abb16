// Bodies of several materials at rest: layers in series by their formula, and multigrid beside plain relaxation.
#include "clamped_cube.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace hybmss::testing {
namespace {

EquilibriumResult solve(const Lattice& lattice, const Material& material, const Loading& loading,
                        PreconditionerKind preconditioner, std::vector<double>& u) {
    u.assign(3 * lattice.nodes().size(), 0.0);
    EquilibriumSolver<double> solver(lattice, material);
    EquilibriumOptions options;
    options.preconditioner = preconditioner;
    return solver.solve(loading, VectorField<double>::aos(u.data(), u.size() / 3), options);
}

/// What a material resists strain along one axis with, none across it: K + 4/3 G.
double constrained_modulus(const Material& m) {
    const double nu = m.poisson_ratio;
    return m.young_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu));
}

// Strained along y alone, each of two layers is strained evenly, as the force through both is the same.
TEST(Tissues, LayersInSeriesShareTheStrainByTheirModuli) {
    struct Pair {
        Material low, high;
    };
    const Pair pairs[] = {{{1e4, 0.45}, {1e4, 0.1}},
                          {{1e4, 0.25}, {2e4, 0.4}},
                          {{1e4, -0.5}, {1e4, 0.499}},
                          {{1e4, 0.499}, {1e-2, -0.5}},
                          {{1e4, 0.3}, {1e10, 0.499}}};
    for (const auto& [low, high] : pairs) {
        for (const PreconditionerKind kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
            SCOPED_TRACE(std::to_string(low.poisson_ratio) + " beside " + std::to_string(high.poisson_ratio) + ", E " +
                         std::to_string(high.young_modulus));
            std::vector<std::uint8_t> labels(4 * 8 * 3);
            for (std::size_t cell = 0; cell < labels.size(); ++cell) {
                labels[cell] = cell / 4 % 8 < 3 ? 1 : 2;
            }
            const Material both[] = {low, high};
            const Lattice lattice = Lattice::from_materials(4, 8, 3, 0.5, labels, both);
            constexpr double kMoved = 1e-6;
            Loading loading = plates(lattice, translated({0, kMoved, 0}));
            const std::vector<Vector> rest = rest_positions(lattice);
            for (std::size_t n = 0; n < rest.size(); ++n) {
                if (rest[n][1] != 0 && rest[n][1] != 4) {
                    loading.supports.push_back({static_cast<std::uint32_t>(n), 5, {0, 0, 0}, {0, 0, 0}});
                }
            }
            std::vector<double> u;
            const EquilibriumResult result = solve(lattice, low, loading, kind, u);
            ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
            const double of_low = 1.5 / constrained_modulus(low), of_high = 2.5 / constrained_modulus(high);
            for (std::size_t n = 0; n < rest.size(); ++n) {
                const double y = rest[n][1];
                const double part = y <= 1.5 ? of_low * y / 1.5 : of_low + of_high * (y - 1.5) / 2.5;
                EXPECT_NEAR(u[3 * n + 1], kMoved * part / (of_low + of_high), 1e-5 * kMoved);
            }
        }
    }
}

// Newton's method ends where it must, whatever preconditions it: multigrid must know each cell's volume, held nodes and
// sizes that are odd too.
TEST(Tissues, MultigridFindsTheSameEquilibriumInFewProducts) {
    std::mt19937 engine(5);
    const Material materials[] = {{1e4, 0.25, 1000}, {3e4, 0.49, 3000}, {5e3, 0.0, 300}};
    std::vector<std::uint8_t> labels(12 * 13 * 10);
    for (std::size_t cell = 0; cell < labels.size(); ++cell) {
        // Lumps of 4^3 cells.
        const std::size_t lump = cell % 12 / 4 + 3 * (cell / 12 % 13 / 4) + 12 * (cell / 156 / 4);
        labels[cell] = static_cast<std::uint8_t>(1 + (lump * 2654435761U >> 7) % 3);
    }
    const Lattice lattice = Lattice::from_materials(12, 13, 10, 0.5, labels, materials);
    Loading loading = plates(lattice, translated({0.02, -0.1, 0}));
    loading.acceleration = {0, -0.02, 0};
    std::vector<double> plain, by_multigrid;
    const EquilibriumResult slow = solve(lattice, materials[0], loading, PreconditionerKind::block_jacobi, plain);
    const EquilibriumResult fast = solve(lattice, materials[0], loading, PreconditionerKind::multigrid, by_multigrid);
    ASSERT_EQ(slow.status, EquilibriumStatus::converged) << slow.message;
    ASSERT_EQ(fast.status, EquilibriumStatus::converged) << fast.message;
    double worst = 0;
    for (std::size_t i = 0; i < plain.size(); ++i) {
        worst = std::max(worst, std::abs(plain[i] - by_multigrid[i]));
    }
    EXPECT_LE(worst, 1e-6 * 0.1);
    EXPECT_LE(fast.cg_iterations, slow.cg_iterations / 4);
}

} // namespace
} // namespace hybmss::testing
