#include "integrations/petsc/commands.hpp"

#include "integrations/petsc/motion.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

namespace hybmss::distributed {

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

} // namespace hybmss::distributed
