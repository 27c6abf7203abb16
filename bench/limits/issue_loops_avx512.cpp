// AVX-512; see CMakeLists.txt.
#include "bench/limits/issue_loops_impl.hpp"

namespace hybmss::bench {

constinit const LimitLoops kAvx512Loops =
    limit_loops_of<Batch<float, xsimd::avx512bw>, Batch<double, xsimd::avx512bw>>(InstructionSet::avx512);

} // namespace hybmss::bench
