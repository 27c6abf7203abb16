#pragma once

/// \file
/// The body of a scene: the files that it comes from, its lattice, and which of its nodes a region holds.

#include "hybmss/lattice.hpp"
#include "hybmss/simulation/scene.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// The lattice: where cells have labels, each with the stiffness of its label. Throws SceneError where no cell is
/// filled, where it is not clear what a label stands for, and for cells that are no cubes.
Lattice scene_lattice(const Scene& scene);

/// The key that gives the body: "body.cells", "body.voxels", "body.surface" or "body.mesh".
std::string body_key(const SceneBody& body);

/// Reads the voxels or the surface that the body names, if any, into its cells and labels, and what obstacles name into
/// their shapes. Throws SceneError with the line of the key, the file's name and what is wrong.
void read_body_files(Scene& scene);

using Vector3 = std::array<double, 3>;

/// The rest positions in m of the body's nodes, in their order; the grid's low corner is at `origin`.
std::vector<Vector3> rest_positions(const Lattice& lattice, const Vector3& origin);

/// Indices of the nodes in the region at rest, ascending; none where it is empty. Surfaces count as inside, up to a
/// millionth of a cell.
std::vector<std::uint32_t> select_nodes(std::span<const Vector3> rest, double cell_size, const Region& region);

/// Whether a point lies in it, or as near to it as `slack`.
bool inside(const BoxRegion& box, const Vector3& x, double slack);
bool inside(const SphereRegion& sphere, const Vector3& x, double slack);

/// The mean rest position, m. At least one node.
Vector3 rest_centroid(std::span<const Vector3> rest, std::span<const std::uint32_t> nodes);

} // namespace hybmss
