#pragma once

/// \file
/// What the machine can do, and how much of it the lattice step takes.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// For each instruction set: issue rates (limits/issue/...), bandwidths (limits/bandwidth/...), and the step of every
/// model against both (limits/step/...), measured in the same rounds. A row takes about `seconds`.
std::vector<Row> limits_benchmark(const RowChoices& choices, double seconds);

extern const char* const kLimitsIntroduction;

} // namespace hybmss::bench
