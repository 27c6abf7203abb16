#include "integrations/petsc/commands.hpp"

#include "integrations/petsc/equilibrium.hpp"
#include "integrations/petsc/finite_elements.hpp"
#include "integrations/petsc/motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>
#include <utility>
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

namespace {

/// Plates that hold both ends along y, the upper one moved by `way`.
Supports plates(PetscInt top, double way) {
    return [=](PetscInt, PetscInt j, PetscInt) -> std::optional<std::array<double, 3>> {
        if (j == 0 || j == top) {
            return std::array<double, 3>{0, j == 0 ? 0 : way, 0};
        }
        return std::nullopt;
    };
}

struct Pressed {
    int newton = 0;
    long krylov = 0;
    double seconds = 0, force = 0; ///< N: of the plate
};

void require_converged(bool converged, const char* who, const std::string& why) {
    if (!converged) {
        throw std::runtime_error(std::string("no equilibrium of ") + who + ": " + why);
    }
}

Pressed press_alone(const BodyArguments& body, const EquilibriumOptions& options, double way) {
    const double start = MPI_Wtime();
    const Lattice lattice = Lattice::box(static_cast<int>(body.cells[0]), static_cast<int>(body.cells[1]),
                                         static_cast<int>(body.cells[2]), body.cell_size);
    EquilibriumSolver<double> solver(lattice, body.material, body.plan_options());
    Loading loading;
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    const double height = body.cell_size * static_cast<double>(body.cells[1]);
    for (std::uint32_t n = 0; n < nodes.size(); ++n) {
        const double y = lattice.rest_position(nodes[n])[1];
        if (y == 0 || y == height) {
            loading.supports.push_back({.node = n, .displacement = {0, y == 0 ? 0 : way, 0}});
        }
    }
    std::vector<double> u(3 * nodes.size()), f(u.size());
    const auto field = [&](std::vector<double>& values) {
        return VectorField<double>::aos(values.data(), nodes.size());
    };
    const EquilibriumResult result = solver.solve(loading, field(u), options);
    Pressed pressed{result.newton_iterations, result.cg_iterations, MPI_Wtime() - start};
    require_converged(result.status == EquilibriumStatus::converged, "EquilibriumSolver", result.message);
    solver.get_forces(field(u), field(f));
    for (const PrescribedNode& held : loading.supports) {
        pressed.force += held.displacement[1] != 0 ? f[3 * held.node + 1] : 0;
    }
    return pressed;
}

Pressed press_on_ranks(const BodyArguments& body, const EquilibriumOptions& options, double way) {
    MPI_Barrier(PETSC_COMM_WORLD);
    const double start = MPI_Wtime();
    const Block block(PETSC_COMM_WORLD, body.grid(), true);
    BlockForces forces(block, body.material, body.plan_options());
    OwnedVec u;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecSet(u, 0));
    const EquilibriumResult result = solve_equilibrium(forces, plates(body.cells[1], way), {0, 0, 0}, u, options);
    const double seconds = MPI_Wtime() - start;
    require_converged(result.status == EquilibriumStatus::converged, "the ranks", result.message);
    return {result.newton_iterations, result.cg_iterations, seconds, -support_force(forces, body.cells[1])[1]};
}

Pressed press_elements(const BodyArguments& body, const ElasticityArguments& arguments) {
    MPI_Barrier(PETSC_COMM_WORLD);
    const double start = MPI_Wtime();
    const FiniteElementSolution found = press_finite_elements(PETSC_COMM_WORLD, body.cells, body.cell_size,
                                                              body.material, arguments.compression, arguments.residual);
    require_converged(found.converged, "finite elements", found.reason);
    return {found.newton_iterations, found.krylov_iterations, MPI_Wtime() - start, found.plate_force};
}

} // namespace

