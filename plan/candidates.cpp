#include "plan/candidates.hpp"

#include "plan/workers.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace hybmss {
namespace {

constexpr std::string_view kThreads = "threads:";

std::vector<InstructionSet> sets_to_try(InstructionSet wanted) {
    const InstructionSet best = resolve(wanted);
    std::vector<InstructionSet> sets = {best};
    const std::vector<InstructionSet> available = available_instruction_sets();
    // The next lower may win where wide vectors lower the clock.
    if (wanted == InstructionSet::automatic && !instruction_set_is_forced() && available.size() > 1) {
        sets.push_back(available[available.size() - 2]);
    }
    return sets;
}

/// Most first: that is what `estimate` takes.
std::vector<int> threads_to_try(int most) {
    std::vector<int> threads = {most};
    for (int t = 1; t < most; t = t < 4 ? t + 1 : 2 * t) {
        threads.push_back(t);
    }
    return threads;
}

} // namespace

bool instruction_set_is_forced() {
    const char* forced = std::getenv("HYBMSS_ISA");
    return forced && *forced && std::string_view(forced) != name(InstructionSet::automatic);
}

std::string name(const Candidate& c) {
    return c.layout + "/" + std::string(name(c.instruction_set)) + "/" +
           (c.accuracy == Accuracy::fast ? "fast" : "exact") + "/" + std::string(kThreads) + std::to_string(c.threads);
}

std::optional<Candidate> parse_candidate(std::string_view text) {
    // From the right: a layout's name may itself hold a slash.
    std::string_view parts[3];
    for (auto part = std::rbegin(parts); part != std::rend(parts); ++part) {
        const std::size_t slash = text.rfind('/');
        if (slash == std::string_view::npos) {
            return std::nullopt;
        }
        *part = text.substr(slash + 1);
        text = text.substr(0, slash);
    }
    Candidate c;
    c.layout = text;
    const auto known = {InstructionSet::sse2, InstructionSet::avx2, InstructionSet::avx512, InstructionSet::neon};
    const auto* set = std::find_if(known.begin(), known.end(), [&](InstructionSet s) { return name(s) == parts[0]; });
    if (text.empty() || set == known.end() || (parts[1] != "fast" && parts[1] != "exact") ||
        !parts[2].starts_with(kThreads)) {
        return std::nullopt;
    }
    c.instruction_set = *set;
    c.accuracy = parts[1] == "fast" ? Accuracy::fast : Accuracy::exact;
    const std::string_view count = parts[2].substr(kThreads.size());
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), c.threads);
    if (error != std::errc() || end != count.data() + count.size() || c.threads < 1) {
        return std::nullopt;
    }
    return c;
}

PlanOptions fixed_options(const PlanOptions& options, const Candidate& candidate) {
    PlanOptions fixed = options;
    fixed.layout = candidate.layout;
    fixed.instruction_set = candidate.instruction_set;
    fixed.accuracy = candidate.accuracy;
    fixed.threads = candidate.threads;
    fixed.effort = Effort::estimate;
    fixed.wisdom = nullptr;
    return fixed;
}

std::vector<Candidate> candidates(const std::vector<std::string>& layouts, const PlanOptions& options,
                                  std::size_t nodes) {
    const std::vector<std::string> named = {options.layout};
    std::vector<Accuracy> accuracies = {options.accuracy};
    if (options.accuracy == Accuracy::fast) {
        // Never less accurate, and faster where estimates are slow.
        accuracies.push_back(Accuracy::exact);
    }
    std::vector<Candidate> all;
    for (const std::string& layout : options.layout.empty() ? layouts : named) {
        for (const InstructionSet set : sets_to_try(options.instruction_set)) {
            for (const Accuracy accuracy : accuracies) {
                for (const int threads : threads_to_try(useful_threads(options.threads, nodes, options.task_runner))) {
                    all.push_back({layout, set, accuracy, threads});
                }
            }
        }
    }
    return all;
}

} // namespace hybmss
