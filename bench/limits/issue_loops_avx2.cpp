// AVX2 and FMA; see CMakeLists.txt.
#include "bench/limits/issue_loops_impl.hpp"

namespace hybmss::bench {

constinit const LimitLoops kAvx2Loops =
    limit_loops_of<Batch<float, xsimd::fma3<xsimd::avx2>>, Batch<double, xsimd::fma3<xsimd::avx2>>>(
        InstructionSet::avx2);

} // namespace hybmss::bench
