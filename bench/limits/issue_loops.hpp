#pragma once

/// \file
/// Loops that do nothing but one thing, as fast as a core can: for finding the limits that a kernel lives under.

#include "hybmss/instruction_set.hpp"

#include <cstddef>

namespace hybmss::bench {

/// Kinds of work that a core issues at a rate of their own.
enum class Issue {
    multiply_add,     ///< independent fused multiply-adds (without FMA: multiplications)
    add,              ///< independent additions
    mixed,            ///< as many of each, alternating: the most vector arithmetic that a core can issue
    mixed_and_stores, ///< the same, with kStoresInMix aligned stores to the first cache among kMixed operations
    mixed_and_spills, ///< the same with kSpillsInMix: about as many as a compiler adds to a step that wants more
                      ///< registers
    store,            ///< aligned stores to the first cache
    square_root,
    divide,
    reciprocal_square_root ///< the estimate; null where the instruction set has none
};
inline constexpr int kIssueCount = 9;
inline constexpr int kMixed = 112, kStoresInMix = 4, kSpillsInMix = 28;
inline constexpr const char* kIssueNames[kIssueCount] = {"multiply-add",     "add",   "mixed",       "mixed-and-stores",
                                                         "mixed-and-spills", "store", "square-root", "divide",
                                                         "rsqrt-estimate"};

/// Loops for one precision. Each call issues `operations` vector operations, rounded up to a multiple of at most
/// kMixed. `scratch` holds at least 4 KiB, aligned to 64 bytes.
struct IssueLoops {
    int width; ///< lanes of a vector
    void (*issue[kIssueCount])(long operations, void* scratch);
};

/// Loops over memory, 64-byte aligned and a multiple of 1 KiB long.
struct StreamLoops {
    void (*read)(const void* from, std::size_t bytes);
    void (*write)(void* to, std::size_t bytes);
    void (*copy)(const void* from, void* to, std::size_t bytes);
    void (*update)(void* data, std::size_t bytes); ///< reads and writes every byte in place
};

/// The loops compiled for one instruction set.
struct LimitLoops {
    InstructionSet instruction_set;
    IssueLoops float_loops, double_loops;
    StreamLoops stream;
};

/// The loops of an available instruction set (not `automatic`).
const LimitLoops& limit_loops(InstructionSet set);

} // namespace hybmss::bench
