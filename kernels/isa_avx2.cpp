// AVX2 and FMA. Compiled with that set's flags; see CMakeLists.txt.
#include "kernels/make_table.hpp"

namespace hybmss::kernels {

constinit const KernelTable<float> kAvx2Float =
    make_table<Batch<float, xsimd::fma3<xsimd::avx2>>>(InstructionSet::avx2);
constinit const KernelTable<double> kAvx2Double =
    make_table<Batch<double, xsimd::fma3<xsimd::avx2>>>(InstructionSet::avx2);

} // namespace hybmss::kernels
