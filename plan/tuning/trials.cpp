#include "plan/tuning/trials.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace hybmss {
namespace {

long steps_per_slice(const Trial& trial, double slice_seconds) {
    trial(1);
    // Doubling until a good part of a slice is measured: one step of a small body is far below the clock's noise.
    for (long steps = 1;; steps *= 2) {
        const double elapsed = trial(steps);
        if (elapsed > 0.25 * slice_seconds) {
            return std::max(1L, std::lround(slice_seconds / elapsed * static_cast<double>(steps)));
        }
    }
}

} // namespace

Trial timed(Work work) {
    return [work = std::move(work)](long steps) {
        const auto start = std::chrono::steady_clock::now();
        work(steps);
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
}

Interleaved::Interleaved(std::vector<Trial> trials, double slice_seconds) : trials_(std::move(trials)) {
    for (const Trial& trial : trials_) {
        steps_.push_back(steps_per_slice(trial, slice_seconds));
    }
}

std::vector<double> Interleaved::next() {
    std::vector<double> times(trials_.size());
    for (std::size_t i = 0; i < trials_.size(); ++i) {
        const std::size_t t = (first_ + i) % trials_.size();
        times[t] = trials_[t](steps_[t]) / static_cast<double>(steps_[t]);
    }
    first_ = (first_ + 1) % trials_.size();
    return times;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) {
        return *middle;
    }
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

} // namespace hybmss
