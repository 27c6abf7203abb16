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

/// What has to be different in a kernel's functions for `exact`, where all sets give the same bits: nothing, since they
/// do anyhow, or nobody was told that they would (solvers' second derivatives); that no products are fused with sums;
/// or the order of sums too.
enum class MadeAlike { not_at_all, by_rounding, by_order };

/// Whether a choice is one of second derivatives, of which no steps, forces or energies are made.
template <class Choice>
constexpr bool is_tangent(Choice) {
    return false;
}
constexpr bool is_tangent(SpringLaw law) {
    return law != SpringLaw::damping && law != SpringLaw::stiffening;
}
constexpr bool is_tangent(LatticeSum sum) {
    return is_tangent(sum.law);
}

/// Whether a choice is of the table for `exact`, or of the other one.
template <class Choice>
constexpr bool is_of_table(Choice, bool) {
    return true;
}
constexpr bool is_of_table(Accuracy accuracy, bool exact) {
    return (accuracy == Accuracy::exact) == exact;
}

template <class V, bool exact, MadeAlike made_alike, auto... choice>
using VectorFor = std::conditional_t<exact && !(is_tangent(choice) || ...) &&
                                         (made_alike == MadeAlike::by_order ||
                                          (made_alike == MadeAlike::by_rounding && Traits<V>::kFuses)),
                                     Batch<Scalar<V>, Alike<typename Traits<V>::Arch>>, V>;

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
    extern const listed::name<float> name##_float, name##_exact_float;                                                 \
    extern const listed::name<double> name##_double, name##_exact_double;
#include "kernels/kernels.inc"
#undef HYBMSS_KERNEL
} // namespace HYBMSS_KERNEL_SET

#define HYBMSS_VARIANTS(name, V, exact, made_alike)                                                                    \
    []<auto... choice>() {                                                                                             \
        if constexpr ((is_of_table(choice, exact) && ...)) {                                                           \
            using Vector = VectorFor<V, exact, MadeAlike::made_alike, choice...>;                                      \
            return name<compiled<Vector>(choice)..., Vector>;                                                          \
        } else {                                                                                                       \
            return nullptr;                                                                                            \
        }                                                                                                              \
    }
#define HYBMSS_DEFINE_KERNEL_MADE_ALIKE(name, made_alike)                                                              \
    constinit const listed::name<float> HYBMSS_KERNEL_SET::name##_float{                                               \
        HYBMSS_VARIANTS(name, FloatBatch, false, made_alike)};                                                         \
    constinit const listed::name<float> HYBMSS_KERNEL_SET::name##_exact_float{                                         \
        HYBMSS_VARIANTS(name, FloatBatch, true, made_alike)};                                                          \
    constinit const listed::name<double> HYBMSS_KERNEL_SET::name##_double{                                             \
        HYBMSS_VARIANTS(name, DoubleBatch, false, made_alike)};                                                        \
    constinit const listed::name<double> HYBMSS_KERNEL_SET::name##_exact_double {                                      \
        HYBMSS_VARIANTS(name, DoubleBatch, true, made_alike)                                                           \
    }

/// The listed kernel `name` is the function template name<values of its axes..., vector type> in the anonymous
/// namespace above. At `exact` it is compiled for vectors that fuse nothing.
#define HYBMSS_DEFINE_KERNEL(name) HYBMSS_DEFINE_KERNEL_MADE_ALIKE(name, by_rounding)
/// A kernel that makes sums over the lanes, or in which two lanes may add to one node.
#define HYBMSS_DEFINE_ORDERED_KERNEL(name) HYBMSS_DEFINE_KERNEL_MADE_ALIKE(name, by_order)
/// A kernel that is one function at all levels.
#define HYBMSS_DEFINE_COMMON_KERNEL(name) HYBMSS_DEFINE_KERNEL_MADE_ALIKE(name, not_at_all)

} // namespace hybmss::kernels
