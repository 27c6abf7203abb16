// The baseline of x86-64.
#include "bench/limits/issue_loops_impl.hpp"

namespace hybmss::bench {

constinit const LimitLoops kSse2Loops =
    limit_loops_of<Batch<float, xsimd::sse2>, Batch<double, xsimd::sse2>>(InstructionSet::sse2);

} // namespace hybmss::bench
