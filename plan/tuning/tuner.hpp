#pragma once

#include "plan/tuning/candidates.hpp"
#include "plan/tuning/tuner_subject.hpp"
#include "plan/tuning/wisdom_store.hpp"

namespace hybmss {

/// Times the candidates (at least one; the first is the fixed choice) on scratch state and takes the fastest: within
/// 2 % of the best, the one with the fewest threads, then the one that comes first.
///
/// A large body is timed in two rounds: layouts, instruction sets and accuracies with one thread on a small piece, then
/// what is at most 1.5 times behind there, with all thread counts, on a piece that still fits into memory many times.
/// So neither a layout that has no chance nor a candidate of a huge body is ever built in full.
///
/// Tiles and integration change a time by some per cent, where layouts change it by half. So they do not multiply the
/// candidates of these rounds: what wins there is timed at last against itself with other tiles, and with the
/// integration split off.
template <class T>
WisdomEntry measure(const TunerSubject<T>& subject, const std::vector<Candidate>& candidates,
                    const PlanOptions& options, Operation operation);

} // namespace hybmss
