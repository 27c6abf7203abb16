#include "simulation/run/clamped_edge.hpp"

#include <cmath>
#include <numbers>

namespace hybmss {

double clamped_edge_exponent(double nu) {
    const auto excess = [nu](double lambda) {
        const double s = std::sin(lambda * std::numbers::pi / 2);
        return (3 - 4 * nu) * s * s - 4 * (1 - nu) * (1 - nu) + lambda * lambda;
    };
    double low = 0.3, high = 1; // negative at 0.3; at 1 it is nu's 4 nu - 4 nu^2 >= 0, or there is no singularity
    if (excess(high) <= 0) {
        return 1;
    }
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (excess(middle) < 0 ? low : high) = middle;
    }
    return low;
}

} // namespace hybmss
