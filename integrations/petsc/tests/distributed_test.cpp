// Started by mpirun: what a body on several ranks computes beside the same body on one. Every rank also has the body as
// a whole. Differences are those of all ranks: each expectation holds on all of them, or fails on all.

#include "integrations/petsc/equilibrium.hpp"
#include "integrations/petsc/motion.hpp"

#include "hybmss/equilibrium.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace hybmss::distributed {
namespace {

struct Body {
    Grid grid;
    Lattice lattice;
    Material material;
};

Body box(Material material) {
    return {Grid{{7, 6, 9}, 0.1, {}}, Lattice::box(7, 6, 9, 0.1), material};
}

/// One cell of four missing, the others of several stiffnesses: no rank's block is full, and nodes are missing too.
Body sparse(Material material) {
    const auto scale = [](PetscInt i, PetscInt j, PetscInt k) {
        const auto mixed = static_cast<unsigned>(i * 7 + j * 13 + k * 29 + i * j * 3 + j * k * 5) * 2654435761u >> 28;
        return mixed < 4 || i + j + k < 4 ? 0.0f : static_cast<float>(mixed) / 8;
    };
    std::vector<float> scales;
    for (int k = 0; k < 6; ++k) {
        for (int j = 0; j < 8; ++j) {
            for (int i = 0; i < 7; ++i) {
                scales.push_back(scale(i, j, k));
            }
        }
    }
    return {Grid{{7, 8, 6}, 0.1, scale}, Lattice::from_cells(7, 8, 6, 0.1, scales), material};
}

std::vector<Body> bodies() {
    const Material plain{1e5, 0.3, 1000, 1, VolumeEnergy::automatic}, no_faces{1e5, 0, 900, 0, VolumeEnergy::automatic};
    // Springs on means reach no farther than their cell, nor does what keeps it from being crushed.
    Material on_means = no_faces;
    on_means.springs = SpringForm::means;
    on_means.crush = {20, 0.95};
    return {box(plain), box(no_faces), sparse(plain), sparse(no_faces), box(on_means), sparse(on_means)};
}

PlanOptions one_thread() {
    PlanOptions options;
    options.threads = 1;
    return options;
}

/// Visits every owned node that the body has: its number in the body, and its index in the rank's vectors.
template <class Visit>
void for_each_node(const Block& block, const Lattice& lattice, const Visit& visit) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto [nx, ny, nz] = lattice.cells();
        const NodeBox grid{{0, 0, 0}, {nx + 1, ny + 1, nz + 1}};
        const auto [i, j, k] = grid.place(nodes[n]);
        if (block.owned().holds(i, j, k)) {
            visit(n, block.owned().index(i, j, k));
        }
    }
}

double greatest_of_ranks(double own) {
    double all = 0;
    MPI_Allreduce(&own, &all, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    return all;
}

std::vector<double> values_of(Vec vector) {
    PetscInt size = 0;
    const PetscScalar* values = nullptr;
    check(VecGetLocalSize(vector, &size));
    check(VecGetArrayRead(vector, &values));
    std::vector<double> copy(values, values + size);
    check(VecRestoreArrayRead(vector, &values));
    return copy;
}

/// |distributed - whole| / scale[node], the greatest over nodes and ranks. NaN counts as infinite.
template <class Whole, class Scale>
double difference(const Block& block, const Lattice& lattice, Vec vector, const Whole& whole, const Scale& scale) {
    const std::vector<double> ours = values_of(vector);
    double greatest = 0;
    for_each_node(block, lattice, [&](std::size_t n, std::size_t owned) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double error = std::abs(ours[3 * owned + c] - static_cast<double>(whole(n, c))) / scale(n);
            greatest = std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(greatest, error);
        }
    });
    return greatest_of_ranks(greatest);
}

using reference::Vector3d;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

std::vector<Vector3d> random_field(const Lattice& lattice, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> component(-0.2 * lattice.cell_size(), 0.2 * lattice.cell_size());
    std::vector<Vector3d> field(lattice.nodes().size());
    for (Vector3d& node : field) {
        node = {component(random), component(random), component(random)};
    }
    return field;
}

OwnedVec distribute(const Block& block, const Lattice& lattice, const std::vector<Vector3d>& field) {
    OwnedVec vector;
    check(DMCreateGlobalVector(block.nodes(), vector.make()));
    check(VecSet(vector, 0));
    PetscScalar* values = nullptr;
    check(VecGetArray(vector, &values));
    for_each_node(block, lattice,
                  [&](std::size_t n, std::size_t owned) { std::copy_n(field[n].data(), 3, values + 3 * owned); });
    check(VecRestoreArray(vector, &values));
    return vector;
}

