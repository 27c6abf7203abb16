#pragma once

#include "plan/tuning/candidates.hpp"
#include "plan/tuning/trials.hpp"
#include "plan/tuning/tuner_subject.hpp"
#include "plan/tuning/wisdom_store.hpp"

#include <cstddef>
#include <vector>

namespace hybmss {

struct TrialTiming {
    double seconds_a_step;
    bool finalist; ///< not dropped early
};

/// Times all trials in interleaved rounds of slices, so that a slow mood of the machine meets them all; drops those
/// that are 2.5 times behind after the second round, 1.6 after the third, and 1.25 later. Ends when one is left, or
/// when the trials' own seconds exceed `budget`: but not before three rounds, and for twice as long where there were
/// less than ten.
///
/// Each slice is timed in four batches. A figure is the mean of the fastest quarter of a trial's batches: what disturbs
/// one only ever makes it longer. `drop` false: none is dropped.
std::vector<TrialTiming> time_in_rounds(const std::vector<Trial>& trials, double budget, double slice_seconds,
                                        bool drop = true);

/// How far apart two figures must be to count as different.
inline constexpr double kTie = 1.02;

/// How many times as fast as the fixed choice another must be, in a race of its own, to take its place.
inline constexpr double kGain = 1.03;

/// The mean of the fastest quarter. Needs at least one value.
double fastest_quarter_mean(std::vector<double> values);

/// Times the candidates (at least one; the first is the fixed choice) on scratch state and takes the fastest: within
/// 2 % of the best, the one with the fewest threads, then the one that comes first. It is the fixed choice unless that
/// one is at least 3 % faster than it in a second race, on bodies built anew.
///
/// A large body is timed in two stages: layouts, instruction sets and accuracies with one thread on a small piece, then
/// the fixed choice, and what is at most 1.2 times behind the best of its layout there, in layouts at most 1.5 times
/// behind, with all thread counts, on a piece that still fits into memory many times. So neither a layout that has no
/// chance nor a candidate of a huge body is ever built in full.
template <class T>
WisdomEntry measure(const TunerSubject<T>& subject, const std::vector<Candidate>& candidates,
                    const PlanOptions& options, Operation operation);

} // namespace hybmss
