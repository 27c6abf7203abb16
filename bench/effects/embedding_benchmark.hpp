#pragma once

/// \file
/// What it costs to call from another program: through the C interface, and over its memory.

#include "bench/row.hpp"

#include <vector>

namespace hybmss::bench {

extern const char* const kEmbeddingIntroduction;

/// Forces of the smallest body by the C interface against the C++ one, and of 32^3 cells over interleaved and mapped
/// memory against separate arrays, in float, one thread. About `seconds` a row.
std::vector<Row> embedding_benchmark(double seconds);

} // namespace hybmss::bench
