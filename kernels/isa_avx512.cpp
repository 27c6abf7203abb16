// AVX-512 F, CD, DQ, BW, VL. Compiled with that set's flags; see CMakeLists.txt.
#include "kernels/make_table.hpp"

namespace hybmss::kernels {

constinit const KernelTable<float> kAvx512Float = make_table<Batch<float, xsimd::avx512bw>>(InstructionSet::avx512);
constinit const KernelTable<double> kAvx512Double = make_table<Batch<double, xsimd::avx512bw>>(InstructionSet::avx512);

} // namespace hybmss::kernels
