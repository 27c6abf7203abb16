#pragma once

/// \file
/// Timing several pieces of work in short alternating slices, so that all see the same moods of the machine.

#include <cstddef>
#include <functional>
#include <vector>

namespace hybmss::bench {

/// Work that can be repeated: called with a count, it does that many steps.
using Work = std::function<void(long)>;

/// Long enough to make the clock and the first steps after a switch negligible, short enough to meet the same speed
/// state of the machine (they last for seconds) in all slices of a round.
inline constexpr double kSliceSeconds = 0.012;

/// How many steps of `work` fill a slice; never below 1. Warms caches and thread pools up on the way.
long steps_per_slice(const Work& work, double slice_seconds);

/// Each round the next of them comes first, so that none always runs on another's leftovers.
class Interleaved {
public:
    Interleaved(std::vector<Work> works, double slice_seconds);
    /// One round, a slice of each: seconds per step, in the order of the works.
    std::vector<double> next();

private:
    std::vector<Work> works_;
    std::vector<long> steps_;
    std::size_t first_ = 0;
};

/// The middle value; the mean of the two middle ones where the count is even. Needs at least one value.
double median(std::vector<double> values);

} // namespace hybmss::bench
