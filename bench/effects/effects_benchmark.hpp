#pragma once

/// \file
/// What each effect of a scene costs, and that one that is not called for costs nothing.

#include "bench/bench_row.hpp"
#include "bench/row.hpp"

namespace hybmss::bench {

/// A cube of 20^3 cells, for every precision and instruction set of `choices`. First a row for the step with all its
/// seams for effects and none of them called for, against the sweep of the cells alone; then one for each effect of
/// simulation/run/effect_list.hpp that can be called for, against the body without it. A row takes about `seconds`.
std::vector<Row> effects_benchmark(const RowChoices& choices, double seconds);

extern const char* const kEffectsIntroduction;

} // namespace hybmss::bench
