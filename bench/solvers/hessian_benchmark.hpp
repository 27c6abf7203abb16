#pragma once

/// \file
/// Measures the product K(u) p against the explicit step of the same body and against the scalar yardstick.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// "hessian/10x10x10/HybMSS/lattice/avx512/float/threads:1" and so on. In a round, a slice of the product over the
/// body's own arrays (as a solver calls it), of the step and of the yardstick's product. A product that is not finite
/// ends the row with an error. A row takes about `seconds`.
std::vector<Row> hessian_benchmark(const std::vector<BenchRow>& rows, double seconds);

extern const char* const kHessianIntroduction;

} // namespace hybmss::bench
