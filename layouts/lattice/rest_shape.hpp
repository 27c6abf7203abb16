#pragma once

#include "hybmss/network.hpp"

#include <array>

namespace hybmss {

/// The mean edges a0, b0, c0 of a cell at rest (5.14), x y z each, and its volume a0 . (b0 x c0).
struct RestShape {
    std::array<double, 9> edges;
    double volume;
};

RestShape rest_shape(const Network& network, const Network::Cell& cell);

/// l^2 of a spring, m^2.
double rest_length2(const Network::Spring& spring);

} // namespace hybmss
