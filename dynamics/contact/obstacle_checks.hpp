#pragma once

/// \file
/// What is refused of an obstacle, in one line that names it by its number. All throw std::invalid_argument.

#include "hybmss/contact.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace hybmss {

template <std::size_t N>
bool is_finite(const std::array<double, N>& values) {
    for (const double v : values) {
        if (!std::isfinite(v)) {
            return false;
        }
    }
    return true;
}

[[noreturn]] void refuse_obstacle(std::size_t obstacle, const std::string& what);

/// A pose must be finite, and its rotation one.
void require_rigid(const RigidPose& pose, std::size_t obstacle);

/// The shape with a normal of unit length.
ObstacleShape checked(const ObstacleShape& shape, std::size_t obstacle);

} // namespace hybmss
