// How a solve ends where things are hard: indefinite starts, bodies without supports, energies without bound.
#include "clamped_cube.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace hybmss::testing {
namespace {

constexpr double kCellSize = 0.5;

template <class T>
using Field = std::vector<std::array<T, 3>>;
template <class T>
VectorField<T> view(Field<T>& field) {
    return VectorField<T>::aos(field.data()->data(), field.size());
}

Field<double> random_field(std::size_t nodes, double bound, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> draw(-bound, bound);
    Field<double> field(nodes);
    for (auto& v : field) {
        for (double& x : v) {
            x = draw(engine);
        }
    }
    return field;
}

double largest(const Field<double>& field) {
    double most = 0;
    for (const auto& v : field) {
        for (double x : v) {
            most = std::isfinite(x) ? std::max(most, std::abs(x)) : std::numeric_limits<double>::infinity();
        }
    }
    return most;
}

Loading held_at_low_y(const Lattice& lattice) {
    Loading loading = plates(lattice, translated({0, 0, 0}));
    const double height = lattice.cells()[1] * lattice.cell_size();
    const auto rest = rest_positions(lattice);
    std::erase_if(loading.supports, [&](const PrescribedNode& p) { return rest[p.node][1] == height; });
    return loading;
}

TEST(HardCases, AnUnloadedBodyStaysAtRest) {
    const Lattice lattice = Lattice::box(3, 2, 4, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count());
    const auto result = solver.solve({}, view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_EQ(result.newton_iterations, 0);
    EXPECT_EQ(largest(u), 0);
}

TEST(HardCases, NothingIsFree) {
    const Lattice lattice = Lattice::box(1, 1, 1, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count());
    const Loading loading = plates(lattice, translated({0, 0.1, 0}));
    const auto result = solver.solve(loading, view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_DOUBLE_EQ(u.back()[1], 0.1);
}

/// Two opposite forces along one line on a body that nothing holds: the system is singular and consistent.
TEST(HardCases, FreeBodiesUnderBalancedLoads) {
    const Lattice lattice = Lattice::box(3, 5, 2, kCellSize);
    EquilibriumSolver<double> solver(lattice, {.poisson_ratio = 0.4});
    Field<double> u(solver.node_count());
    Loading loading;
    loading.forces.assign(u.size(), {0, 0, 0});
    loading.forces.front() = {-30, -50, -20};
    loading.forces.back() = {30, 50, 20};
    const auto result = solver.solve(loading, view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_GT(u.back()[1] - u.front()[1], 0);
    EXPECT_LT(largest(u), kCellSize);
}

TEST(HardCases, FallingWithoutSupportHasNoEquilibrium) {
    const Lattice lattice = Lattice::box(2, 2, 2, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count());
    Loading loading;
    loading.acceleration = {0, -10, 0};
    const auto result = solver.solve(loading, view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::unbounded) << name(result.status);
    EXPECT_NE(result.message.find("along y"), std::string::npos) << result.message;
    EXPECT_EQ(largest(u), 0);
}

/// With kappa < 0 the quadratic energy falls like stretch^6; the mean-stretch one grows as the springs' does.
TEST(HardCases, TensionBelowAQuarter) {
    const Lattice lattice = Lattice::box(4, 12, 4, kCellSize);
    const PlateMotion stretched = translated({0, 0.2 * 12 * kCellSize, 0});
    for (double nu : {0.0, -0.5}) {
        SCOPED_TRACE(nu);
        Field<double> u(lattice.grid_node_count());
        EquilibriumSolver<double> quadratic(lattice, {.poisson_ratio = nu, .volume_energy = VolumeEnergy::quadratic});
        const auto failed = quadratic.solve(plates(lattice, stretched), view(u));
        EXPECT_EQ(failed.status, EquilibriumStatus::unbounded) << failed.message;
        EXPECT_NE(failed.message.find("energy falls without end"), std::string::npos) << failed.message;
        EXPECT_TRUE(std::isfinite(largest(u)));

        u.assign(u.size(), {0, 0, 0});
        EquilibriumSolver<double> stretch(lattice, {.poisson_ratio = nu});
        const auto result = stretch.solve(plates(lattice, stretched), view(u));
        EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
        EXPECT_GT(result.min_cell_volume_ratio, 0.5);
    }
}

/// A straight rod held in compression is a saddle point: a push of one part in a million must make it buckle.
TEST(HardCases, ACompressedRodBuckles) {
    const Lattice lattice = Lattice::box(1, 24, 1, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count());
    Loading loading = plates(lattice, translated({0, -0.1 * 24 * kCellSize, 0}));
    loading.forces.assign(u.size(), {1e-3, 0, 0});
    const auto result = solver.solve(loading, view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_GT(result.negative_curvatures, 0);
    EXPECT_GT(largest(u), 2 * kCellSize);
}

/// Without a volume energy (nu = 1/4) half the height crushes the springs' cells; the state left is not inverted.
TEST(HardCases, CrushedCellsEndTheSolve) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count());
    const auto result = solver.solve(plates(lattice, translated({0, -0.7 * 4 * kCellSize, 0})), view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::inverted) << name(result.status);
    EXPECT_GT(result.min_cell_volume_ratio, 0);
    EXPECT_GT(result.load_fraction, 0.2);
    EXPECT_LT(result.load_fraction, 1);
}

TEST(HardCases, AScrambledBodyRecovers) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u = random_field(solver.node_count(), 0.4 * kCellSize, 5), f(u.size());
    const Loading loading = held_at_low_y(lattice);
    const double before = solver.get_forces(view(u), view(f)).total();
    const auto result = solver.solve(loading, view(u));
    EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
    EXPECT_LT(result.potential, 1e-12 * before);
    EXPECT_LT(largest(u), 1e-6 * kCellSize);
}

TEST(HardCases, WhatIsNotFiniteIsRefused) {
    const Lattice lattice = Lattice::box(2, 2, 2, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count());
    u[3][1] = std::nan("");
    EXPECT_THROW(solver.solve({}, view(u)), std::invalid_argument);
    u[3][1] = 0;
    Loading loading;
    loading.acceleration = {0, std::numeric_limits<double>::infinity(), 0};
    EXPECT_THROW(solver.solve(loading, view(u)), std::invalid_argument);

    EquilibriumSolver<float> in_float(lattice, {});
    Field<float> narrow(u.size());
    loading.acceleration = {0, 1e39, 0};
    expect_refusal([&] { in_float.solve(loading, view(narrow)); },
                   {"load on node 0", "finite in the body's precision"});
    loading.acceleration = {0, 0, 0};
    loading.supports = {{4, 2, {0, 1e39, 0}, {0, 0, 0}}};
    expect_refusal([&] { in_float.solve(loading, view(narrow)); },
                   {"prescribed displacement of node 4", "finite in the body's precision"});
    EXPECT_EQ(narrow, Field<float>(u.size())) << "refused before anything is written";
}

TEST(HardCases, NoAxisIsHeldTwiceAndNoFieldSharesMemory) {
    const Lattice lattice = Lattice::box(2, 2, 2, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count()), v(solver.node_count());
    Loading loading;
    loading.supports = {{4, 1}, {5, 7}, {4, 3}};
    expect_refusal([&] { solver.solve(loading, view(u)); }, {"prescribed node 4: given twice along x"});
    loading.supports.back().axes = 6;
    EXPECT_EQ(solver.solve(loading, view(u)).status, EquilibriumStatus::converged);
    const VectorField<double> same = VectorField<double>::soa(u[0].data(), u[0].data(), u[0].data(), u.size());
    expect_refusal([&] { solver.solve({}, same); }, {"must be different memory"});
    expect_refusal([&] { solver.step({}, 0.1, 0, view(u), view(u)); }, {"other memory than what is read"});
    expect_refusal([&] { solver.step({}, 0.1, 0, view(u), {nullptr, nullptr, nullptr, 3, u.size()}); }, {"x is null"});
    expect_refusal([&] { solver.step({}, 0.1, 0, view(u), VectorField<double>::aos(v[0].data(), u.size(), 0)); },
                   {"stride = 0"});
    expect_refusal([&] { solver.get_forces(view(u), view(u)); }, {"other memory than what is read"});
}

TEST(HardCases, ANetworkAndItsLatticeAgree) {
    const Material material{.poisson_ratio = 0.4};
    Lattice lattice = Lattice::box(3, 4, 3, kCellSize);
    lattice.remove_cells(std::vector<std::array<int, 3>>{{0, 1, 0}, {2, 2, 1}});
    const Loading loading = [&] {
        Loading l = held_at_low_y(lattice);
        l.acceleration = {0.2, -0.5, 0.1};
        return l;
    }();
    EquilibriumSolver<double> of_lattice(lattice, material), of_network(Network::from_lattice(lattice, material));
    Field<double> u(of_lattice.node_count()), v(u.size());
    const auto one = of_lattice.solve(loading, view(u)), other = of_network.solve(loading, view(v));
    ASSERT_EQ(one.status, EquilibriumStatus::converged) << one.message;
    ASSERT_EQ(other.status, EquilibriumStatus::converged) << other.message;
    for (std::size_t n = 0; n < u.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(u[n][c], v[n][c], 1e-6 * largest(u));
        }
    }
}

TEST(HardCases, ThreadsDoNotChangeABit) {
    const Lattice lattice = Lattice::box(13, 14, 15, kCellSize);
    // At nu = 0.499 multigrid smooths rotations too.
    for (const auto& [kind, nu] :
         {std::pair{PreconditionerKind::block_jacobi, 0.45}, std::pair{PreconditionerKind::multigrid, 0.45},
          std::pair{PreconditionerKind::multigrid, 0.499}}) {
        Field<double> first;
        for (int threads : {1, 2, 3}) {
            PlanOptions options;
            options.threads = threads;
            EquilibriumSolver<double> solver(lattice, {.poisson_ratio = nu}, options);
            Field<double> u(solver.node_count());
            EquilibriumOptions limits;
            limits.tolerance = 1e-4;
            limits.preconditioner = kind;
            const auto result = solver.solve(plates(lattice, translated({0.3, -0.5, 0})), view(u), limits);
            EXPECT_EQ(result.status, EquilibriumStatus::converged) << result.message;
            if (first.empty()) {
                first = u;
            }
            EXPECT_EQ(u, first) << threads << " threads, " << name(kind);
        }
    }
}

/// Progress is told within a Newton iteration too, changes no bit, and stops a solve there.
TEST(HardCases, ProgressIsToldAtEveryIteration) {
    const Lattice lattice = Lattice::box(6, 7, 5, kCellSize);
    const Loading loading = plates(lattice, translated({0.3, -0.4, 0}));
    EquilibriumSolver<double> silent(lattice, {}), told(lattice, {});
    Field<double> u(silent.node_count()), v(u.size());
    const auto result = silent.solve(loading, view(u));
    long calls = 0, last = 0;
    EquilibriumOptions options;
    options.progress = [&](const EquilibriumProgress& progress) {
        ++calls;
        EXPECT_GE(progress.cg_iterations, last);
        last = progress.cg_iterations;
        return true;
    };
    ASSERT_EQ(told.solve(loading, view(v), options).status, EquilibriumStatus::converged);
    EXPECT_EQ(u, v);
    EXPECT_GE(calls, result.cg_iterations);
    options.progress = [&](const EquilibriumProgress& progress) { return progress.cg_iterations < 60; };
    v.assign(v.size(), {0, 0, 0});
    const auto stopped = told.solve(loading, view(v), options);
    EXPECT_EQ(stopped.status, EquilibriumStatus::stopped);
    EXPECT_EQ(stopped.cg_iterations, 60);
    EXPECT_GT(told.estimate_seconds(), 0);
}

/// Backward Euler on one free fall: v = t g after every step, u = g dt^2 (1 + 2 + ... + n).
TEST(BackwardEuler, FallsFreely) {
    const Lattice lattice = Lattice::box(2, 2, 2, kCellSize);
    EquilibriumSolver<double> solver(lattice, {});
    Field<double> u(solver.node_count()), v(u.size());
    Loading loading;
    loading.acceleration = {0, -10, 0};
    const double dt = 0.1;
    for (int step = 1; step <= 5; ++step) {
        const auto result = solver.step(loading, dt, 0, view(u), view(v));
        ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
        for (std::size_t n = 0; n < u.size(); ++n) {
            ASSERT_NEAR(v[n][1], -10 * dt * step, 1e-6);
            ASSERT_NEAR(u[n][1], -10 * dt * dt * step * (step + 1) / 2, 1e-6);
        }
    }
}

/// Steps of a hundred times the explicit limit settle to the static equilibrium.
TEST(BackwardEuler, SettlesToTheStaticEquilibrium) {
    const Lattice lattice = Lattice::box(4, 4, 4, kCellSize);
    const Material material{};
    EquilibriumSolver<double> solver(lattice, material);
    const ForcePlan<double> plan(lattice, material);
    const Loading loading = plates(lattice, translated({0, -0.2 * 4 * kCellSize, 0}));
    Field<double> fixed(solver.node_count()), u(fixed.size()), v(fixed.size());
    ASSERT_EQ(solver.solve(loading, view(fixed)).status, EquilibriumStatus::converged);
    for (int step = 0; step < 60; ++step) {
        const auto result = solver.step(loading, 100 * plan.critical_time_step(), 1, view(u), view(v));
        ASSERT_EQ(result.status, EquilibriumStatus::converged) << step << ": " << result.message;
    }
    for (std::size_t n = 0; n < u.size(); ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(u[n][c], fixed[n][c], 1e-4 * largest(fixed));
        }
    }
}

} // namespace
} // namespace hybmss::testing
