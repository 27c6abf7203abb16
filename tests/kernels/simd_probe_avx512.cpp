#include "tests/kernels/simd_probe_impl.hpp"

namespace hybmss::testing {

const SimdProbe<float> kAvx512FloatProbe = make_probe<Batch<float, xsimd::avx512bw>>(InstructionSet::avx512);
const SimdProbe<double> kAvx512DoubleProbe = make_probe<Batch<double, xsimd::avx512bw>>(InstructionSet::avx512);

} // namespace hybmss::testing
