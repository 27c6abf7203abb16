// 64-bit ARM. Compiled with that set's flags; see CMakeLists.txt.
#include "kernels/make_table.hpp"

namespace hybmss::kernels {

constinit const KernelTable<float> kNeonFloat = make_table<Batch<float, xsimd::neon64>>(InstructionSet::neon);
constinit const KernelTable<double> kNeonDouble = make_table<Batch<double, xsimd::neon64>>(InstructionSet::neon);

} // namespace hybmss::kernels
