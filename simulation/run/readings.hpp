#pragma once

/// \file
/// What is read of a body's state: what its supports carry and what is left unbalanced.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/scene/scene_body.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// Forces on nodes at one moment, one entry a node.
struct NodalForces {
    std::span<const Vector3> internal;   ///< N
    std::span<const double> masses;      ///< kg
    Vector3 gravity = {0, 0, 0};         ///< m/s^2
    double mass_damping = 0;             ///< 1/s
    std::span<const Vector3> loads = {}; ///< N; or none at all
    double part = 1;                     ///< of the loads that is there

    double load(std::size_t node, std::size_t axis) const { return loads.empty() ? 0 : part * loads[node][axis]; }
};

/// A probe's nodes.
struct ProbeNodes {
    std::string name;
    std::vector<std::uint32_t> nodes;
    Vector3 centroid = {0, 0, 0}; ///< m, where the body begins
    std::size_t reaction_nodes = 0, shared_reaction_nodes = 0;
    std::string shared = {}; ///< what to tell of the shared ones
};

/// `turned`: the displacements that the body begins with, where these are not zero.
ProbeReading read_probe(const ProbeNodes& probe, std::span<const Vector3> rest, std::span<const Vector3> displacements,
                        std::span<const Vector3> support, std::span<const Vector3> turned = {});

/// By how much a lattice is too stiff where a state bends or twists within its cells, over the stiffness of cells
/// without end; 0 with springs on means, where every cell is deformed alike all over, and where nothing is deformed
/// beyond rounding by `epsilon`. Springs on node lines sum up a quadratic by trapezoids: with n cells across a bent bar
/// they have (1 + 2/n^2) of its energy. The part within cells, which is all that a cell's mean deformation does not
/// have, is 3/n^2 of it: so two thirds of that part are too much, whatever the shape and the load. Told by 20,000 cells
/// at most.
double excess_stiffness(const Lattice& lattice, const Material& material,
                        std::span<const std::array<std::uint32_t, 8>> cells, std::span<const Vector3> displacements,
                        double epsilon);

} // namespace hybmss
