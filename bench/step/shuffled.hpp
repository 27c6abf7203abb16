#pragma once

#include "hybmss/network.hpp"

namespace hybmss::bench {

/// The same network with its nodes numbered, and its springs and cells listed, at random.
Network shuffled(const Network& network, unsigned seed);

} // namespace hybmss::bench
