#pragma once

// For the files *_kernels.cpp, each compiled once for every instruction set: HYBMSS_KERNEL_SET names the set,
// kernels/CMakeLists.txt gives its flags.

#include "kernels/kernel_table.hpp"
#include "kernels/spring_law.hpp"

namespace hybmss::kernels {
namespace {

namespace architecture {
#define HYBMSS_INSTRUCTION_SET(name, type, ...) using name = type;
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
} // namespace architecture

using FloatBatch = Batch<float, architecture::HYBMSS_KERNEL_SET>;
using DoubleBatch = Batch<double, architecture::HYBMSS_KERNEL_SET>;

/// A choice as a kernel gets to see it. Levels of accuracy that come to the same operations (spring_law.hpp) are one
/// function.
template <class V, class Choice>
constexpr Choice compiled(Choice choice) {
    return choice;
}
template <class V>
constexpr Accuracy compiled(Accuracy accuracy) {
    return distinct_level<V>(accuracy);
}

} // namespace

namespace HYBMSS_KERNEL_SET {
#define HYBMSS_KERNEL(name, ...)                                                                                       \
    extern const listed::name<float> name##_float;                                                                     \
    extern const listed::name<double> name##_double;
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
} // namespace HYBMSS_KERNEL_SET

#define HYBMSS_VARIANTS(name, V)                                                                                       \
    []<auto... choice>() {                                                                                             \
        return name<compiled<V>(choice)..., V>;                                                                        \
    }

/// The listed kernel `name` is the function template name<values of its axes..., vector type> in the anonymous
/// namespace above.
#define HYBMSS_DEFINE_KERNEL(name)                                                                                     \
    constinit const listed::name<float> HYBMSS_KERNEL_SET::name##_float{HYBMSS_VARIANTS(name, FloatBatch)};            \
    constinit const listed::name<double> HYBMSS_KERNEL_SET::name##_double {                                            \
        HYBMSS_VARIANTS(name, DoubleBatch)                                                                             \
    }

} // namespace hybmss::kernels
