// hybmss_distributed: one box of cells on the ranks of mpirun. Exit codes as hybmss: 0 good, 1 failed, 2 bad input.

#include "integrations/petsc/commands.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <thread>

namespace {

using namespace hybmss;
using namespace hybmss::distributed;

void add_body_options(CLI::App& command, BodyArguments& body) {
    command.add_option("--cells", body.cells, "along x, y and z: NX,NY,NZ")
        ->delimiter(',')
        ->check(CLI::Range(1, 1000000));
    command.add_option("--cell-size", body.cell_size, "m")->capture_default_str();
    command.add_option("--young", body.material.young_modulus, "Pa")->capture_default_str();
    command.add_option("--poisson", body.material.poisson_ratio)->capture_default_str();
    command.add_option("--crush-resistance", body.material.crush.stiffness)->capture_default_str();
    command.add_option("--density", body.material.density, "kg/m^3")->capture_default_str();
    command.add_option("--face-diagonal-ratio", body.material.face_diagonal_ratio)->capture_default_str();
    command.add_flag_callback(
        "--springs-on-means", [&body] { body.material.springs = SpringForm::means; }, "HybMSS-M");
    command.add_flag("--hollow", body.hollow, "only the outer two layers of cells");
    command.add_option("--threads", body.threads, "of every rank")->capture_default_str()->check(CLI::Range(1, 4096));
}

void add_result_options(CLI::App& command, ResultArguments& result) {
    command.add_option("--save", result.save, "write the displacements, in the grid's order, to this file");
    command.add_option("--compare", result.compare, "with displacements saved before; exit code 1 where they differ");
    command.add_option("--tolerance", result.tolerance, "of --compare, of the greatest displacement")
        ->capture_default_str();
}

void add_motion(CLI::App& app, MotionArguments& arguments, bool& good) {
    CLI::App* command = app.add_subcommand("motion", "a beam, clamped at x = 0, that falls under its weight");
    add_body_options(*command, arguments.body);
    add_result_options(*command, arguments.result);
    command->add_option("--steps", arguments.steps, "of the whole run, restarted or not")
        ->capture_default_str()
        ->check(CLI::Range(0L, 1000000000L));
    command->add_option("--time-step", arguments.time_step, "s; by default 0.7 of the critical one")
        ->check(CLI::PositiveNumber);
    command->add_option("--mass-damping", arguments.mass_damping, "1/s")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command->add_option("--gravity", arguments.gravity, "m/s^2: X,Y,Z")->delimiter(',');
    command->add_option("--method", arguments.method, "fused or ts")->capture_default_str();
    command->add_option("--precision", arguments.precision, "float or double")->capture_default_str();
    CLI::Option* checkpoint = command->add_option("--checkpoint", arguments.checkpoint,
                                                  "file, written at the end and as --checkpoint-every says");
    command->add_option("--checkpoint-every", arguments.checkpoint_every, "steps")
        ->check(CLI::PositiveNumber)
        ->needs(checkpoint);
    command->add_option("--restart", arguments.restart, "checkpoint to go on from");
    command->callback([&] { good = run_motion(arguments); });
}

void add_race(CLI::App& app, RaceArguments& arguments) {
    CLI::App* command = app.add_subcommand("race", "the ways to step a free body, timed by turns in one run");
    add_body_options(*command, arguments.body);
    command->add_option("--steps", arguments.steps, "of a round")
        ->capture_default_str()
        ->check(CLI::Range(1L, 1000000L));
    command->add_option("--rounds", arguments.rounds)->capture_default_str()->check(CLI::Range(1, 10000));
    command->callback([&] { run_race(arguments); });
}

void add_equilibrium(CLI::App& app, EquilibriumArguments& arguments, bool& good) {
    CLI::App* command = app.add_subcommand("equilibrium", "a box pressed together along y between clamped plates");
    add_body_options(*command, arguments.body);
    add_result_options(*command, arguments.result);
    command->add_option("--compression", arguments.compression, "of the height")
        ->capture_default_str()
        ->check(CLI::Range(-10.0, 0.99));
    command->add_option("--load-steps", arguments.load_steps, "at least")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000));
    command->add_option("--residual", arguments.residual, "largest unbalanced force over the largest support force")
        ->capture_default_str()
        ->check(CLI::Range(1e-14, 0.1));
    command->add_option("--preconditioner", arguments.preconditioner, "automatic, block-jacobi or multigrid")
        ->capture_default_str();
    command->callback([&] { good = run_equilibrium(arguments); });
}

