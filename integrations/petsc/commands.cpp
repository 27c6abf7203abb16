#include "integrations/petsc/commands.hpp"

#include "integrations/petsc/equilibrium.hpp"
#include "integrations/petsc/motion.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

namespace hybmss::distributed {

Grid BodyArguments::grid() const {
    Grid grid{cells, cell_size, {}};
    if (hollow) {
        grid.scale = [all = cells](PetscInt i, PetscInt j, PetscInt k) {
            const std::array<PetscInt, 3> at = {i, j, k};
            for (std::size_t a = 0; a < 3; ++a) {
                if (std::min(at[a], all[a] - 1 - at[a]) < 2) {
                    return 1.0f;
                }
            }
            return 0.0f;
        };
    }
    return grid;
}

PlanOptions BodyArguments::plan_options() const {
    PlanOptions options;
    options.threads = threads;
    // What is chosen must not depend on a machine's load, or a restart would go on with other roundings.
    options.effort = Effort::estimate;
    return options;
}

double BodyArguments::cell_count() const {
    return static_cast<double>(cells[0]) * static_cast<double>(cells[1]) * static_cast<double>(cells[2]);
}

bool save_and_compare(const ResultArguments& arguments, const Block& block, Vec displacement) {
    if (!arguments.save.empty()) {
        check(VecView(displacement, open_binary(block.communicator(), arguments.save, FILE_MODE_WRITE)));
    }
    if (arguments.compare.empty()) {
        return true;
    }
    OwnedVec other;
    check(VecDuplicate(displacement, other.make()));
    if (VecLoad(other, open_binary(block.communicator(), arguments.compare, FILE_MODE_READ)) != 0) {
        throw std::invalid_argument(arguments.compare + ": no displacements of this grid");
    }
    double greatest = 0, difference = 0;
    check(VecNorm(other, NORM_INFINITY, &greatest));
    check(VecAXPY(other, -1, displacement));
    check(VecNorm(other, NORM_INFINITY, &difference));
    if (block.rank() == 0) {
        std::printf("difference from %s: %.3g of the greatest displacement (allowed: %.3g)\n",
                    arguments.compare.c_str(), difference / greatest, arguments.tolerance);
    }
    return difference <= arguments.tolerance * greatest;
}

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

void run_race(const RaceArguments& arguments) {
    struct Runner {
        const char* name;
        std::unique_ptr<Motion> motion;
        std::vector<double> seconds = {}; ///< a step, of each round
    };
    const BodyArguments& body = arguments.body;
    const Block block(PETSC_COMM_WORLD, body.grid());
    BlockForces forces(block, body.material, body.plan_options());
    const Supports free = [](PetscInt, PetscInt, PetscInt) { return std::nullopt; };
    const auto fused = [&](bool single) {
        return make_fused_motion(single, block, body.material, free, body.plan_options());
    };
    Runner runners[] = {
        {"fused double", fused(false)}, {"ts double", make_ts_motion(forces, free)}, {"fused float", fused(true)}};
    const StepParameters parameters{.time_step = 0.7 * forces.critical_time_step(), .acceleration = {0, -10, 0}};

    for (int round = -1; round < arguments.rounds; ++round) { // the first warms up
        for (Runner& runner : runners) {
            MPI_Barrier(block.communicator());
            const double start = MPI_Wtime();
            runner.motion->step(parameters, arguments.steps);
            MPI_Barrier(block.communicator());
            if (round >= 0) {
                runner.seconds.push_back((MPI_Wtime() - start) / static_cast<double>(arguments.steps));
            }
        }
    }
    if (block.rank() != 0) {
        return;
    }
    std::printf("ranks %d, %.0f cells, %d rounds of %ld steps by turns\n", block.ranks(), body.cell_count(),
                arguments.rounds, arguments.steps);
    std::printf("%-14s %14s %14s %18s %16s\n", "", "least ms/step", "median ms/step", "least ns/cell/step",
                "to fused double");
    double first = 0;
    for (Runner& runner : runners) {
        std::sort(runner.seconds.begin(), runner.seconds.end());
        const double least = runner.seconds.front(), median = runner.seconds[runner.seconds.size() / 2];
        first = first > 0 ? first : least;
        std::printf("%-14s %14.4f %14.4f %18.3f %16.2f\n", runner.name, 1e3 * least, 1e3 * median,
                    1e9 * least / body.cell_count(), least / first);
    }
}

void print_model(const std::array<long, 3>& cells, long ranks) {
    std::array<long, 3> nodes, block;
    for (std::size_t a = 0; a < 3; ++a) {
        nodes[a] = cells[a] + 1;
    }
    const ProcessGrid processes = choose_process_grid(nodes, ranks);
    double owned = 1;
    for (std::size_t a = 0; a < 3; ++a) {
        block[a] = (nodes[a] + processes[a] - 1) / processes[a];
        owned *= static_cast<double>(block[a]);
    }
    const double ghosts = most_ghosts(nodes, processes);
    std::printf("%ld x %ld x %ld cells on %ld x %ld x %ld ranks: a rank owns at most %ld x %ld x %ld nodes = %.6g\n",
                cells[0], cells[1], cells[2], processes[0], processes[1], processes[2], block[0], block[1], block[2],
                owned);
    std::printf("ghosts: at most %.0f, %.3g of the nodes owned\n", ghosts, ghosts / owned);
    for (const int bytes : {4, 8}) {
        std::printf("%s: a rank receives at most %.0f bytes a step, all ranks at most %.4g\n",
                    bytes == 4 ? "float" : "double", 3 * bytes * ghosts,
                    3 * bytes * ghosts * static_cast<double>(ranks));
    }
}

} // namespace hybmss::distributed
