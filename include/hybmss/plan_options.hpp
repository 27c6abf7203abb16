#pragma once

/// \file
/// What a caller may wish of a plan, and what a plan tells of itself.

#include "hybmss/accuracy.hpp"
#include "hybmss/export.h"
#include "hybmss/instruction_set.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

struct TaskRunner;
class Wisdom;

/// How a plan chooses among the layouts, instruction sets, accuracies, threads and tiles that the options leave open.
enum class Effort {
    estimate, ///< a fixed choice, nothing is timed; the same on every run
    measure,  ///< what the wisdom holds, else times the candidates; may differ from run to run
    stored    ///< only what the wisdom holds, else std::invalid_argument; the same on every run
};

/// "estimate", "measure" or "stored".
HYBMSS_EXPORT std::string_view name(Effort effort);

/// The inverse of name(). Throws std::invalid_argument that lists the known names.
HYBMSS_EXPORT Effort parse_effort(std::string_view text);

struct PlanOptions {
    InstructionSet instruction_set = InstructionSet::automatic;
    /// Name of a layout, "" for the plan's own choice. See lattice_layouts() and network_layouts(); for a lattice,
    /// "network" means explicit springs made from it.
    std::string layout;
    /// The least accuracy: a plan that measures may choose `exact` if that is no slower.
    Accuracy accuracy = Accuracy::accurate;
    /// Above 0: takes the place of `accuracy`, and the plan takes the fastest level of its type whose bound
    /// (force_error_bound()) is at most this; std::invalid_argument where the type has none. See fastest_level() for
    /// the type.
    double force_error = 0;
    /// Worker threads at most, >= 0; 0 for all of the machine. A small body takes fewer. The results do not depend on
    /// it.
    int threads = 0;
    /// The body as one tile, so with one thread: nothing has to be joined where tiles meet, which large bodies gain up
    /// to a tenth by. Sums are made in another order than in tiles, so the last bits are others. In the
    /// layout coloured-soa, which has no tiles, it is one thread and nothing else.
    bool one_tile = false;
    Effort effort = Effort::estimate;
    /// Read by `stored` and `measure`; `measure` adds what it finds. Owned by the caller, used during construction
    /// only; null: none.
    Wisdom* wisdom = nullptr;
    /// About how long, in s, `measure` may time candidates for one plan; finite and > 0.
    double measure_seconds = 0.3;
    /// Threads of the caller's in place of oneTBB's; null: oneTBB. Copied; what its `user` points to must live as long
    /// as the plan. `threads` above counts as before, but no more than the runner has.
    const TaskRunner* task_runner = nullptr;
};

/// What the tuner found of one candidate.
struct CandidateFigure {
    std::string name;            ///< layout/instruction set/accuracy/threads:N, and /one-tile where so
    double ns_per_cell_step = 0; ///< per node where the body has no cells
    bool finalist = false; ///< timed to the end on the full sample, not dropped early: its figure is the surer one
};

/// What a plan chose and what it holds.
struct PlanDescription {
    InstructionSet instruction_set = InstructionSet::automatic;
    std::string layout;
    std::string kernel; ///< e.g. "lattice_layer<face_diagonals, quadratic, accurate>"
    std::string precision;
    int threads = 1;
    std::size_t nodes = 0, springs = 0, cells = 0;
    std::size_t bytes = 0; ///< held by the plan itself, scratch included
    std::size_t tiles = 0; ///< independent pieces of work; fixed by the body and one_tile, not by the threads
    /// What makes this very plan of the same body again, with nothing timed; names no wisdom and no task runner. Its
    /// `layout` may be "" (of an estimate) where it was left open: the same rule settles it again, and `layout` above
    /// tells how.
    PlanOptions choice;
    Effort effort = Effort::estimate;
    std::string reason;                      ///< why this choice, in one line
    std::vector<CandidateFigure> candidates; ///< fastest first; empty where nothing was ever timed
};

/// One line a fact, for a person.
HYBMSS_EXPORT std::string to_string(const PlanDescription& description);

/// The layouts that can be named for a lattice and for a network.
HYBMSS_EXPORT std::vector<std::string> lattice_layouts();
HYBMSS_EXPORT std::vector<std::string> network_layouts();

} // namespace hybmss
