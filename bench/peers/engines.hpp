#pragma once

/// \file
/// Other programs' springs on a body of ours: what `hybmss_peers` times beside our own.

#include "bench/yardstick.hpp"
#include "hybmss/network.hpp"
#include "plan/tuning/trials.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace hybmss::bench {

/// What everybody gets: springs each once, where the nodes are, and the time step.
struct Task {
    const Network& springs;         ///< without cells
    std::vector<Vector3> positions; ///< m, one a node; at rest but for a small strain
    double time_step = 0;           ///< s
};

/// Something that is timed.
struct Contender {
    std::string engine;
    std::string numbers;     ///< "float" or "double"
    std::string does;        ///< e.g. "springs"
    std::string unit;        ///< what one is: "step", "forces" (no motion) or "iteration" (no forces)
    std::size_t springs = 0; ///< as the engine itself counts them
    Work steps;
};

/// Something that two engines must agree on: `error` is at most `bound`, else the figures are not of one task.
struct Check {
    std::string what;
    double error = 0, bound = 0;
};

struct Field {
    std::vector<Contender> contenders;
    std::vector<Check> checks;
};

/// The greatest difference of two fields over the greatest vector of the first.
double difference(const std::vector<Vector3>& expected, const std::vector<Vector3>& found);

/// The forces (N) of the springs at the positions, by the plain loops of the yardstick.
std::vector<Vector3> plain_forces(const Network& springs, const std::vector<Vector3>& positions);

/// Where the nodes are after so many steps x <- x + dt (v + dt f / m) from rest, by the yardstick.
std::vector<Vector3> plain_motion(const Task& task, int steps);

// Each is built where its library is there. They throw std::runtime_error where the engine refuses.

/// bond_style harmonic with fix nve, by LAMMPS's library interface.
void add_lammps(const Task& task, Field& field);
/// btSoftBody's links, projected, and btDeformableMassSpringForce.
void add_bullet(const Task& task, Field& field);

} // namespace hybmss::bench
