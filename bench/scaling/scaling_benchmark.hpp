#pragma once

/// \file
/// How the step's time per cell changes with the size of the body and with a second thread.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// Full HybMSS on cubes of 10^3 to 128^3 cells, and of 256^3 in float where `large`. In a round, a slice each of: the
/// step, the same on one thread, the step of 32^3 cells on as many threads, and the yardstick where the cube has at
/// most 32^3 cells (on larger ones a few steps of it would take longer than all the rest). A row takes about `seconds`.
std::vector<Row> scaling_benchmark(const RowChoices& choices, bool large, double seconds);

extern const char* const kScalingIntroduction;

} // namespace hybmss::bench
