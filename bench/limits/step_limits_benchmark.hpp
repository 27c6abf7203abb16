#pragma once

/// \file
/// The lattice step against the limits of arithmetic and memory.

#include "bench/bench_row.hpp"
#include "bench/limits/issue_benchmark.hpp"
#include "bench/row.hpp"

#include <memory>

namespace hybmss::bench {

/// "limits/step/32x32x32/HybMSS/flat-rows/avx512/float/threads:1". In a round, a slice of the step and a slice of every
/// loop that bounds it. Limits are made of the fastest round of each (of the whole run, for `times`), so the step's
/// fastest round stands against them: a limit that was measured while somebody else had the core would be none.
Row step_limits_row(const BenchRow& row, double seconds, std::shared_ptr<FastestTimes> times);

} // namespace hybmss::bench