TEST(BesideOneMachine, ForcesEnergyAndSecondDerivativesAreTheReferences) {
    for (const Body& body : bodies()) {
        const Block block(PETSC_COMM_WORLD, body.grid);
        BlockForces forces(block, body.material, one_thread());
        const reference::Body whole = reference::assemble(body.lattice, body.material);
        const auto u = random_field(body.lattice, 1), p = random_field(body.lattice, 2);
        const OwnedVec displacement = distribute(block, body.lattice, u),
                       direction = distribute(block, body.lattice, p);
        OwnedVec out;
        check(VecDuplicate(displacement, out.make()));
        forces.set_displacement(displacement);

        // As in `hybmss verify`: of the sum of magnitudes of all that acts on a node, in which the rest may cancel.
        const auto expect_equal = [&](const std::vector<Vector3d>& expected, const std::vector<double>& scale) {
            const double error = difference(
                block, body.lattice, out,
                [&](std::size_t n, std::size_t c) { return expected[n][static_cast<int>(c)]; },
                [&](std::size_t n) { return scale[n]; });
            EXPECT_LE(error, 8 * kEpsilon);
        };
        forces.get_forces(out);
        expect_equal(reference::forces(whole, u), reference::force_scale(whole, u));
        forces.get_hessian_product(direction, out);
        expect_equal(reference::hessian_product(whole, u, p), reference::hessian_product_scale(whole, u, p));
        EXPECT_NEAR(forces.energy() / reference::energy(whole, u).total(), 1, 32 * kEpsilon);

        const double mass_error = difference(
            block, body.lattice, forces.masses(), [&](std::size_t n, std::size_t) { return whole.mass[n]; },
            [&](std::size_t n) { return whole.mass[n]; });
        EXPECT_LE(mass_error, 8 * kEpsilon);

        const std::vector<double> blocks = forces.hessian_diagonal();
        const auto expected = reference::hessian_diagonal(whole, u);
        double block_error = 0;
        for_each_node(block, body.lattice, [&](std::size_t n, std::size_t owned) {
            const int places[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
            for (std::size_t e = 0; e < 6; ++e) {
                const double error = blocks[6 * owned + e] - expected[n](places[e][0], places[e][1]);
                block_error = std::max(block_error, std::abs(error) / expected[n].norm());
            }
        });
        EXPECT_LE(greatest_of_ranks(block_error), 64 * kEpsilon);
    }
}

/// The body pressed together along y by the way (m), in a weight: on the ranks and as a whole.
void expect_same_equilibrium(const Body& body, bool cut_evenly, PreconditionerKind kind, double way,
                             EquilibriumOptions options) {
    const int top = body.lattice.cells()[1];
    const Block block(PETSC_COMM_WORLD, body.grid, cut_evenly);
    BlockForces forces(block, body.material, one_thread());
    OwnedVec u;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecSet(u, 0));
    const auto plates = [&](PetscInt, PetscInt j, PetscInt) {
        return j == 0 || j == top ? std::optional(std::array<double, 3>{0, j == 0 ? 0 : way, 0}) : std::nullopt;
    };
    options.preconditioner = kind;
    const EquilibriumResult found = solve_equilibrium(forces, plates, {0, -10, 2}, u, options);
    ASSERT_EQ(found.status, EquilibriumStatus::converged) << found.message;
    EXPECT_EQ(found.preconditioner, name(kind));

    Loading loading;
    loading.acceleration = {0, -10, 2};
    const std::vector<std::uint32_t> nodes = body.lattice.nodes();
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        const double y = body.lattice.rest_position(nodes[n])[1] / body.lattice.cell_size();
        if (y == 0 || y > top - 0.5) {
            loading.supports.push_back({.node = n, .displacement = {0, y == 0 ? 0 : way, 0}});
        }
    }
    EquilibriumSolver<double> solver(body.lattice, body.material, one_thread());
    std::vector<double> expected(3 * solver.node_count());
    const EquilibriumResult whole =
        solver.solve(loading, VectorField<double>::aos(expected.data(), solver.node_count()), options);
    ASSERT_EQ(whole.status, EquilibriumStatus::converged) << whole.message;
    EXPECT_EQ(found.coarser_meshes, whole.coarser_meshes);
    // The same cycle, whose smoothers take their bounds from random vectors that differ: here and there one more.
    EXPECT_NEAR(found.newton_iterations, whole.newton_iterations, 1);
    EXPECT_NEAR(static_cast<double>(found.cg_iterations), static_cast<double>(whole.cg_iterations),
                std::max<double>(1, 0.02 * static_cast<double>(whole.cg_iterations)));
    EXPECT_NEAR(found.min_cell_volume_ratio, whole.min_cell_volume_ratio, 1e-6);
    EXPECT_NEAR(found.max_cell_volume_ratio, whole.max_cell_volume_ratio, 1e-6);
    EXPECT_NEAR(found.potential / whole.potential, 1, 1e-9);
    // Both end where forces balance to about the tolerance, of the plate's.
    EXPECT_LE(difference(
                  block, body.lattice, u, [&](std::size_t n, std::size_t c) { return expected[3 * n + c]; },
                  [&](std::size_t) { return -way; }),
              100 * options.tolerance);
}

