#pragma once

/// \file
/// How far an energy that should stay has moved.

#include <algorithm>
#include <cmath>
#include <vector>

namespace hybmss::stability {

/// Samples of the total energy at equal intervals. Semi-implicit Euler makes it oscillate about a value that stays; so
/// the drift compares means, and the swing is told apart.
class EnergyRecord {
public:
    void add(double energy) { samples_.push_back(energy); }

    /// The mean over the last quarter less that over the first.
    double drift() const {
        const std::size_t quarter = samples_.size() / 4;
        return mean(samples_.size() - quarter, samples_.size()) - mean(0, quarter);
    }
    /// The greatest distance of a sample from the first quarter's mean; not a number where a sample is none.
    double swing() const {
        const double middle = mean(0, samples_.size() / 4);
        double greatest = 0;
        for (const double sample : samples_) {
            greatest = std::isnan(sample) ? sample : std::max(greatest, std::abs(sample - middle));
            if (std::isnan(greatest)) {
                break;
            }
        }
        return greatest;
    }

private:
    double mean(std::size_t begin, std::size_t end) const {
        double sum = 0;
        for (std::size_t n = begin; n < end; ++n) {
            sum += samples_[n];
        }
        return sum / static_cast<double>(end - begin);
    }

    std::vector<double> samples_;
};

} // namespace hybmss::stability
