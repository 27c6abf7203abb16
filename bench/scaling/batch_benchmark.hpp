#pragma once

/// \file
/// Many small bodies stepped side by side.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// Full HybMSS, 64 equal cubes of 4^3 to 14^3 cells in a Batch, ten steps a call. In a round, a slice each of: the
/// batch, and the same bodies stepped one after the other on one thread. A row takes about `seconds`.
std::vector<Row> batch_benchmark(const RowChoices& choices, double seconds);

extern const char* const kBatchIntroduction;

} // namespace hybmss::bench
