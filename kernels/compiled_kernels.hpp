#pragma once

// The tables that the files *_kernels.cpp fill, each file once for every instruction set, in a namespace of that name.

#include "kernels/kernel_table.hpp"

namespace hybmss::kernels {

#define HYBMSS_DECLARE_KERNELS(set)                                                                                    \
    namespace set {                                                                                                    \
    extern const LatticeKernels<float> kLatticeFloat;                                                                  \
    extern const LatticeKernels<double> kLatticeDouble;                                                                \
    extern const LatticeHessianKernels<float> kLatticeHessianFloat;                                                    \
    extern const LatticeHessianKernels<double> kLatticeHessianDouble;                                                  \
    extern const PackedHessianKernels<float> kPackedHessianFloat;                                                      \
    extern const PackedHessianKernels<double> kPackedHessianDouble;                                                    \
    extern const RunHessianKernels<float> kRunsHessianFloat;                                                           \
    extern const RunHessianKernels<double> kRunsHessianDouble;                                                         \
    extern const SoaHessianKernels<float> kSoaHessianFloat;                                                            \
    extern const SoaHessianKernels<double> kSoaHessianDouble;                                                          \
    extern const LatticeKernels<float> kActiveFloat;                                                                   \
    extern const LatticeKernels<double> kActiveDouble;                                                                 \
    extern const SoaKernels<float> kSoaFloat;                                                                          \
    extern const SoaKernels<double> kSoaDouble;                                                                        \
    extern const PackedKernels<float> kPackedFloat;                                                                    \
    extern const PackedKernels<double> kPackedDouble;                                                                  \
    extern const RunKernels<float> kRunsFloat;                                                                         \
    extern const RunKernels<double> kRunsDouble;                                                                       \
    extern const LatticeEffectKernels<float> kLatticeEffectsFloat;                                                     \
    extern const LatticeEffectKernels<double> kLatticeEffectsDouble;                                                   \
    extern const NetworkEffectKernels<float> kNetworkEffectsFloat;                                                     \
    extern const NetworkEffectKernels<double> kNetworkEffectsDouble;                                                   \
    }

HYBMSS_DECLARE_KERNELS(sse2)
HYBMSS_DECLARE_KERNELS(avx2)
HYBMSS_DECLARE_KERNELS(avx512)
HYBMSS_DECLARE_KERNELS(neon)

#undef HYBMSS_DECLARE_KERNELS

} // namespace hybmss::kernels