void add_elasticity(CLI::App& app, ElasticityArguments& arguments) {
    CLI::App* command = app.add_subcommand(
        "elasticity", "a cube pressed together by ours and by finite elements with PETSc's GAMG, timed by turns");
    command->add_option("--edges", arguments.edges, "cells along each of the cube's: N,N,...")
        ->delimiter(',')
        ->check(CLI::Range(1, 1000));
    command->add_option("--poisson", arguments.poisson, "NU,NU,...")->delimiter(',')->check(CLI::Range(-0.99, 0.4999));
    command->add_option("--compression", arguments.compression, "of the height")
        ->capture_default_str()
        ->check(CLI::Range(-10.0, 0.99));
    command->add_option("--residual", arguments.residual, "largest unbalanced force over the largest support force")
        ->capture_default_str()
        ->check(CLI::Range(1e-14, 0.1));
    command->add_option("--crush-resistance", arguments.crush_resistance, "of ours alone")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command->add_option("--rounds", arguments.rounds)->capture_default_str()->check(CLI::Range(1, 1000));
    command->callback([&] { run_elasticity(arguments); });
}

int run(int argc, char** argv, int rank) {
    bool good = true;
    CLI::App app("One box of cells on the ranks of mpirun. PETSc's own options are read from PETSC_OPTIONS.");
    app.require_subcommand(1);
    MotionArguments motion;
    RaceArguments race;
    motion.body.material.young_modulus = race.body.material.young_modulus = 1e6;
    EquilibriumArguments equilibrium;
    ElasticityArguments elasticity;
    add_motion(app, motion, good);
    add_race(app, race);
    add_equilibrium(app, equilibrium, good);
    add_elasticity(app, elasticity);

    CLI::App* model = app.add_subcommand("model", "bytes that a rank receives in a step, on paper");
    std::array<long, 3> cells = {1000, 1000, 1000};
    long ranks = 512;
    model->add_option("--cells", cells, "along x, y and z: NX,NY,NZ")->delimiter(',')->check(CLI::Range(1L, 1000000L));
    model->add_option("--ranks", ranks)->capture_default_str()->check(CLI::Range(1L, 1000000000L));
    model->callback([&] {
        if (rank == 0) {
            print_model(cells, ranks);
        }
    });
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& help) {
        return rank == 0 ? app.exit(help) : 0;
    } catch (const CLI::ParseError& error) {
        throw std::invalid_argument(error.what());
    }
    return good ? 0 : 1;
}

/// Says why, and ends all ranks. What is wrong is mostly wrong on every rank: the others leave the word to the first.
[[noreturn]] void end(int rank, int code, const char* why) {
    if (rank > 0) {
        std::this_thread::sleep_for(std::chrono::seconds(1));
        std::fprintf(stderr, "hybmss_distributed: rank %d: %s\n", rank, why);
    } else {
        std::fprintf(stderr, "hybmss_distributed: %s\n", why);
    }
    std::fflush(nullptr);
    MPI_Abort(MPI_COMM_WORLD, code);
    std::abort();
}

} // namespace

int main(int argc, char** argv) {
    int threads = 0, rank = 0, code = 0;
    MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &threads);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    // Where a rank dies, mpirun says which and ends the others: PETSc's own report of the signal hides that.
    if (PetscInitializeNoPointers(0, nullptr, nullptr, nullptr) != 0 || PetscPopSignalHandler() != 0) {
        end(rank, 1, "PETSc does not start");
    }
    PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
    try {
        code = run(argc, argv, rank);
    } catch (const std::invalid_argument& error) {
        end(rank, 2, error.what());
    } catch (const std::exception& error) {
        end(rank, 1, error.what());
    }
    PetscFinalize();
    MPI_Finalize();
    return code;
}
