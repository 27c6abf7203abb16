#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"

#include <string>

namespace hybmss {

/// Bodies of one class are taken to have the same fastest candidate:
///
///     lattice float face-diagonals quadratic nodes:2^13.5 fill:8/8
///     network double mean-stretch nodes:2^11.0 numbering:scattered
///
/// Nodes go by half steps of their binary logarithm, up to those of the largest sample: larger bodies are timed on such
/// a sample anyway. The filled part of a lattice goes by eighths; where it is at most half, so does active_share. A
/// network's nodes are numbered locally where its springs' ends lie nearer to each other than half way (in logarithms)
/// from a lattice's order, about n^(2/3), to a random one, n/3.
template <class T>
std::string body_class(const Lattice& lattice, const Material& material);
template <class T>
std::string body_class(const Network& network);

/// What the options leave open: "layout:any isa:any accuracy:fast threads:2", and " tile:4096" and " split" or " fused"
/// where they say so. The other half of a wisdom entry's key:
/// what is fastest of all says nothing of what is fastest with one thread.
std::string wish_class(const PlanOptions& options);

} // namespace hybmss
