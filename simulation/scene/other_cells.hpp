#pragma once

/// \file
/// Bodies whose cells are no cubes: their network, what else of a scene they can have, their volumes.

#include "hybmss/polyhedra.hpp"
#include "hybmss/simulation/simulation.hpp"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// The network with the scene's place added to its nodes, and how good its springs are: those of a box are exact.
/// Nothing for a body of cubes. Throws SceneError where the springs of a mesh are worse than the scene allows, and for
/// each key that only bodies of cubes have.
std::optional<FittedCells> other_cells(const Scene& scene);

/// Throws SceneError for a body whose cells are no cubes; `what` needs them.
void require_cubes(const Scene& scene, const std::string& what);

/// Whether a body of cubes may part along faces: by tears, or by cuts that separate.
bool may_part(const Scene& scene);
/// Throws SceneError for each key that such a body cannot have, and where not all cuts are alike.
void check_parting(const Scene& scene);

/// The edge of a cube as large as what a node has of the mesh's volume, m.
double edge_of_mesh(const CellMesh& mesh);

/// m^3, one a cell, by its faces as they are.
std::vector<double> volumes_of(std::span<const Network::Polyhedron> cells,
                               std::span<const std::array<double, 3>> positions);
/// V'/V0, one a cell.
std::vector<double> volume_ratios(std::span<const Network::Polyhedron> cells,
                                  std::span<const std::array<double, 3>> rest,
                                  std::span<const std::array<double, 3>> displacements);
VolumeChange measure_volume_change(std::span<const Network::Polyhedron> cells,
                                   std::span<const std::array<double, 3>> rest,
                                   std::span<const std::array<double, 3>> displacements);

} // namespace hybmss
