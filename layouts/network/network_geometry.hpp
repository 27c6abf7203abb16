#pragma once

#include "hybmss/network.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// The mean edges a0, b0, c0 of a cell at rest (5.14), x y z each, and its volume a0 . (b0 x c0).
struct RestShape {
    std::array<double, 9> edges;
    double volume;
};

RestShape rest_shape(const Network& network, const Network::Cell& cell);

/// l^2 of a spring, m^2.
double rest_length2(const Network::Spring& spring);

/// The points row by row and plane by plane, as a lattice numbers its nodes: entry i is the number of the i-th point.
///
///     slowest ^   4 - 5 - 6 - 7      Coordinates are rounded to multiples of `spacing` (m, > 0); the longest side of
///             |   0 - 1 - 2 - 3      the points' box counts slowest, the shortest fastest, so that a plane has few
///             +-------------->       points; among equal sides x is the fastest. Points with equal counts are sorted
///                      fastest       by the coordinate along the row.
///
/// A sweep along it works in a window of the points that lie within a spring's length of a plane.
std::vector<std::uint32_t> row_order(std::span<const std::array<double, 3>> points, double spacing);

} // namespace hybmss
