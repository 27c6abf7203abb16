#include "integrations/petsc/commands.hpp"

#include "integrations/petsc/equilibrium.hpp"

#include <cstdio>

namespace hybmss::distributed {

bool run_equilibrium(const EquilibriumArguments& arguments) {
    const BodyArguments& body = arguments.body;
    const Block block(PETSC_COMM_WORLD, body.grid());
    BlockForces forces(block, body.material, body.plan_options());
    const double height = body.cell_size * static_cast<double>(body.cells[1]);
    OwnedVec u;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecSet(u, 0));
    for (int step = 1; step <= arguments.load_steps; ++step) {
        const double way = -arguments.compression * height * step / arguments.load_steps;
        const Supports plates = [&](PetscInt, PetscInt j, PetscInt) -> std::optional<std::array<double, 3>> {
            if (j == 0 || j == body.cells[1]) {
                return std::array<double, 3>{0, j == 0 ? 0 : way, 0};
            }
            return std::nullopt;
        };
        const DistributedEquilibrium result = solve_equilibrium(forces, plates, {0, 0, 0}, u);
        if (!result.converged) {
            throw std::runtime_error("no equilibrium at load step " + std::to_string(step) + " of " +
                                     std::to_string(arguments.load_steps) + ": " + result.reason +
                                     "; more steps may find one (--load-steps)");
        }
        if (block.rank() == 0) {
            std::printf("load step %d: %s, %d Newton iterations, %d of CG, residual %.3g N\n", step,
                        result.reason.c_str(), result.newton_iterations, result.linear_iterations, result.residual);
        }
    }
    const auto force = support_force(forces, body.cells[1]);
    const double energy = forces.energy();
    if (block.rank() == 0) {
        std::printf("force of the plate %.10g N, elastic energy %.10g J\n", -force[1], energy);
    }
    return save_and_compare(arguments.result, block, u);
}

} // namespace hybmss::distributed
