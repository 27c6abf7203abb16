#pragma once

/// \file
/// Measures the fused explicit step of one row against the scalar yardstick.

#include "bench/bench_row.hpp"

#include <benchmark/benchmark.h>

namespace hybmss::bench {

/// Runs one round (a slice of the candidate, a slice of the yardstick) per iteration of `state`, which must use manual
/// time, and sets the row's counters from the medians. A state that is not finite at the end ends the row with an
/// error.
void measure_step(benchmark::State& state, const BenchRow& row);

/// Registers the row so that its rounds take about `seconds` in all.
void register_step(const BenchRow& row, double seconds);

} // namespace hybmss::bench
