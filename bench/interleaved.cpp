#include "bench/interleaved.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

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

Interleaved::Interleaved(std::vector<Work> works, double slice_seconds) : works_(std::move(works)) {
    for (const Work& work : works_) {
        steps_.push_back(steps_per_slice(work, slice_seconds));
    }
}

std::vector<double> Interleaved::next() {
    std::vector<double> times(works_.size());
    for (std::size_t i = 0; i < works_.size(); ++i) {
        const std::size_t w = (first_ + i) % works_.size();
        times[w] = seconds(works_[w], steps_[w]) / static_cast<double>(steps_[w]);
    }
    first_ = (first_ + 1) % works_.size();
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

} // namespace hybmss::bench
