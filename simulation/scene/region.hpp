#pragma once

/// \file
/// Which of a body's nodes a region holds.

#include "hybmss/lattice.hpp"
#include "hybmss/simulation/scene.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

using Vector3 = std::array<double, 3>;

/// The rest positions in m of the body's nodes, in their order; the grid's low corner is at `origin`.
std::vector<Vector3> rest_positions(const Lattice& lattice, const Vector3& origin);

/// Indices of the nodes in the region at rest, ascending; none where it is empty. Surfaces count as inside, up to a
/// millionth of a cell.
std::vector<std::uint32_t> select_nodes(std::span<const Vector3> rest, double cell_size, const Region& region);

/// The mean rest position, m. At least one node.
Vector3 rest_centroid(std::span<const Vector3> rest, std::span<const std::uint32_t> nodes);

} // namespace hybmss
