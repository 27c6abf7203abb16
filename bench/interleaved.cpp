#include "bench/interleaved.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>

namespace hybmss::bench {
namespace {

double seconds(const Work& work, long steps) {
    const auto start = std::chrono::steady_clock::now();
    work(steps);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

} // namespace

long steps_per_slice(const Work& work, double slice_seconds) {
    work(1);
    // Doubling until a good part of a slice is measured: one step of a small body is far below the clock's noise.
    for (long steps = 1;; steps *= 2) {
        const double elapsed = seconds(work, steps);
        if (elapsed > 0.25 * slice_seconds) {
            return std::max(1L, std::lround(slice_seconds / elapsed * static_cast<double>(steps)));
        }
    }
}

Interleaved::Interleaved(Work candidate, Work yardstick, double slice_seconds)
    : candidate_(std::move(candidate)), yardstick_(std::move(yardstick)),
      candidate_steps_(steps_per_slice(candidate_, slice_seconds)),
      yardstick_steps_(steps_per_slice(yardstick_, slice_seconds)) {}

Round Interleaved::next() {
    Round round{};
    for (const bool candidate : {candidate_first_, !candidate_first_}) {
        const long steps = candidate ? candidate_steps_ : yardstick_steps_;
        const double per_step = seconds(candidate ? candidate_ : yardstick_, steps) / static_cast<double>(steps);
        (candidate ? round.candidate : round.yardstick) = per_step;
    }
    candidate_first_ = !candidate_first_;
    return round;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) {
        return *middle;
    }
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

} // namespace hybmss::bench