bool run_equilibrium(const EquilibriumArguments& arguments) {
    const BodyArguments& body = arguments.body;
    const Block block(PETSC_COMM_WORLD, body.grid(), true);
    BlockForces forces(block, body.material, body.plan_options());
    const double way = -arguments.compression * body.cell_size * static_cast<double>(body.cells[1]);
    OwnedVec u;
    check(VecDuplicate(forces.masses(), u.make()));
    check(VecSet(u, 0));
    EquilibriumOptions options;
    options.tolerance = arguments.residual;
    options.preconditioner = parse_preconditioner(arguments.preconditioner);
    options.first_load_step = options.largest_load_step = 1.0 / arguments.load_steps;
    const double start = MPI_Wtime();
    const EquilibriumResult result = solve_equilibrium(forces, plates(body.cells[1], way), {0, 0, 0}, u, options);
    const double seconds = MPI_Wtime() - start;
    require_converged(result.status == EquilibriumStatus::converged, "the body", result.message);
    const auto force = support_force(forces, body.cells[1]);
    const double energy = forces.energy();
    if (block.rank() == 0) {
        std::printf(
            "%s after %d coarser meshes: %d load steps, %d Newton iterations, %ld of CG, residual %.3g; %.3f s\n",
            std::string(result.preconditioner).c_str(), result.coarser_meshes, result.load_steps,
            result.newton_iterations, result.cg_iterations, result.residual, seconds);
        std::printf("force of the plate %.10g N, elastic energy %.10g J\n", -force[1], energy);
    }
    return save_and_compare(arguments.result, block, u);
}

void run_elasticity(const ElasticityArguments& arguments) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    const auto print = [rank](const char* format, auto... values) {
        if (rank == 0) {
            std::printf(format, values...);
            std::fflush(stdout);
        }
    };
    constexpr double kHeight = 5;
    print("a cube of 5 m, %g of its height pressed together, to a residual of %g; ranks: %d; medians of %d rounds by "
          "turns\n%-18s %6s %8s %9s %7s %7s %9s %9s %9s\n",
          arguments.compression, arguments.residual, ranks, arguments.rounds, "", "nu", "cells", "dofs", "Newton",
          "Krylov", "s", "us/cell", "force kN");
    for (const double poisson : arguments.poisson) {
        for (const int edge : arguments.edges) {
            BodyArguments body;
            body.cells = {edge, edge, edge};
            body.cell_size = kHeight / edge;
            body.material.poisson_ratio = poisson;
            BodyArguments ours = body;
            ours.material.crush.stiffness = arguments.crush_resistance;
            EquilibriumOptions options;
            options.tolerance = arguments.residual;
            const double way = -arguments.compression * kHeight;
            const std::pair<const char*, std::function<Pressed()>> rows[] = {
                {"EquilibriumSolver", [&] { return press_alone(ours, options, way); }},
                {"solve_equilibrium", [&] { return press_on_ranks(ours, options, way); }},
                {"elements, GAMG", [&] { return press_elements(body, arguments); }}};
            std::vector<Pressed> last(std::size(rows));
            std::vector<std::vector<double>> seconds(std::size(rows));
            for (int round = 0; round < arguments.rounds; ++round) {
                for (std::size_t r = ranks > 1 ? 1 : 0; r < std::size(rows); ++r) {
                    last[r] = rows[r].second();
                    seconds[r].push_back(last[r].seconds);
                }
            }
            const double nodes = edge + 1.0;
            for (std::size_t r = ranks > 1 ? 1 : 0; r < std::size(rows); ++r) {
                std::sort(seconds[r].begin(), seconds[r].end());
                const double median = seconds[r][seconds[r].size() / 2];
                print("%-18s %6g %8.0f %9.0f %7d %7ld %9.3f %9.2f %9.3f\n", rows[r].first, poisson, body.cell_count(),
                      3 * nodes * nodes * nodes, last[r].newton, last[r].krylov, median,
                      1e6 * median / body.cell_count(), std::abs(last[r].force) / 1e3);
            }
        }
    }
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
