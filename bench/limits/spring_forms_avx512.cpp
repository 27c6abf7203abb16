// AVX-512; see CMakeLists.txt.
#include "bench/limits/spring_forms_impl.hpp"

namespace hybmss::bench {

constinit const SpringForms kAvx512Forms =
    spring_forms_of<Batch<float, xsimd::avx512bw>, Batch<double, xsimd::avx512bw>>();

} // namespace hybmss::bench