TEST(BesideOneMachine, EquilibriumIsThatOfEquilibriumSolver) {
    EquilibriumOptions options;
    options.tolerance = 1e-11;
    const Body even{
        Grid{{7, 8, 12}, 0.1, {}}, Lattice::box(7, 8, 12, 0.1), {1e4, 0.3, 1000, 1, VolumeEnergy::automatic}};
    for (const PreconditionerKind kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
        expect_same_equilibrium(even, true, kind, -0.05 * 8 * 0.1, options);
        // Nodes that one rank alone has, of those where ranks meet.
        expect_same_equilibrium(sparse({1e5, 0.3, 1000, 1, VolumeEnergy::automatic}), true, kind, -0.01, options);
    }
    expect_same_equilibrium(box({1e4, 0.3, 1000, 1, VolumeEnergy::automatic}), false, PreconditionerKind::block_jacobi,
                            -0.05 * 6 * 0.1, options);
}

TEST(BesideOneMachine, EquilibriumComesByCoarserMeshes) {
    EquilibriumOptions options;
    options.tolerance = 1e-8;
    // With 0.499 the cells' rotations are smoothed too. Stiff enough not to sag far: where a solve takes dozens of
    // steps, roundings send it elsewhere.
    for (const double poisson_ratio : {0.45, 0.499}) {
        Material material{1e6, poisson_ratio, 1000, 1, VolumeEnergy::automatic};
        material.crush.stiffness = 20;
        const Body cube{Grid{{16, 16, 16}, 0.1, {}}, Lattice::box(16, 16, 16, 0.1), material};
        expect_same_equilibrium(cube, true, PreconditionerKind::multigrid, -0.2 * 16 * 0.1, options);
    }
}

TEST(BesideOneMachine, MultigridIsRefusedWhereCellsLieAcrossACut) {
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    const Body body = box({1e4, 0.3, 1000, 1, VolumeEnergy::automatic}); // cut at 5 of 10 nodes along z
    const Block block(PETSC_COMM_WORLD, body.grid, false);
    BlockForces forces(block, body.material, one_thread());
    OwnedVec u;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecSet(u, 0));
    EquilibriumOptions options;
    options.preconditioner = PreconditionerKind::multigrid;
    const Supports clamped = [](PetscInt, PetscInt j, PetscInt) {
        return j == 0 ? std::optional(std::array<double, 3>{0, 0, 0}) : std::nullopt;
    };
    if (ranks == 1) {
        EXPECT_EQ(solve_equilibrium(forces, clamped, {0, -1, 0}, u, options).status, EquilibriumStatus::converged);
    } else {
        EXPECT_THROW(solve_equilibrium(forces, clamped, {0, -1, 0}, u, options), std::invalid_argument);
    }
}

TEST(EvenCuts, FallOnPowersOfTwo) {
    EXPECT_EQ(even_cuts(64, 1), (std::vector<long>{0}));
    EXPECT_EQ(even_cuts(64, 2), (std::vector<long>{0, 32}));
    EXPECT_EQ(even_cuts(100, 2), (std::vector<long>{0, 48}));
    EXPECT_EQ(even_cuts(10, 2), (std::vector<long>{0, 4}));
    EXPECT_EQ(even_cuts(64, 3), (std::vector<long>{0, 24, 40}));
    EXPECT_EQ(even_cuts(3, 3), (std::vector<long>{0, 1, 2}));
    EXPECT_THROW(even_cuts(2, 3), std::invalid_argument);
}

