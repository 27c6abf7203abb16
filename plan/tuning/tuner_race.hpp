#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace hybmss {

/// Takes that many steps of one candidate and returns the seconds they took.
using Trial = std::function<double(long steps)>;

struct RaceResult {
    double seconds_a_step;
    bool finalist; ///< not dropped early
};

/// Times all trials in interleaved rounds of slices, so that a slow mood of the machine meets them all; drops those
/// that are 2.5 times behind after the second round, 1.6 after the third, and 1.25 later. Ends when one is left, or
/// when the trials' own seconds exceed `budget`: but not before three rounds, and for twice as long where there were
/// less than ten.
///
/// Each slice is timed in four batches. A figure is the mean of the fastest quarter of a trial's batches: what disturbs
/// one only ever makes it longer.
std::vector<RaceResult> race(const std::vector<Trial>& trials, double budget, double slice_seconds);

/// How far apart two figures must be to count as different.
inline constexpr double kRaceTie = 1.02;

/// The mean of the fastest quarter. Needs at least one value.
double fastest_quarter_mean(std::vector<double> values);

} // namespace hybmss
