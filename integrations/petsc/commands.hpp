#pragma once

#include "integrations/petsc/block.hpp"

#include "hybmss/material.hpp"
#include "hybmss/plan_options.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

// What hybmss_distributed does. Every command is collective over MPI_COMM_WORLD, prints on rank 0, and throws
// std::invalid_argument for bad input, std::runtime_error where the computation fails.

namespace hybmss::distributed {

struct BodyArguments {
    std::array<PetscInt, 3> cells = {10, 10, 10};
    double cell_size = 0.5; ///< m
    Material material;
    bool hollow = false; ///< only the outer two layers of cells
    int threads = 1;     ///< of every rank

    Grid grid() const;
    PlanOptions plan_options() const;
    double cell_count() const; ///< of the grid
};

/// Displacements of the whole grid, written and compared.
struct ResultArguments {
    std::string save, compare; ///< files; "" for none
    double tolerance = 1e-10;  ///< of the greatest displacement
};

struct MotionArguments {
    BodyArguments body;
    ResultArguments result;
    long steps = 100;
    std::optional<double> time_step; ///< s; else 0.7 of the critical one
    double mass_damping = 0;         ///< 1/s
    std::array<double, 3> gravity = {0, -10, 0};
    std::string method = "fused", precision = "double";
    std::string checkpoint, restart;
    long checkpoint_every = 0; ///< steps; 0: at the end alone
};

struct RaceArguments {
    BodyArguments body;
    long steps = 20;
    int rounds = 11;
};

struct EquilibriumArguments {
    BodyArguments body;
    ResultArguments result;
    double compression = 0.05; ///< of the height
    int load_steps = 1;        ///< at least
    double residual = 1e-10;   ///< of the largest support force
    std::string preconditioner = "automatic";
};

struct ElasticityArguments {
    std::vector<int> edges = {16, 32}; ///< cells along each of a cube's
    std::vector<double> poisson = {0.25, 0.45};
    double compression = 0.2;
    double residual = 1e-6;
    double crush_resistance = 0; ///< of ours alone
    int rounds = 3;
};

/// A beam, clamped where x is least, that falls under its weight. False where it differs from what it is compared with.
bool run_motion(const MotionArguments& arguments);

/// The ways to step, by turns in one run.
void run_race(const RaceArguments& arguments);

/// A box pressed together along y between clamped plates. False as above.
bool run_equilibrium(const EquilibriumArguments& arguments);

/// A cube of 5 m pressed together as there: ours, alone and on the ranks, and finite elements by PETSc's own solvers
/// (finite_elements.hpp), by turns in one run.
void run_elasticity(const ElasticityArguments& arguments);

/// The model of communication for a body and ranks that need not exist.
void print_model(const std::array<long, 3>& cells, long ranks);

/// Does what the arguments say; false where the displacements differ from the file by more than the tolerance.
/// Collective.
bool save_and_compare(const ResultArguments& arguments, const Block& block, Vec displacement);

} // namespace hybmss::distributed
