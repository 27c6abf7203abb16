#include "plan/tuning/candidates.hpp"

#include "layouts/messages.hpp"
#include "plan/bodies/layout_table.hpp"
#include "plan/threads/workers.hpp"

#include <algorithm>
#include <cstdlib>

namespace hybmss {
namespace {

constexpr std::string_view kThreads = "threads:", kOneTile = "/one-tile";

/// What follows the last slash, which it takes away; nothing where there is none.
std::string_view last_part(std::string_view& text) {
    const std::size_t slash = text.rfind('/');
    if (slash == std::string_view::npos) {
        return {};
    }
    const std::string_view part = text.substr(slash + 1);
    text = text.substr(0, slash);
    return part;
}

/// The number in "threads:number", above 0.
std::optional<int> threads_in(std::string_view part) {
    if (!part.starts_with(kThreads)) {
        return std::nullopt;
    }
    part.remove_prefix(kThreads.size());
    int threads = 0;
    if (!parse_number(part, threads) || threads < 1) {
        return std::nullopt;
    }
    return threads;
}

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
    return c.layout + "/" + std::string(name(c.instruction_set)) + "/" + std::string(name(c.accuracy)) + "/" +
           std::string(kThreads) + std::to_string(c.threads) + std::string(c.one_tile ? kOneTile : "");
}

std::optional<Candidate> parse_candidate(std::string_view text) {
    // From the right: a layout's name may itself hold a slash.
    const bool one_tile = text.ends_with(kOneTile);
    text.remove_suffix(one_tile ? kOneTile.size() : 0);
    const auto threads = threads_in(last_part(text));
    const std::string_view accuracy = last_part(text), set_name = last_part(text);
    const auto known = {InstructionSet::sse2, InstructionSet::avx2, InstructionSet::avx512, InstructionSet::neon};
    const auto levels = {Accuracy::fast, Accuracy::accurate, Accuracy::exact};
    const auto* level = std::find_if(levels.begin(), levels.end(), [&](Accuracy a) { return name(a) == accuracy; });
    const auto* set = std::find_if(known.begin(), known.end(), [&](InstructionSet s) { return name(s) == set_name; });
    if (text.empty() || set == known.end() || level == levels.end() || !threads) {
        return std::nullopt;
    }
    return Candidate{std::string(text), *set, *level, *threads, one_tile};
}

PlanOptions fixed_options(const PlanOptions& options, const Candidate& candidate) {
    PlanOptions fixed = options;
    fixed.layout = candidate.layout;
    fixed.instruction_set = candidate.instruction_set;
    fixed.accuracy = candidate.accuracy;
    fixed.force_error = 0;
    fixed.threads = candidate.threads;
    fixed.one_tile = candidate.one_tile;
    fixed.effort = Effort::estimate;
    fixed.wisdom = nullptr;
    return fixed;
}

Candidate candidate_of(const PlanOptions& fixed) {
    return {fixed.layout, fixed.instruction_set, fixed.accuracy, fixed.threads,
            fixed.one_tile && has_tiles(fixed.layout)};
}

std::vector<Candidate> candidates(const std::vector<std::string>& layouts, const PlanOptions& options,
                                  std::size_t nodes) {
    const std::vector<std::string> named = {options.layout};
    std::vector<Accuracy> accuracies = {options.accuracy};
    if (options.accuracy != Accuracy::exact) {
        // Never less accurate, and faster where estimates are slow.
        accuracies.push_back(Accuracy::exact);
    }
    const int most = useful_threads(options, nodes);
    std::vector<Candidate> all;
    for (const std::string& layout : options.layout.empty() ? layouts : named) {
        for (const InstructionSet set : sets_to_try(options.instruction_set)) {
            for (const Accuracy accuracy : accuracies) {
                for (const int threads : threads_to_try(most)) {
                    all.push_back({layout, set, accuracy, threads, options.one_tile && has_tiles(layout)});
                    if (threads == 1 && has_tiles(layout) && !options.one_tile) {
                        all.push_back({layout, set, accuracy, 1, true});
                    }
                }
            }
        }
    }
    return all;
}

} // namespace hybmss
