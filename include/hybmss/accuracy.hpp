#pragma once

/// \file
/// The levels of accuracy of the spring kernels, and the bound of each.

#include "hybmss/export.h"
#include "hybmss/precision.hpp"

#include <string_view>

namespace hybmss {

/// How a kernel computes a spring's factor 1 - l/|d|, least accurate first. At every level the factor's relative error
/// is the same at any strain, and the forces of a spring's two ends sum to zero.
enum class Accuracy {
    fast,     ///< from the instruction set's estimates of 1/sqrt and of 1/x as they come; as `accurate` where there are
              ///< none (double below AVX-512) or poor ones (NEON). The digits differ between makes of CPU
    accurate, ///< to the type's precision, from the estimate refined or from the rounded root, whichever is faster; the
              ///< last bits differ between makes of CPU
    exact     ///< from correctly rounded square root and division, nothing fused: the same bits on every CPU and set
};

/// "fast", "accurate" or "exact".
HYBMSS_EXPORT std::string_view name(Accuracy accuracy);

/// The inverse of name(). Throws std::invalid_argument that lists the known names.
HYBMSS_EXPORT Accuracy parse_accuracy(std::string_view text);

/// The bound of a force's error over the node's force scale (the sum of the magnitudes of the forces that meet there),
/// on every instruction set, where no spring is crushed to less than half: `hybmss verify` holds every kernel to it.
HYBMSS_EXPORT double force_error_bound(Accuracy accuracy, Precision precision);

struct KernelLevel {
    Precision precision;
    Accuracy accuracy;
};

/// The fastest type and level whose bound is at most `force_error`. Throws std::invalid_argument where there is none.
HYBMSS_EXPORT KernelLevel fastest_level(double force_error);

} // namespace hybmss
