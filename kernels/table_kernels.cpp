// Compiled once for each instruction set: its table of all kernels.
#include "kernels/compiled_set.hpp"

namespace hybmss::kernels::HYBMSS_KERNEL_SET {

extern const KernelTable<float> float_table;
extern const KernelTable<double> double_table;

constinit const KernelTable<float> float_table = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .width = kWidth<FloatBatch>,
#define HYBMSS_KERNEL(name, ...) .name = name##_float,
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
};
constinit const KernelTable<double> double_table = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .width = kWidth<DoubleBatch>,
#define HYBMSS_KERNEL(name, ...) .name = name##_double,
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
};

} // namespace hybmss::kernels::HYBMSS_KERNEL_SET
