#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace hybmss {

/// Work that can be repeated: called with a count, it does that many steps.
using Work = std::function<void(long)>;
/// The same, timed: returns the seconds that they took.
using Trial = std::function<double(long steps)>;
Trial timed(Work work);

/// Several pieces of work in short alternating slices, so that all see the same moods of the machine. Each round the
/// next of them comes first, so that none always runs on another's leftovers.
class Interleaved {
public:
    /// Slices of as many steps as fill `slice_seconds`, at least one. To find that out warms caches and thread pools
    /// up.
    Interleaved(std::vector<Trial> trials, double slice_seconds);
    /// One round, a slice of each: seconds per step, in the order of the trials.
    std::vector<double> next();

private:
    std::vector<Trial> trials_;
    std::vector<long> steps_;
    std::size_t first_ = 0;
};

/// The middle value; the mean of the two middle ones where the count is even. Needs at least one value.
double median(std::vector<double> values);

} // namespace hybmss
