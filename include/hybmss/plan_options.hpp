#pragma once

/// \file
/// What a caller may wish of a plan, and what a plan tells of itself.

#include "hybmss/accuracy.hpp"
#include "hybmss/instruction_set.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace hybmss {

struct PlanOptions {
    InstructionSet instruction_set = InstructionSet::automatic;
    /// Name of a layout, "" for the plan's own choice. For a lattice: "flat-rows", or "network" (explicit springs made
    /// from it); for a network: "coloured-soa".
    std::string layout;
    Accuracy accuracy = Accuracy::fast;
    /// Worker threads at most, >= 0; 0 for all of the machine. A small body takes fewer. The results do not depend on
    /// it.
    int threads = 0;
};

/// What a plan chose and what it holds.
struct PlanDescription {
    InstructionSet instruction_set = InstructionSet::automatic;
    std::string layout;
    std::string kernel; ///< e.g. "lattice_layer<face_diagonals, quadratic, fast>"
    std::string precision;
    int threads = 1;
    std::size_t nodes = 0, springs = 0, cells = 0;
    std::size_t bytes = 0; ///< held by the plan itself, scratch included
    std::size_t tiles = 0; ///< independent pieces of work; fixed by the body, not by the threads
};

/// One line a fact, for a person.
std::string to_string(const PlanDescription& description);

/// The layouts that can be named for a lattice and for a network.
std::vector<std::string> lattice_layouts();
std::vector<std::string> network_layouts();

} // namespace hybmss
