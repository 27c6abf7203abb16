#pragma once

/// \file
/// What a core can do: how many bytes it moves from and to each level of memory, and how many vector operations of each
/// kind it issues.

#include "bench/bench_row.hpp"
#include "bench/interleaved.hpp"
#include "bench/limits/issue_loops.hpp"
#include "bench/row.hpp"

#include <array>
#include <map>
#include <memory>
#include <tuple>

namespace hybmss::bench {

/// The loops of an instruction set and a precision, as works whose step is kOperationsPerStep operations.
class IssueWorks {
public:
    IssueWorks(InstructionSet set, Precision precision) : loops_(choose(set, precision)) {}

    bool has(Issue issue) const { return loops_.issue[static_cast<int>(issue)] != nullptr; }
    Work work(Issue issue) const;

    static constexpr long kOperationsPerStep = 1000L * kMixed;

private:
    static const IssueLoops& choose(InstructionSet set, Precision precision);

    struct alignas(64) Scratch {
        std::array<char, 4096> bytes;
    };
    const IssueLoops& loops_;
    mutable Scratch scratch_{};
};

/// The least time of one operation of each kind that a run has seen. Shared by the run's rows: a row that others
/// disturbed all the time must not take their share of the core for the machine's limit.
class FastestTimes {
public:
    /// Takes note of a time, s, and returns the least one so far.
    double improve(InstructionSet set, Precision precision, Issue issue, double seconds);

private:
    std::map<std::tuple<InstructionSet, Precision, Issue>, double> times_;
};

/// "limits/bandwidth/avx512": GB/s of reading, writing and copying (both counted) in each cache and in memory.
Row bandwidth_row(InstructionSet set, double seconds);

/// "limits/issue/avx512/float": vector operations a nanosecond of each kind, in interleaved slices.
Row issue_row(InstructionSet set, Precision precision, double seconds, std::shared_ptr<FastestTimes> times);

} // namespace hybmss::bench