/// The clamped beam of both: nodes with x = 0.
std::vector<PrescribedNode> clamped(const Lattice& lattice) {
    std::vector<PrescribedNode> held;
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        if (lattice.rest_position(nodes[n])[0] == 0) {
            held.push_back({.node = n});
        }
    }
    return held;
}
std::optional<std::array<double, 3>> clamp(PetscInt i, PetscInt, PetscInt) {
    return i == 0 ? std::optional(std::array<double, 3>{0, 0, 0}) : std::nullopt;
}

template <class T>
double motion_difference(const Body& body, const Block& block, Motion& motion, const StepParameters& parameters) {
    constexpr long kSteps = 30;
    motion.step(parameters, kSteps);
    OwnedVec u;
    check(DMCreateGlobalVector(block.nodes(), u.make()));
    motion.get_displacement(u);

    ExplicitDynamics<T> whole(body.lattice, body.material, one_thread());
    whole.prescribe(clamped(body.lattice));
    whole.step(parameters, kSteps);
    std::vector<T> expected(3 * whole.node_count());
    whole.get_displacements(VectorField<T>::aos(expected.data(), whole.node_count()));
    T greatest = 0;
    for (const T value : expected) {
        greatest = std::max(greatest, std::abs(value));
    }
    EXPECT_GT(greatest, T(1e-3));
    return difference(
        block, body.lattice, u, [&](std::size_t n, std::size_t c) { return expected[3 * n + c]; },
        [&](std::size_t) { return static_cast<double>(greatest); });
}

TEST(BesideOneMachine, MotionsAreThoseOfExplicitDynamics) {
    for (const Body& body : {bodies().front(), bodies().back()}) { // a full one, and a sparse one of another material
        const Block block(PETSC_COMM_WORLD, body.grid);
        BlockForces forces(block, body.material, one_thread());
        StepParameters parameters{.time_step = 0.7 * forces.critical_time_step(), .acceleration = {0.5, -10, 1}};
        EXPECT_EQ(parameters.time_step,
                  0.7 * ForcePlan<double>(body.lattice, body.material, one_thread()).critical_time_step());
        // Roundings of 30 steps, a few of epsilon each.
        const auto ts = make_ts_motion(forces, clamp);
        EXPECT_LE(motion_difference<double>(body, block, *ts, parameters), 1e-12);
        parameters.mass_damping = 3;
        const auto fused = make_fused_motion(false, block, body.material, clamp, one_thread());
        EXPECT_LE(motion_difference<double>(body, block, *fused, parameters), 1e-12);
        const auto single = make_fused_motion(true, block, body.material, clamp, one_thread());
        EXPECT_LE(motion_difference<float>(body, block, *single, parameters), 1e-4);
    }
}

TEST(ProcessGrid, HasTheFewestGhosts) {
    EXPECT_EQ(choose_process_grid({11, 11, 11}, 1), (ProcessGrid{1, 1, 1}));
    EXPECT_EQ(choose_process_grid({11, 11, 11}, 2), (ProcessGrid{1, 1, 2}));  // rows along x stay whole
    EXPECT_EQ(choose_process_grid({101, 11, 11}, 2), (ProcessGrid{2, 1, 1})); // but where the cut is smaller so
    EXPECT_EQ(choose_process_grid({1001, 1001, 1001}, 512), (ProcessGrid{8, 8, 8}));
    EXPECT_EQ(choose_process_grid({2, 2, 50}, 5), (ProcessGrid{1, 1, 5}));
    EXPECT_EQ(most_ghosts({11, 11, 11}, {1, 1, 2}), 11 * 11);
    EXPECT_EQ(most_ghosts({30, 30, 30}, {3, 3, 3}), 12 * 12 * 12 - 10 * 10 * 10);
}

TEST(ProcessGrid, RefusesRanksThatCannotAllHaveNodes) {
    EXPECT_EQ(choose_process_grid({3, 3, 3}, 27), (ProcessGrid{3, 3, 3}));
    EXPECT_THROW(choose_process_grid({3, 3, 3}, 7), std::invalid_argument);
    EXPECT_THROW(choose_process_grid({3, 3, 3}, 28), std::invalid_argument);
}

} // namespace
} // namespace hybmss::distributed

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    PetscInitializeNoPointers(0, nullptr, nullptr, nullptr);
    testing::InitGoogleTest(&argc, argv);
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    if (rank > 0) { // differences are of all ranks: one speaks for them
        delete listeners.Release(listeners.default_result_printer());
    }
    const int failed = RUN_ALL_TESTS();
    PetscFinalize();
    MPI_Finalize();
    return failed;
}
