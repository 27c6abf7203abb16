// NEON of AArch64.
#include "bench/limits/spring_forms_impl.hpp"

namespace hybmss::bench {

constinit const SpringForms kNeonForms = spring_forms_of<Batch<float, xsimd::neon64>, Batch<double, xsimd::neon64>>();

} // namespace hybmss::bench
