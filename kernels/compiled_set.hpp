#pragma once

// What a file *_kernels.cpp is being compiled for: HYBMSS_KERNEL_SET names the set, kernels/CMakeLists.txt gives its
// flags.

#include "kernels/simd.hpp"

namespace hybmss::kernels {
namespace {

namespace architecture {
using sse2 = xsimd::sse2;
using avx2 = xsimd::fma3<xsimd::avx2>;
using avx512 = xsimd::avx512bw;
using neon = xsimd::neon64;
} // namespace architecture

using FloatBatch = Batch<float, architecture::HYBMSS_KERNEL_SET>;
using DoubleBatch = Batch<double, architecture::HYBMSS_KERNEL_SET>;

} // namespace
} // namespace hybmss::kernels
