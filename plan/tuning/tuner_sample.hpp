#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"

namespace hybmss {

// Candidates for a huge body are timed on a piece of it: to build each of them in full would take more memory and more
// time than the plan itself.

/// Nodes of the largest sample, 64^3: beyond the second cache, as all larger bodies are.
inline constexpr std::size_t kTunerSampleNodes = 1 << 18;

/// A window of the lattice with at most about `most_nodes` grid nodes, as near to a cube as the lattice allows. Of the
/// windows at the ends and in the middle, the one that is filled most like the whole.
Lattice sample_of(const Lattice& lattice, std::size_t most_nodes);

/// The `most_nodes` nodes that come first along the longest axis, in the order they have, with what lies between them.
Network sample_of(const Network& network, std::size_t most_nodes);

} // namespace hybmss
