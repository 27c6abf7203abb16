// Compiled once for each instruction set: its tables of all kernels, and those for `exact`.
#include "kernels/compiled_set.hpp"

namespace hybmss::kernels::HYBMSS_KERNEL_SET {

extern const KernelTable<float> float_table, exact_float_table;
extern const KernelTable<double> double_table, exact_double_table;

#define HYBMSS_KERNEL(name, ...) .name = name##_float,
constinit const KernelTable<float> float_table = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .width = kWidth<FloatBatch>,
#include "kernels/kernels.inc"
};
#undef HYBMSS_KERNEL
#define HYBMSS_KERNEL(name, ...) .name = name##_exact_float,
constinit const KernelTable<float> exact_float_table = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .width = kWidth<FloatBatch>,
#include "kernels/kernels.inc"
};
#undef HYBMSS_KERNEL
#define HYBMSS_KERNEL(name, ...) .name = name##_double,
constinit const KernelTable<double> double_table = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .width = kWidth<DoubleBatch>,
#include "kernels/kernels.inc"
};
#undef HYBMSS_KERNEL
#define HYBMSS_KERNEL(name, ...) .name = name##_exact_double,
constinit const KernelTable<double> exact_double_table = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .width = kWidth<DoubleBatch>,
#include "kernels/kernels.inc"
};
#undef HYBMSS_KERNEL

} // namespace hybmss::kernels::HYBMSS_KERNEL_SET
