// NEON of AArch64.
#include "bench/limits/issue_loops_impl.hpp"

namespace hybmss::bench {

constinit const LimitLoops kNeonLoops =
    limit_loops_of<Batch<float, xsimd::neon64>, Batch<double, xsimd::neon64>>(InstructionSet::neon);

} // namespace hybmss::bench
