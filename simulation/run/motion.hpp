#pragma once

/// \file
/// How a moved node travels from rest to its final position.

#include "hybmss/simulation/scene.hpp"

#include <array>

namespace hybmss {

using Vector3 = std::array<double, 3>;

/// A smooth step from 0 to 1 with its first two derivatives in time.
struct Ramp {
    double value = 0;
    double rate = 0;         ///< 1/s
    double acceleration = 0; ///< 1/s^2
};

/// s = 10 r^3 - 15 r^4 + 6 r^5, r = t / over held in [0, 1]: velocity and acceleration begin and end at zero, so that
/// the plate sends no shock through the body. `over` = 0 is a jump without velocity.
Ramp ramp(double time, double over);

/// What a node does at one moment.
struct Kinematics {
    Vector3 displacement = {0, 0, 0};
    Vector3 velocity = {0, 0, 0};
    Vector3 acceleration = {0, 0, 0};
};

/// Where a node stands when the part `fraction` of the way is done: of the translation, or of the angle.
Vector3 moved_part(const Move& move, const Vector3& rest, const Vector3& center, double fraction);

/// The state at `time` of the node at `rest`; rotations turn about the axis through `center`.
Kinematics moved(const Move& move, const Vector3& rest, const Vector3& center, double time);

} // namespace hybmss
