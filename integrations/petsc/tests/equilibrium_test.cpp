#include "integrations/petsc/equilibrium.hpp"
#include "integrations/petsc/tests/whole_body.hpp"

#include "hybmss/equilibrium.hpp"

#include <gtest/gtest.h>

namespace hybmss::distributed {
namespace {

TEST(BesideOneMachine, EquilibriumIsThatOfEquilibriumSolver) {
    const Body body = box({1e4, 0.3, 1000, 1, VolumeEnergy::automatic});
    const double way = -0.05 * 6 * 0.1;
    const Block block(PETSC_COMM_WORLD, body.grid);
    BlockForces forces(block, body.material, one_thread());
    OwnedVec u;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecSet(u, 0));
    const auto plates = [&](PetscInt, PetscInt j, PetscInt) {
        return j == 0 || j == 6 ? std::optional(std::array<double, 3>{0, j == 0 ? 0 : way, 0}) : std::nullopt;
    };
    const DistributedEquilibrium found = solve_equilibrium(forces, plates, {0, -10, 2}, u);
    EXPECT_TRUE(found.converged) << found.reason;

    Loading loading;
    loading.acceleration = {0, -10, 2};
    const std::vector<std::uint32_t> nodes = body.lattice.nodes();
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        const double y = body.lattice.rest_position(nodes[n])[1];
        if (y == 0 || y > 0.55) {
            loading.supports.push_back({.node = n, .displacement = {0, y == 0 ? 0 : way, 0}});
        }
    }
    EquilibriumOptions options;
    options.tolerance = 1e-11;
    EquilibriumSolver<double> solver(body.lattice, body.material, one_thread());
    std::vector<double> expected(3 * solver.node_count());
    const EquilibriumResult whole =
        solver.solve(loading, VectorField<double>::aos(expected.data(), solver.node_count()), options);
    ASSERT_EQ(whole.status, EquilibriumStatus::converged) << whole.message;
    // Both end where forces balance to about 1e-10 of the plate's.
    EXPECT_LE(difference(
                  block, body.lattice, u, [&](std::size_t n, std::size_t c) { return expected[3 * n + c]; },
                  [&](std::size_t) { return -way; }),
              1e-9);
}

} // namespace
} // namespace hybmss::distributed
