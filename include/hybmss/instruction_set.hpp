#pragma once

/// \file
/// The instruction sets that kernels exist for, which of them this machine runs, and their names.

#include <string_view>
#include <vector>

namespace hybmss {

enum class InstructionSet { automatic, sse2, avx2, avx512, neon };

/// "automatic", "sse2", "avx2", "avx512" or "neon".
std::string_view name(InstructionSet set);

/// The inverse of name(). Throws std::invalid_argument that lists the known names.
InstructionSet parse_instruction_set(std::string_view text);

/// Sets that both this build and this machine have, weakest first.
std::vector<InstructionSet> available_instruction_sets();

/// `automatic` becomes what the environment variable HYBMSS_ISA names, else the best available.
/// Throws std::invalid_argument where the wanted set is not available on this machine.
InstructionSet resolve(InstructionSet wanted);

} // namespace hybmss
