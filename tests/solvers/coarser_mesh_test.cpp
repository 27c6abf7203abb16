// Equilibria by way of coarser meshes: how fields go between the meshes, and that the way changes nothing of the end.
#include "solvers/newton/coarser_mesh.hpp"
#include "tests/random_bodies.hpp"
#include "tests/solvers/clamped_cube.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace hybmss::testing {
namespace {

Lattice with_holes(int nx, int ny, int nz, unsigned seed) {
    Random random(seed);
    return random_lattice(nx, ny, nz, 0.1, random, 0.3);
}

std::vector<double> flat(const std::vector<Vector>& vectors) {
    std::vector<double> values;
    for (const Vector& v : vectors) {
        values.insert(values.end(), v.begin(), v.end());
    }
    return values;
}

TEST(CoarserMesh, LinearFieldsGoOverExactly) {
    const Lattice fine = with_holes(8, 10, 12, 3);
    const CoarserMesh mesh(fine);
    const auto field = [](const Lattice& lattice) {
        std::vector<double> values;
        for (const Vector& x : rest_positions(lattice)) {
            for (const double value : {2 * x[0] - x[1] + 3, x[2], x[0] + x[1] - x[2]}) {
                values.push_back(value);
            }
        }
        return values;
    };
    const std::vector<double> expected = field(fine), found = mesh.interpolated(field(mesh.lattice()));
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        ASSERT_NEAR(found[i], expected[i], 1e-12);
    }
    const std::vector<double> coarse = mesh.injected(expected);
    const std::vector<Vector> at = rest_positions(mesh.lattice());
    ASSERT_EQ(coarse.size(), 3 * at.size());
}

// f . P c = R f . c: forces do the same work, weight too.
TEST(CoarserMesh, ForcesDoTheSameWork) {
    const Lattice fine = with_holes(8, 8, 10, 4);
    const CoarserMesh mesh(fine);
    Random random(5);
    const std::size_t nodes = fine.nodes().size(), coarse_nodes = mesh.lattice().nodes().size();
    std::vector<double> masses(nodes), c(3 * coarse_nodes);
    Loading loading;
    loading.acceleration = {1, -10, 2};
    for (std::size_t n = 0; n < nodes; ++n) {
        const Vector3d f = random.vector(1);
        loading.forces.push_back({f[0], f[1], f[2]});
        masses[n] = random.between(0.1, 1);
    }
    for (double& value : c) {
        value = random.between(-1, 1);
    }
    const std::vector<double> coarse = flat(mesh.restricted(loading, masses).forces), p = mesh.interpolated(c);
    double fine_work = 0;
    for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            fine_work += (loading.forces[n][a] + masses[n] * loading.acceleration[a]) * p[3 * n + a];
        }
    }
    EXPECT_NEAR(std::inner_product(coarse.begin(), coarse.end(), c.begin(), 0.0), fine_work,
                1e-10 * static_cast<double>(nodes));
}

// A node in the place of a held one is held as it, along the same axes.
TEST(CoarserMesh, SupportsStayWhereTheyAre) {
    const Lattice fine = Lattice::box(8, 8, 8, 0.1);
    const CoarserMesh mesh(fine);
    Loading loading = plates(fine, translated({0.01, -0.1, 0}));
    for (PrescribedNode& support : loading.supports) {
        support.axes = 3;
    }
    const Loading coarse = mesh.restricted(loading, std::vector<double>(fine.nodes().size(), 1.0));
    ASSERT_EQ(coarse.supports.size(), 2u * 5 * 5);
    EXPECT_TRUE(coarse.forces.empty());
    const std::vector<Vector> at = rest_positions(mesh.lattice());
    for (const PrescribedNode& support : coarse.supports) {
        EXPECT_EQ(support.axes, 3);
        EXPECT_NEAR(support.displacement[1], at[support.node][1] > 0.5 ? -0.1 : 0, 1e-12);
        EXPECT_NEAR(support.displacement[0], at[support.node][1] > 0.5 ? 0.01 : 0, 1e-12);
    }
}

TEST(CoarserMesh, IsForMeshesThatCanBeMergedAndAreLarge) {
    EXPECT_TRUE(CoarserMesh::pays(Lattice::box(16, 16, 16, 1)));
    EXPECT_FALSE(CoarserMesh::pays(Lattice::box(15, 16, 18, 1)));
    EXPECT_FALSE(CoarserMesh::pays(Lattice::box(8, 8, 8, 1)));
}

/// Solved with and without coarser meshes.
void expect_the_same(const Lattice& lattice, const Material& material, const Loading& loading, int meshes) {
    std::vector<std::vector<double>> found;
    for (const bool nested : {false, true}) {
        EquilibriumSolver<double> solver(lattice, material);
        std::vector<double> u(3 * solver.node_count(), 0.0);
        EquilibriumOptions options;
        options.nested = nested;
        options.tolerance = 1e-9;
        const auto result = solver.solve(loading, VectorField<double>::aos(u.data(), solver.node_count()), options);
        ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
        EXPECT_EQ(result.coarser_meshes, nested ? meshes : 0);
        EXPECT_LE(result.residual, 1e-9);
        found.push_back(u);
    }
    double most = 0, apart = 0;
    for (std::size_t i = 0; i < found[0].size(); ++i) {
        most = std::max(most, std::abs(found[0][i]));
        apart = std::max(apart, std::abs(found[0][i] - found[1][i]));
    }
    EXPECT_LE(apart, 1e-6 * most);
}

TEST(CoarserMesh, TheWayChangesNothingOfTheEnd) {
    for (const double nu : {0.0, 0.25, 0.45}) {
        const Lattice cube = Lattice::box(16, 16, 16, 5.0 / 16);
        expect_the_same(cube, {1e4, nu}, plates(cube, translated({0, -1, 0})), 1);
    }
    const Lattice holes = with_holes(20, 16, 24, 7);
    Loading loading = plates(holes, translated({0, 0, 0}));
    loading.acceleration = {0, -1, 0.5};
    expect_the_same(holes, {1e5, 0.3}, loading, 1);
    Lattice tube = Lattice::box(32, 16, 32, 0.1);
    std::vector<std::array<int, 3>> inside;
    for (int k = 9; k < 23; ++k) {
        for (int j = 0; j < 16; ++j) {
            for (int i = 9; i < 23; ++i) {
                inside.push_back({i, j, k});
            }
        }
    }
    tube.remove_cells(inside);
    expect_the_same(tube, {1e4, 0.3}, plates(tube, turned(20, 1.6)), 1);
}

// Network bodies and small ones have none; progress that says no stops the coarse solve as any other.
TEST(CoarserMesh, StopsWhenAskedTo) {
    const Lattice cube = Lattice::box(16, 16, 16, 0.1);
    EquilibriumSolver<float> solver(cube, {1e4, 0.3});
    std::vector<float> u(3 * solver.node_count(), 0.0f);
    EquilibriumOptions options;
    options.tolerance = 1e-4;
    int calls = 0;
    options.progress = [&](const EquilibriumProgress&) { return ++calls < 2; };
    const auto result = solver.solve(plates(cube, translated({0, -0.2, 0})),
                                     VectorField<float>::aos(u.data(), solver.node_count()), options);
    EXPECT_EQ(result.status, EquilibriumStatus::stopped);
    EXPECT_LE(calls, 3);
    EXPECT_EQ(result.load_fraction, 0);
}

} // namespace
} // namespace hybmss::testing
