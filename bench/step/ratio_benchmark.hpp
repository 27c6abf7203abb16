#pragma once

/// \file
/// Pairs of bodies that say together what neither says alone, stepped in the same rounds.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

extern const char* const kRatioIntroduction;

/// All of them; `choices.threads` counts, its layouts do not.
std::vector<Row> ratio_benchmark(const RowChoices& choices, double seconds);

/// "ratio/models/...": HybMSS-CF and HybMSS-FD against the full model, and how far leaving out so many operations
/// should bring them.
Row model_row(const BenchRow& row, double seconds);

/// "ratio/numbering/...": the row's body as a network whose nodes and springs come in random order, against the same
/// one in the lattice's order.
Row numbering_row(const BenchRow& row, double seconds);

/// "ratio/filled/...": a hollow ball in a large grid against one of the same wall in a grid of 64^3: time and memory of
/// a filled cell, whatever the grid.
Row filled_row(const BenchRow& row, double seconds);

} // namespace hybmss::bench
