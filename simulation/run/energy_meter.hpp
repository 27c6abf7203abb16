#pragma once

/// \file
/// Where a run's energy comes from and goes to.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/run/boundary_conditions.hpp"

#include <span>
#include <vector>

namespace hybmss {

/// What an energy meter looks at after every step.
struct MeteredState {
    std::vector<Vector3> displacements; ///< m
    std::vector<Vector3> forces;        ///< N: the body's own and those of effects
    std::vector<PrescribedNode> held;
    std::vector<Vector3> accelerations; ///< m/s^2, of the held
    struct Obstacle {
        Vector3 position, angle;                 ///< m and rad
        Vector3 force, torque;                   ///< N and N m, that it exerts on the body
        double kinetic = 0, work_of_gravity = 0; ///< J, of a free one; the work since the start
    };
    std::vector<Obstacle> obstacles;
    std::vector<Vector3> loads; ///< N, one a node, or none
    Vector3 gravity;            ///< m/s^2
    double elastic = 0;         ///< J
    std::vector<EffectEnergy> effects;
};

/// Adds up works and losses of explicit steps. With w = (u - u_before)/dt semi-implicit Euler is the leapfrog method
/// too, which conserves 1/2 m w . w_next + potential where forces are linear. Works are trapezoidal to match, F_n doing
/// its work over (u_next - u_before)/2, so that nothing is lost by accounting but the third order of a step.
class EnergyMeter {
public:
    /// Constants of the run. The spans outlive the meter.
    struct Constants {
        Constants(const StepParameters& parameters, std::span<const double> mass, bool loads_change);

        StepParameters step;
        double time_step; ///< s
        std::span<const double> masses;
        bool changing_loads; ///< loads or gravity change in time, and so have no potential
        /// A step is w' = (w + kick (f/m + g)) / slowing, so the damping force -m braking (w' + share w).
        double kick, slowing;  ///< s, 1
        double braking, share; ///< 1/s, 1
    };

    /// `velocities` at the start.
    EnergyMeter(const Constants& constants, MeteredState start, std::vector<Vector3> velocities);

    /// After each step.
    void record(MeteredState state);
    /// Up to the last state.
    EnergyBalance balance() const;

    /// All that it knows, for a checkpoint.
    std::vector<double> memory() const;
    /// Goes on from where a meter of the same scene was: `last` is the state as it was then. Throws std::runtime_error
    /// for another count of numbers.
    void set_memory(std::span<const double> memory, MeteredState last);

private:
    struct Works {
        double supports = 0, mass_damping = 0, obstacles = 0;
        double loads = 0, gravity = 0; ///< where they change
    };
    /// Works of the forces at the last state over half the way to it and half the way on, whose velocity is `next`.
    void add_works(std::span<const Vector3> next, double before, double after, Works& works) const;
    std::vector<Vector3> kicked(double kick, double slowing, double seconds) const;
    double kinetic(std::span<const Vector3> next) const;

    Constants constants_;
    MeteredState last_;
    std::vector<Vector3> start_, velocity_; ///< w at the last state
    bool begun_ = false;
    Works works_;
    double start_kinetic_ = 0, start_elastic_, peak_kinetic_ = 0;
    double start_free_ = 0; ///< kinetic energy of free obstacles
    std::vector<EffectEnergy> start_effects_;
};

} // namespace hybmss
