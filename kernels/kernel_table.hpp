#pragma once

// All kernels of an instruction set, from the list in kernels.inc; a plan takes its kernels from here once.

#include "hybmss/instruction_set.hpp"
#include "kernels/variants.hpp"

namespace hybmss::kernels {

/// The type of each kernel's table of variants, by the kernel's name.
namespace listed {
#define HYBMSS_KERNEL(name, proof, ...)                                                                                \
    template <class T>                                                                                                 \
    using name = Variants<__VA_ARGS__>;
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
} // namespace listed

/// `table.name(choices...)` is the kernel's function for these choices.
template <class T>
struct KernelTable {
    InstructionSet instruction_set;
    int width; ///< lanes of a vector
#define HYBMSS_KERNEL(name, ...) const listed::name<T>& name;
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
};

/// The table of an available instruction set (not `automatic`): for `exact`, whose kernels give the same bits on every
/// set, or for the other levels. A kernel has no function for a level of the other table.
template <class T>
const KernelTable<T>& kernel_table(InstructionSet set, Accuracy accuracy = Accuracy::accurate);

} // namespace hybmss::kernels
