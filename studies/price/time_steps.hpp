#pragma once

/// \file
/// The price of time steps: error and energy against step size and seconds, for each integrator.

#include "hybmss/simulation/simulation.hpp"
#include "studies/paper/table.hpp"

#include <functional>
#include <string>
#include <vector>

namespace hybmss::price {

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

} // namespace hybmss::price
