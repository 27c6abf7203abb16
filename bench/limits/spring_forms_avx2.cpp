// AVX2 and FMA; see CMakeLists.txt.
#include "bench/limits/spring_forms_impl.hpp"

namespace hybmss::bench {

constinit const SpringForms kAvx2Forms =
    spring_forms_of<Batch<float, xsimd::fma3<xsimd::avx2>>, Batch<double, xsimd::fma3<xsimd::avx2>>>();

} // namespace hybmss::bench
