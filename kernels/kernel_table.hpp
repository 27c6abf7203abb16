#pragma once

// One table of kernels for each instruction set and precision; a plan takes its kernels from it once.

#include "hybmss/instruction_set.hpp"
#include "kernels/hessian_kernels.hpp"
#include "kernels/lattice/lattice_kernels.hpp"
#include "kernels/network/network_kernels.hpp"
#include "kernels/spring_effect_kernels.hpp"

namespace hybmss::kernels {

/// The families of kernels.
template <class T>
struct KernelTable {
    InstructionSet instruction_set;
    const LatticeKernels<T>* lattice; ///< flat-rows
    const LatticeKernels<T>* active;  ///< active-rows
    const LatticeHessianKernels<T>* lattice_hessian;
    const SoaKernels<T>* soa;
    const PackedKernels<T>* packed;
    const RunKernels<T>* runs;
    const SoaHessianKernels<T>* soa_hessian;
    const PackedHessianKernels<T>* packed_hessian;
    const RunHessianKernels<T>* runs_hessian;
    const LatticeEffectKernels<T>* lattice_effects;
    const NetworkEffectKernels<T>* network_effects;
};

/// The table of an available instruction set (not `automatic`).
template <class T>
const KernelTable<T>& kernel_table(InstructionSet set);

} // namespace hybmss::kernels
