#include "tests/kernels/simd_probe_impl.hpp"

namespace hybmss::testing {

const SimdProbe<float> kNeonFloatProbe = make_probe<Batch<float, xsimd::neon64>>(InstructionSet::neon);
const SimdProbe<double> kNeonDoubleProbe = make_probe<Batch<double, xsimd::neon64>>(InstructionSet::neon);

} // namespace hybmss::testing
