#pragma once

/// \file
/// How many bytes a core moves from and to each level of memory.

#include "bench/row.hpp"
#include "hybmss/instruction_set.hpp"

namespace hybmss::bench {

/// "limits/bandwidth/avx512": GB/s of reading, writing and copying (both counted) in each cache and in memory.
Row bandwidth_row(InstructionSet set, double seconds);

} // namespace hybmss::bench
