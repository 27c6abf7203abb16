#pragma once

#include "hybmss/plan_options.hpp"
#include "plan/tuning/operation.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// One complete answer to what the options leave open.
struct Candidate {
    std::string layout;
    InstructionSet instruction_set = InstructionSet::automatic;
    Accuracy accuracy = Accuracy::accurate;
    int threads = 1;
    std::size_t tile_nodes = 0; ///< 0: the body's own rule
    bool split = false;         ///< nodes are integrated in a pass of its own, though the layout can do otherwise
    bool operator==(const Candidate&) const = default;
};

/// "flat-rows/avx512/fast/threads:2", and where they are not the body's own, "/tile:4096" and "/split" after it.
std::string name(const Candidate& candidate);

/// The inverse of name(); nothing where the text is not a candidate's name.
std::optional<Candidate> parse_candidate(std::string_view text);

/// Whether HYBMSS_ISA names a set.
bool instruction_set_is_forced();

/// `options` with everything that a candidate names fixed, and no effort left.
PlanOptions fixed_options(const PlanOptions& options, const Candidate& candidate);

/// The candidate that fixed options stand for.
Candidate candidate_of(const PlanOptions& fixed);

/// A candidate with tiles and integration as the options have them, not varied: those are timed first.
bool is_plain(const Candidate& candidate, const PlanOptions& options);

/// Whether a body's pieces in this layout have a size to choose, and whether a step in it can integrate nodes in the
/// sweep that computes their forces.
bool has_tiles(const std::string& layout);
bool can_fuse(const std::string& layout);

/// Every valid candidate for a body of `nodes` nodes, the one that `estimate` takes first. The one list that measuring,
/// stored wisdom, random picks and their tests draw from.
///
///     {layouts} x {best instruction set, next lower} x {accuracy asked for, exact} x {threads}
///               x {the body's own tiles, fused; tiles of 2^12, 2^15, 2^18 nodes; split}
///
/// What the options fix, stays: a named layout, a named instruction set (also by HYBMSS_ISA), exact accuracy, a size of
/// tiles, an integration. Threads are 1, 2, 3, 4, then powers of two, then the most that the body can use; there are at
/// least as many tiles as threads, and of the sizes that make the body one tile, the first only. `layouts` are those of
/// the body's kind, its default first. An integration matters to steps alone.
std::vector<Candidate> candidates(const std::vector<std::string>& layouts, const PlanOptions& options,
                                  std::size_t nodes, Operation operation);

} // namespace hybmss
