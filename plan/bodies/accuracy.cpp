#include "hybmss/accuracy.hpp"

#include "layouts/messages.hpp"

#include <limits>

namespace hybmss {
namespace {

// Fastest first. Double takes twice the time of float at any level, so its `fast` is never the fastest that will do.
constexpr KernelLevel kLevels[] = {{Precision::float32, Accuracy::fast},
                                   {Precision::float32, Accuracy::accurate},
                                   {Precision::float64, Accuracy::accurate}};

} // namespace

double force_error_bound(Accuracy accuracy, Precision precision) {
    // The estimates' own bounds, root's and quotient's: 1.5 * 2^-12 each with SSE2 and AVX2, which have none in double;
    // 2^-14 each with AVX-512.
    constexpr double kFloatEstimates = 0x1p-10, kDoubleEstimates = 0x1p-13;
    // Rounded constants and some 30 additions a node; see `hybmss verify`.
    constexpr double kRoundings = 5;
    const bool single = precision == Precision::float32;
    const double rounding = kRoundings * (single ? static_cast<double>(std::numeric_limits<float>::epsilon())
                                                 : std::numeric_limits<double>::epsilon());
    return accuracy == Accuracy::fast ? (single ? kFloatEstimates : kDoubleEstimates) : rounding;
}

KernelLevel fastest_level(double force_error) {
    for (const KernelLevel& level : kLevels) {
        if (force_error_bound(level.accuracy, level.precision) <= force_error) {
            return level;
        }
    }
    refuse_value("force_error", force_error,
                 printed("at least %g, which double reaches", force_error_bound(Accuracy::exact, Precision::float64)));
}

} // namespace hybmss
