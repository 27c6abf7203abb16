#include "integrations/petsc/motion.hpp"
#include "integrations/petsc/tests/whole_body.hpp"

#include <gtest/gtest.h>

namespace hybmss::distributed {
namespace {

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

} // namespace
} // namespace hybmss::distributed
