#pragma once

/// \file
/// How much memory a body takes, by layout and precision.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// A full box of 32^3 cells and a hollow ball in 64^3, in every layout of `choices`. Nothing is timed.
std::vector<Row> memory_table(const RowChoices& choices);

extern const char* const kMemoryIntroduction;

} // namespace hybmss::bench
