#pragma once

/// \file
/// What a Simulation holds: the scene made concrete for one body.

#include "hybmss/simulation.hpp"
#include "simulation/dynamics_state.hpp"
#include "simulation/equilibrium.hpp"
#include "simulation/supports.hpp"

#include <cstdio>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// A line of text by a printf format.
template <class... Values>
std::string text(const char* format, Values... values) {
    char buffer[256];
    std::snprintf(buffer, sizeof buffer, format, values...);
    return buffer;
}

struct Simulation::Implementation {
    Scene scene;
    SimulationOptions options;
    Lattice lattice;
    std::vector<Vector3> rest;
    Supports supports;
    std::vector<ProbeNodes> probes;
    AnyDynamics dynamics;
    double critical_time_step;
    double time_step;
    long steps = 0;

    Implementation(Scene given, const SimulationOptions& wanted);

    double time() const { return static_cast<double>(steps) * time_step; }
    bool moving() const { return time() < supports.end_of_motion(); }
    double body_volume() const;

    void prescribe();
    void step(long count);
    /// Starts afresh from a known state: nothing of what the dynamics hold inside may outlive values that are not
    /// finite.
    void restore(std::span<const Vector3> displacements, std::span<const Vector3> velocities, long at_step);

    Energies energies() const;
    Settlement settlement(const Energies& energies) const;
    /// Why the state is no good, or "". Potential energy alone is bounded: a free fall may be fast. The bound is the
    /// energy at a stretch of about a hundred.
    std::string blow_up(const Energies& energies) const;
    std::vector<ProbeReading> read_probes() const;

private:
    NodalForces nodal_forces(std::span<const Vector3> internal) const;
    std::span<const double> masses() const;
    double external_energy(std::span<const Vector3> displacements) const;
};

} // namespace hybmss
