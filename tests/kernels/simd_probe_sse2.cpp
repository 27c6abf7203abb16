#include "tests/kernels/simd_probe_impl.hpp"

namespace hybmss::testing {

const SimdProbe<float> kSse2FloatProbe = make_probe<Batch<float, xsimd::sse2>>(InstructionSet::sse2);
const SimdProbe<double> kSse2DoubleProbe = make_probe<Batch<double, xsimd::sse2>>(InstructionSet::sse2);

} // namespace hybmss::testing
