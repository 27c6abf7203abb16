#pragma once

/// \file
/// Networks that are no lattice: sheared cells, extra springs, a hub, scattered numbering.

#include "hybmss/network.hpp"

#include <string>
#include <vector>

namespace hybmss::verify {

struct NamedNetwork {
    std::string name;
    Network network;
};

/// The typical distance of neighbours in all of them, m.
inline constexpr double kNetworkCellSize = 0.5;

/// With `none` those of springs alone are added. Random parts follow from the seed alone.
std::vector<NamedNetwork> hand_made_networks(VolumeEnergy energy, unsigned seed);

} // namespace hybmss::verify
