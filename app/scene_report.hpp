#pragma once

/// \file
/// What a scene's body is, and what came of a run, for a person.

#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/world_simulation.hpp"

#include <string>

namespace hybmss {

/// "10 x 10 x 10 cells, 1331 nodes, 14230 springs, about 1.2 MB", with the filled cells where the grid is not full.
std::string body_line(const Simulation& simulation, const SimulationOptions& options);

/// "2 parts that share no face with each other: 1200 and 3 cells"; "" for a body in one piece.
std::string parts_line(const Simulation& simulation);

/// Of a body whose cells are no cubes: "48 tetrahedra, 24 pyramids"; and how good its springs are.
std::string other_cells_line(const Simulation& simulation);
std::string fit_line(const FittedCells& fitted);

/// "1: 1200 cells of 3000 Pa; 2: 30 cells of 9000 Pa, nu 0.4, 1100 kg/m^3", what is the scene's left out; "" for a body
/// without labels.
std::string labels_line(const Scene& scene);

/// "624 of 4169 cells are not whole; 4.1886 m^3 by their fills, 4.1887 m^3 inside the surface"; "" where all are whole.
std::string fills_line(const Simulation& simulation);
/// The layer of cells in the middle of an axis, a character a cell, the higher of the other two axes upwards: '.' for
/// no cell, 1 to 9 and a, b, c ... its label, # where there are none; of cells that a surface cuts to less than a half
/// '-'.
std::string slice_lines(const Simulation& simulation, std::size_t axis);

std::string summary_table(const Simulation& simulation, const Summary& summary);
/// How it ended, in one line.
std::string summary_line(const Simulation& simulation, const Summary& summary);
/// Of several bodies.
std::string summary_table(const WorldSimulation& world, const WorldSummary& summary);
std::string summary_line(const WorldSimulation& world, const WorldSummary& summary);

/// What the tuner timed, a line each.
std::string candidate_lines(const PlanDescription& plan);

} // namespace hybmss
