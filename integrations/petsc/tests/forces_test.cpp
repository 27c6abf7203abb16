#include "integrations/petsc/block_forces.hpp"
#include "integrations/petsc/tests/whole_body.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <gtest/gtest.h>

#include <random>

namespace hybmss::distributed {
namespace {

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

} // namespace
} // namespace hybmss::distributed
