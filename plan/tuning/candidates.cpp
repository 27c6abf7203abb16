#include "plan/tuning/candidates.hpp"

#include "plan/bodies/body.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace hybmss {
namespace {

constexpr std::string_view kThreads = "threads:", kTile = "tile:", kSplit = "split";

/// A tile's share of the first, the second and the third cache.
constexpr std::size_t kTileNodes[] = {1 << 12, 1 << 15, 1 << 18};

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

/// The number in "KEYnumber", above 0.
template <class Number>
std::optional<Number> number_after(std::string_view key, std::string_view part) {
    if (!part.starts_with(key)) {
        return std::nullopt;
    }
    part.remove_prefix(key.size());
    Number number{};
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
    if (error != std::errc() || end != part.data() + part.size() || number < 1) {
        return std::nullopt;
    }
    return number;
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

/// `plain`, and the same with other tiles and with the integration split off.
void append_variants(const Candidate& plain, const PlanOptions& options, std::size_t nodes, Operation operation,
                     std::vector<Candidate>& all) {
    const bool fuses = operation == Operation::step && can_fuse(plain.layout);
    Candidate first = plain;
    first.tile_nodes = has_tiles(plain.layout) ? options.tile_nodes : 0;
    first.split = fuses && options.integration == Integration::split;
    all.push_back(first);
    if (has_tiles(plain.layout) && options.tile_nodes == 0) {
        for (const std::size_t tile_nodes : kTileNodes) {
            if (nodes / tile_nodes >= static_cast<std::size_t>(plain.threads) || plain.threads == 1) {
                all.push_back(first);
                all.back().tile_nodes = tile_nodes;
            }
            if (tile_nodes >= nodes) {
                break;
            }
        }
    }
    if (fuses && options.integration == Integration::automatic) {
        all.push_back(first);
        all.back().split = true;
    }
}

} // namespace

bool instruction_set_is_forced() {
    const char* forced = std::getenv("HYBMSS_ISA");
    return forced && *forced && std::string_view(forced) != name(InstructionSet::automatic);
}

std::string name(const Candidate& c) {
    std::string text = c.layout + "/" + std::string(name(c.instruction_set)) + "/" + std::string(name(c.accuracy)) +
                       "/" + std::string(kThreads) + std::to_string(c.threads);
    if (c.tile_nodes) {
        text.append("/").append(kTile).append(std::to_string(c.tile_nodes));
    }
    if (c.split) {
        text.append("/").append(kSplit);
    }
    return text;
}

std::optional<Candidate> parse_candidate(std::string_view text) {
    // From the right: a layout's name may itself hold a slash.
    Candidate c;
    std::string_view part = last_part(text);
    if (part == kSplit) {
        c.split = true;
        part = last_part(text);
    }
    if (part.starts_with(kTile)) {
        const auto tile_nodes = number_after<std::size_t>(kTile, part);
        if (!tile_nodes) {
            return std::nullopt;
        }
        c.tile_nodes = *tile_nodes;
        part = last_part(text);
    }
    const auto threads = number_after<int>(kThreads, part);
    const std::string_view accuracy = last_part(text), set_name = last_part(text);
    const auto known = {InstructionSet::sse2, InstructionSet::avx2, InstructionSet::avx512, InstructionSet::neon};
    const auto levels = {Accuracy::fast, Accuracy::accurate, Accuracy::exact};
    const auto* level = std::find_if(levels.begin(), levels.end(), [&](Accuracy a) { return name(a) == accuracy; });
    const auto* set = std::find_if(known.begin(), known.end(), [&](InstructionSet s) { return name(s) == set_name; });
    if (text.empty() || set == known.end() || level == levels.end() || !threads) {
        return std::nullopt;
    }
    c.layout = text;
    c.instruction_set = *set;
    c.accuracy = *level;
    c.threads = *threads;
    return c;
}

PlanOptions fixed_options(const PlanOptions& options, const Candidate& candidate) {
    PlanOptions fixed = options;
    fixed.layout = candidate.layout;
    fixed.instruction_set = candidate.instruction_set;
    fixed.accuracy = candidate.accuracy;
    fixed.force_error = 0;
    fixed.threads = candidate.threads;
    fixed.tile_nodes = candidate.tile_nodes;
    fixed.integration = candidate.split ? Integration::split : Integration::automatic;
    fixed.effort = Effort::estimate;
    fixed.wisdom = nullptr;
    return fixed;
}

Candidate candidate_of(const PlanOptions& fixed) {
    return {fixed.layout,  fixed.instruction_set, fixed.accuracy,
            fixed.threads, fixed.tile_nodes,      fixed.integration == Integration::split && can_fuse(fixed.layout)};
}

bool is_plain(const Candidate& candidate, const PlanOptions& options) {
    return (candidate.tile_nodes == 0 || candidate.tile_nodes == options.tile_nodes) &&
           (!candidate.split || options.integration == Integration::split);
}

std::vector<Candidate> candidates(const std::vector<std::string>& layouts, const PlanOptions& options,
                                  std::size_t nodes, Operation operation) {
    const std::vector<std::string> named = {options.layout};
    std::vector<Accuracy> accuracies = {options.accuracy};
    if (options.accuracy != Accuracy::exact) {
        // Never less accurate, and faster where estimates are slow.
        accuracies.push_back(Accuracy::exact);
    }
    std::vector<Candidate> all;
    for (const std::string& layout : options.layout.empty() ? layouts : named) {
        if (operation == Operation::step && options.integration == Integration::fused && !can_fuse(layout)) {
            continue;
        }
        for (const InstructionSet set : sets_to_try(options.instruction_set)) {
            for (const Accuracy accuracy : accuracies) {
                for (const int threads : threads_to_try(useful_threads(options.threads, nodes, options.task_runner))) {
                    append_variants({layout, set, accuracy, threads}, options, nodes, operation, all);
                }
            }
        }
    }
    return all;
}

} // namespace hybmss
