#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// The points along a Z-shaped space-filling curve (Morton order): entry i is the number of the i-th point. What is
/// near in space is then mostly near in memory.
///
///     y ^   2---3   6---7      The bits of the coordinates, interleaved: ... z1 y1 x1 z0 y0 x0.
///       |     \   /   \        The longest side of the points' box is 2^21 - 1 units.
///       |   0---1   4---5      Points with equal bits keep their order.
///       +--> x
std::vector<std::uint32_t> space_filling_order(std::span<const std::array<double, 3>> points);

} // namespace hybmss
