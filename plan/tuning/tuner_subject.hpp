#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"
#include "plan/bodies/layout_table.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace hybmss {

/// A body that plans are wanted for, lattice or network: what the tuner needs to know of it.
template <class T>
struct TunerSubject {
    std::string body_class;           ///< see body_class()
    std::vector<std::string> layouts; ///< of its kind, the default first
    std::size_t nodes;                ///< that `useful_threads` is asked with
    std::size_t cells;                ///< nodes where it has none
    std::function<std::unique_ptr<Body<T>>(const PlanOptions&)> make;
    /// A piece of it with at most about that many nodes.
    std::function<TunerSubject(std::size_t most_nodes)> sample;
};

/// The subjects refer to what they were made of; samples own it. The network must be valid. `estimated`: the layout
/// that comes first.
template <class T>
TunerSubject<T> subject_of(const Lattice& lattice, const Material& material, const std::string& estimated);
template <class T>
TunerSubject<T> subject_of(const Network& network);

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
