// The baseline of x86-64.
#include "bench/limits/spring_forms_impl.hpp"

namespace hybmss::bench {

constinit const SpringForms kSse2Forms = spring_forms_of<Batch<float, xsimd::sse2>, Batch<double, xsimd::sse2>>();

} // namespace hybmss::bench
