#pragma once

#include "hybmss/plan_options.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// What a plan is for: it is what gets timed.
enum class Operation {
    step,  ///< ExplicitDynamics::step
    forces ///< ForcePlan::add_forces
};

/// One complete answer to what the options leave open.
struct Candidate {
    std::string layout;
    InstructionSet instruction_set = InstructionSet::automatic;
    Accuracy accuracy = Accuracy::accurate;
    int threads = 1;
    bool one_tile = false;
    bool operator==(const Candidate&) const = default;
};

/// "flat-rows/avx512/fast/threads:2", "flat-rows/avx512/fast/threads:1/one-tile"
std::string name(const Candidate& candidate);

/// The inverse of name(); nothing where the text is not a candidate's name.
std::optional<Candidate> parse_candidate(std::string_view text);

/// Whether HYBMSS_ISA names a set.
bool instruction_set_is_forced();

/// `options` with everything that a candidate names fixed, and no effort left.
PlanOptions fixed_options(const PlanOptions& options, const Candidate& candidate);

/// The candidate that fixed options stand for.
Candidate candidate_of(const PlanOptions& fixed);

/// Every valid candidate for a body of `nodes` nodes, the one that `estimate` takes first. The one list that measuring,
/// stored wisdom and their tests draw from.
///
///     {layouts} x {best instruction set, next lower} x {accuracy asked for, exact} x {threads; one tile}
///
/// What the options fix, stays: a named layout, a named instruction set (also by HYBMSS_ISA), exact accuracy, one tile.
/// Threads are 1, 2, 3, 4, then powers of two, then the most that the body can use; one tile takes one. `layouts` are
/// those of the body's kind, its default first.
std::vector<Candidate> candidates(const std::vector<std::string>& layouts, const PlanOptions& options,
                                  std::size_t nodes);

} // namespace hybmss
