#pragma once

/// \file
/// Timing two pieces of work in short alternating slices, so that both see the same moods of the machine.

#include <functional>
#include <vector>

namespace hybmss::bench {

/// Work that can be repeated: called with a count, it does that many steps.
using Work = std::function<void(long)>;

/// How many steps of `work` fill a slice; never below 1. Warms caches and thread pools up on the way.
long steps_per_slice(const Work& work, double slice_seconds);

/// One round: a slice of each, seconds per step.
struct Round {
    double candidate;
    double yardstick;
};

/// Alternates which of the two comes first, so that neither always runs on the other's leftovers.
class Interleaved {
public:
    Interleaved(Work candidate, Work yardstick, double slice_seconds);
    Round next();

private:
    Work candidate_, yardstick_;
    long candidate_steps_, yardstick_steps_;
    bool candidate_first_ = true;
};

/// The middle value; the mean of the two middle ones where the count is even. Needs at least one value.
double median(std::vector<double> values);

} // namespace hybmss::bench
