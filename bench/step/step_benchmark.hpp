#pragma once

/// \file
/// Measures the fused explicit step against the scalar yardstick.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// One row each; in a round, a slice of the step and a slice of the yardstick. A state that is not finite at the end
/// ends the row with an error. A row takes about `seconds`.
std::vector<Row> step_benchmark(const std::vector<BenchRow>& rows, double seconds);

extern const char* const kStepIntroduction;

} // namespace hybmss::bench
