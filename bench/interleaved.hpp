#pragma once

/// \file
/// Two pieces of work measured against each other.

#include "plan/tuning/trials.hpp"

#include <benchmark/benchmark.h>

#include <vector>

namespace hybmss::bench {

/// Long enough to make the clock and the first steps after a switch negligible, short enough to meet the same speed
/// state of the machine (they last for seconds) in all slices of a round.
inline constexpr double kSliceSeconds = 0.012;

/// Seconds a step of two works in each round.
struct Rounds {
    std::vector<double> first, second;
};
/// A round an iteration of the state, whose time is that of the first.
Rounds in_turns(benchmark::State& state, const Work& first, const Work& second);

/// The median of the entries of one list by those of another.
double median_ratio(std::vector<double> of, const std::vector<double>& to);

} // namespace hybmss::bench
