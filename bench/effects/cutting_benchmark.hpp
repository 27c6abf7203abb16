#pragma once

/// \file
/// What it takes to remove cells from a moving body.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// Cubes of 16^3, 64^3 and 128^3 cells, bites of 8, 64 and 512 cells.
std::vector<Row> cutting_benchmark(const RowChoices& choices);

extern const char* const kCuttingIntroduction;

} // namespace hybmss::bench
