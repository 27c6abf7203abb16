#pragma once

/// \file
/// What things cost, as tables: a percent in a solution, a step of time, a wish for an accuracy.

#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "simulation/accuracy/mesh_convergence.hpp"
#include "studies/paper/table.hpp"
#include "studies/price/points.hpp"

#include <functional>
#include <string>
#include <vector>

namespace hybmss::price {

// ---- solutions

struct Solutions {
    std::vector<Reference> references;
    std::vector<std::vector<Point>> points; ///< by reference
};
Solutions measure_solutions(const Extent& extent, const std::function<void(const std::string&)>& progress);

/// The references; all points with observed and expected orders; what 10, 1 and 0.1 % cost each form of springs and
/// each element; CalculiX and settling at the static solve's errors.
std::vector<paper::Table> solution_tables(const Solutions& solutions);

// ---- time steps: error and energy against step size and seconds, for each integrator

/// One integrator at one step, on the paper's beam (4 x 4 x 24 cells, E = 10 MPa, nu = 0.3) that falls freely from
/// rest, without damping or with some by mass, for two periods of its slowest bending.
struct TimeStepPoint {
    SolverMethod method = SolverMethod::symplectic_euler;
    Precision precision = Precision::float64;
    bool damped = false;    ///< by a fifth of the critical damping of the slowest bending
    double time_step = 0;   ///< s
    double of_critical = 0; ///< over the stable step of the explicit method
    std::string failure;
    double seconds = 0; ///< of the steps alone, on one thread; least of some rounds
    double error = 0;  ///< greatest distance from the limit over the greatest displacement, RMS over nodes, at 16 times
    double energy = 0; ///< greatest change of the whole energy over the greatest kinetic energy, at these times
    double drift = 0;  ///< its mean over the second period less that over the first
};

/// From large steps to small ones. The limit: leapfrog in double at two steps below all others, extrapolated by its
/// order 2. `halvings`: how many steps an integrator has.
std::vector<TimeStepPoint> measure_time_steps(int halvings, const std::function<void(const std::string&)>& progress);

paper::Table time_step_table(const std::vector<TimeStepPoint>& points);

// ---- whether a wish for an accuracy is kept: varied scenes, each beside its own limit

struct WishCase {
    std::string name;
    Scene scene;          ///< static, its mesh free
    int reference_across; ///< cells along the shortest edge of the reference's finest mesh in tests; a multiple of 4
};
/// Compression, shear, torsion, tension, bending, loads; nu from 0 to 0.45; with and without face diagonals; small
/// strain and large.
std::vector<WishCase> wish_cases();

/// The figures of a case in the limit, by Richardson's extrapolation from static solves in double on `across`/4,
/// `across`/2 and `across` cells along the shortest edge.
std::vector<ResultFigure> limit_figures(const Scene& scene, int across);

struct WishResult {
    std::string name;
    double wanted = 0, estimate = 0, error = 0; ///< relative; error: the true one, against the limit
    std::array<std::int64_t, 3> cells = {0, 0, 0};
    Precision precision = Precision::float64;
    double seconds = 0; ///< of all meshes
    std::string failure;
};
WishResult solve_wish(const WishCase& wish, double accuracy, const std::vector<ResultFigure>& limit);

paper::Table wish_table(const std::vector<WishResult>& results);

} // namespace hybmss::price
