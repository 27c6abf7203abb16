#include "bench/limits/issue_benchmark.hpp"

#include "bench/printed.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

constexpr double kIssueSlice = 0.004;

void measure(benchmark::State& state, InstructionSet set, Precision precision, FastestTimes& fastest) {
    const IssueWorks loops(set, precision);
    std::vector<int> kinds;
    std::vector<Work> works;
    for (int kind = 0; kind < kIssueCount; ++kind) {
        if (loops.has(static_cast<Issue>(kind))) {
            kinds.push_back(kind);
            works.push_back(loops.work(static_cast<Issue>(kind)));
        }
    }
    Interleaved interleaved(works, kIssueSlice);
    std::vector<double> times(kinds.size());
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        for (std::size_t i = 0; i < kinds.size(); ++i) {
            times[i] = fastest.improve(set, precision, static_cast<Issue>(kinds[i]),
                                       round[i] / IssueWorks::kOperationsPerStep);
        }
        state.SetIterationTime(round[0]);
    }
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        state.counters[kIssueNames[kinds[i]]] = 1e-9 / times[i];
    }
}

} // namespace

double FastestTimes::improve(InstructionSet set, Precision precision, Issue issue, double seconds) {
    double& fastest = times_.emplace(std::tuple(set, precision, issue), seconds).first->second;
    fastest = std::min(fastest, seconds);
    return fastest;
}

const IssueLoops& IssueWorks::choose(InstructionSet set, Precision precision) {
    const LimitLoops& loops = limit_loops(set);
    return precision == Precision::float32 ? loops.float_loops : loops.double_loops;
}

Work IssueWorks::work(Issue issue) const {
    return [loop = loops_.issue[static_cast<int>(issue)], scratch = &scratch_](long steps) {
        loop(steps * kOperationsPerStep, scratch);
    };
}

Row issue_row(InstructionSet set, Precision precision, double seconds, std::shared_ptr<FastestTimes> times) {
    const std::string set_name(name(set));
    std::string heading = printed("%-8s %-6s", "isa", "type");
    for (const char* kind : kIssueNames) {
        heading += printed(" %16s", kind);
    }
    return {"limits/issue/" + set_name + "/" + std::string(name(precision)),
            1,
            heading + "   (vector operations a ns)",
            std::max(3L, std::lround(seconds / (kIssueCount * kIssueSlice))),
            [=](benchmark::State& state) { measure(state, set, precision, *times); },
            [=](const auto& run) {
                std::string line = printed("%-8s %-6s", set_name.c_str(), std::string(name(precision)).c_str());
                for (const char* kind : kIssueNames) {
                    const double rate = counter(run, kind);
                    line += rate > 0 ? printed(" %16.3f", rate) : printed(" %16s", "-");
                }
                return line;
            }};
}

} // namespace hybmss::bench
