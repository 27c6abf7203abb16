#include "bench/limits/machine_limits.hpp"

#include "layouts/aligned_array.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unistd.h>

namespace hybmss::bench {

#define HYBMSS_BUILT_ONLY
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    namespace set {                                                                                                    \
    extern const LimitLoops limit_loops;                                                                               \
    }
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET

const LimitLoops& limit_loops(InstructionSet wanted) {
    switch (wanted) {
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    case InstructionSet::set:                                                                                          \
        return set::limit_loops;
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
    default:
        throw std::invalid_argument("no loops for the instruction set " + std::string(name(wanted)));
    }
}

namespace {

constexpr double kBandwidthSlice = 0.006;
constexpr std::array<const char*, 4> kLevels = {"L1", "L2", "L3", "memory"};
constexpr std::array<const char*, 3> kMoves = {"read", "write", "copy"};

/// Half of each cache, so that nothing else drives the data out; for memory four times the last cache. What the system
/// does not tell is taken as usual.
std::array<std::size_t, 4> working_sets() {
    const auto cache = [](int asked, long otherwise) {
        const long bytes = sysconf(asked);
        return static_cast<std::size_t>(bytes > 0 ? bytes : otherwise);
    };
    const std::size_t l1 = cache(_SC_LEVEL1_DCACHE_SIZE, 32L << 10), l2 = cache(_SC_LEVEL2_CACHE_SIZE, 1L << 20);
    const std::size_t l3 = cache(_SC_LEVEL3_CACHE_SIZE, 32L << 20);
    const auto kib = [](std::size_t bytes) { return bytes / 2048 * 2048; };
    // A shared last cache is hardly ever all ours: a quarter, and no more than four times the second.
    return {kib(l1 / 2), kib(l2 / 2), kib(std::min(l3 / 4, 4 * l2)),
            kib(std::clamp<std::size_t>(4 * l3, 64U << 20, 512U << 20))};
}

void measure_bandwidth(benchmark::State& state, InstructionSet set) {
    const StreamLoops& loops = limit_loops(set).stream;
    const auto sets = working_sets();
    AlignedArray<float> memory(sets.back() / sizeof(float));
    std::vector<Trial> works;
    for (std::size_t bytes : sets) {
        // A work's step moves about a megabyte, or the whole of it.
        const long repeats = std::max(1L, static_cast<long>((1U << 20) / bytes));
        char* data = reinterpret_cast<char*>(memory.data());
        works.push_back(timed([=](long steps) {
            for (long i = 0; i < steps * repeats; ++i) {
                loops.read(data, bytes);
            }
        }));
        works.push_back(timed([=](long steps) {
            for (long i = 0; i < steps * repeats; ++i) {
                loops.write(data, bytes);
            }
        }));
        works.push_back(timed([=](long steps) {
            for (long i = 0; i < steps * repeats; ++i) {
                loops.copy(data, data + bytes / 2, bytes / 2);
            }
        }));
    }
    Interleaved interleaved(works, kBandwidthSlice);
    std::vector<std::vector<double>> rates(works.size());
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> round = interleaved.next();
        for (std::size_t i = 0; i < round.size(); ++i) {
            const std::size_t bytes = sets[i / kMoves.size()];
            const double moved = static_cast<double>(bytes * std::max<std::size_t>(1, (1U << 20) / bytes));
            rates[i].push_back(1e-9 * moved / round[i]);
        }
        state.SetIterationTime(round[0]);
    }
    for (std::size_t i = 0; i < works.size(); ++i) {
        const std::string key = std::string(kLevels[i / kMoves.size()]) + "_" + kMoves[i % kMoves.size()];
        state.counters[key] = *std::max_element(rates[i].begin(), rates[i].end());
    }
}

constexpr double kIssueSlice = 0.004;

void measure_issue(benchmark::State& state, InstructionSet set, Precision precision, FastestTimes& fastest) {
    const IssueWorks loops(set, precision);
    std::vector<int> kinds;
    std::vector<Trial> works;
    for (int kind = 0; kind < kIssueCount; ++kind) {
        if (loops.has(static_cast<Issue>(kind))) {
            kinds.push_back(kind);
            works.push_back(timed(loops.work(static_cast<Issue>(kind))));
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

Row bandwidth_row(InstructionSet set, double seconds) {
    std::string heading = printed("%-15s", "isa");
    for (const char* level : kLevels) {
        for (const char* move : kMoves) {
            heading += printed(" %12s", (std::string(level) + " " + move).c_str());
        }
    }
    const double rounds = seconds / (kLevels.size() * kMoves.size() * kBandwidthSlice);
    return {"limits/bandwidth/" + std::string(name(set)),
            1,
            heading + "   (GB/s)",
            std::max(3L, std::lround(rounds)),
            [=](benchmark::State& state) { measure_bandwidth(state, set); },
            [=](const auto& run) {
                std::string line = printed("%-15s", std::string(name(set)).c_str());
                for (const char* level : kLevels) {
                    for (const char* move : kMoves) {
                        line += printed(" %12.1f", counter(run, (std::string(level) + "_" + move).c_str()));
                    }
                }
                return line;
            }};
}

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
            [=](benchmark::State& state) { measure_issue(state, set, precision, *times); },
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
