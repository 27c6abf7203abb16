#pragma once

/// \file
/// What a digit costs in a kernel: the springs of a cube in every form, their error against long double and their time.

#include "bench/row.hpp"
#include "hybmss/instruction_set.hpp"

#include <vector>

namespace hybmss::bench {

/// "digits/avx512/float/displacement/refined" and so on, for each of `sets`. Each row is timed in turns with the form
/// that the library uses, displacement and refined (where there is no estimate: exact). About `seconds` a row.
std::vector<Row> digit_benchmark(const std::vector<InstructionSet>& sets, double seconds);

extern const char* const kDigitIntroduction;

} // namespace hybmss::bench
