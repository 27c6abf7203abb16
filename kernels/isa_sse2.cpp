// baseline x86-64. Compiled with that set's flags; see CMakeLists.txt.
#include "kernels/make_table.hpp"

namespace hybmss::kernels {

constinit const KernelTable<float> kSse2Float = make_table<Batch<float, xsimd::sse2>>(InstructionSet::sse2);
constinit const KernelTable<double> kSse2Double = make_table<Batch<double, xsimd::sse2>>(InstructionSet::sse2);

} // namespace hybmss::kernels
