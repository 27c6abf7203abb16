#include "tests/kernels/simd_probe_impl.hpp"

namespace hybmss::testing {

const SimdProbe<float> kAvx2FloatProbe = make_probe<Batch<float, xsimd::fma3<xsimd::avx2>>>(InstructionSet::avx2);
const SimdProbe<double> kAvx2DoubleProbe = make_probe<Batch<double, xsimd::fma3<xsimd::avx2>>>(InstructionSet::avx2);

} // namespace hybmss::testing
