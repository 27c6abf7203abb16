#include "app/verify/verify_node_array.hpp"

#include <algorithm>
#include <limits>

namespace hybmss::verify {
double max_difference(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b) {
    double worst = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        for (int axis = 0; axis < 3; ++axis) {
            const double difference = std::abs(a[n][axis] - b[n][axis]);
            if (std::isnan(difference)) {
                return std::numeric_limits<double>::quiet_NaN();
            }
            worst = std::max(worst, difference);
        }
    }
    return worst;
}

double max_component(std::span<const Eigen::Vector3d> a) {
    const std::vector<Eigen::Vector3d> zero(a.size(), Eigen::Vector3d::Zero());
    return max_difference(a, zero);
}

} // namespace hybmss::verify
