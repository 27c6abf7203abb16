#include "plan/tuning/tuner_race.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

constexpr std::size_t kLeastRounds = 3, kMostRounds = 1000;
// With many trials three rounds may use up the budget, and three are too few to tell trials apart that differ by 5 %:
// those left get so many, for at most as much time again.
constexpr std::size_t kFinalRounds = 10;

// A slice is timed in batches: where another process takes the core, it spoils one of them.
constexpr long kBatches = 4;

/// How far behind a trial may be after a round. A mood of the machine may have met some trials alone in the first
/// rounds.
double drop_limit(std::size_t round) {
    return round <= 2 ? 2.5 : round == 3 ? 1.6 : 1.25;
}

struct Runner {
    const Trial* trial;
    long batches = 1, steps = 1; ///< batches a slice, steps a batch
    std::vector<double> seconds_a_step;
    bool running = true;
};

/// Doubling until a good part of a slice is measured: one step of a small body is far below the clock's noise. Returns
/// the seconds spent.
double calibrate(Runner& runner, double slice_seconds) {
    // The first call also warms caches and threads up.
    long steps = 1;
    double elapsed = (*runner.trial)(steps), spent = elapsed;
    while (elapsed < 0.25 * slice_seconds && steps < (1L << 40)) {
        steps *= 2;
        elapsed = (*runner.trial)(steps);
        spent += elapsed;
    }
    const long fill = std::max(1L, std::lround(slice_seconds / std::max(elapsed, 1e-9) * static_cast<double>(steps)));
    runner.batches = std::min(kBatches, fill);
    runner.steps = fill / runner.batches;
    return spent;
}

/// Times one slice; returns the seconds spent.
double run_slice(Runner& runner) {
    double spent = 0;
    for (long b = 0; b < runner.batches; ++b) {
        const double elapsed = (*runner.trial)(runner.steps);
        runner.seconds_a_step.push_back(elapsed / static_cast<double>(runner.steps));
        spent += elapsed;
    }
    return spent;
}

} // namespace

double fastest_quarter_mean(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t quarter = (values.size() + 3) / 4;
    return std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(quarter), 0.0) /
           static_cast<double>(quarter);
}

std::vector<RaceResult> race(const std::vector<Trial>& trials, double budget, double slice_seconds) {
    std::vector<Runner> runners;
    double spent = 0;
    for (const Trial& trial : trials) {
        runners.push_back({&trial, 1, 1, {}, true});
        spent += calibrate(runners.back(), slice_seconds);
    }
    std::size_t left = runners.size();
    for (std::size_t round = 1; round <= kMostRounds; ++round) {
        for (std::size_t r = 0; r < runners.size(); ++r) {
            // Back and forth, so that none always runs on the same neighbour's leftovers.
            Runner& runner = runners[round % 2 ? r : runners.size() - 1 - r];
            if (runner.running) {
                spent += run_slice(runner);
            }
        }
        if (round >= 2) {
            const double limit = drop_limit(round);
            double best = HUGE_VAL;
            for (const Runner& runner : runners) {
                best = std::min(best, fastest_quarter_mean(runner.seconds_a_step));
            }
            for (Runner& runner : runners) {
                if (runner.running && fastest_quarter_mean(runner.seconds_a_step) > limit * best) {
                    runner.running = false;
                    --left;
                }
            }
        }
        const double most = round < kFinalRounds ? 2 * budget : budget;
        if (left <= 1 || (round >= kLeastRounds && spent >= most)) {
            break;
        }
    }
    std::vector<RaceResult> results;
    for (const Runner& runner : runners) {
        results.push_back({fastest_quarter_mean(runner.seconds_a_step), runner.running});
    }
    return results;
}

} // namespace hybmss
