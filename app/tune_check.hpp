#pragma once

/// \file
/// Whether the tuner chose well: all candidates timed at length.

#include "app/tune_rows.hpp"

#include <string>
#include <vector>

namespace hybmss {

struct ExhaustiveFigure {
    std::string name;
    double ns_per_cell_step;
};

/// Every candidate on the whole body, none dropped, in interleaved rounds; fastest first. `seconds` is for each of
/// them. All of them are held at the same time, so the body should not be huge.
std::vector<ExhaustiveFigure> time_exhaustively(const TuneRow& row, const PlanOptions& options, double seconds);

/// The plan that the options make of a row's body.
PlanDescription describe_plan(const TuneRow& row, const PlanOptions& options);

} // namespace hybmss
