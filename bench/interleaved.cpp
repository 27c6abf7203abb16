#include "bench/interleaved.hpp"

#include <algorithm>
#include <utility>

namespace hybmss::bench {

Rounds in_turns(benchmark::State& state, const Work& first, const Work& second) {
    Interleaved interleaved({timed(first), timed(second)}, kSliceSeconds);
    Rounds rounds;
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        rounds.first.push_back(round[0]);
        rounds.second.push_back(round[1]);
        state.SetIterationTime(round[0]);
    }
    return rounds;
}

double median_ratio(std::vector<double> of, const std::vector<double>& to) {
    std::transform(of.begin(), of.end(), to.begin(), of.begin(), std::divides<>());
    return median(std::move(of));
}

} // namespace hybmss::bench
