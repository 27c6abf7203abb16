#include "simulation/run/motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hybmss {
namespace {

Kinematics translated(const Vector3& translation, const Ramp& s) {
    Kinematics k;
    for (std::size_t a = 0; a < 3; ++a) {
        k.displacement[a] = s.value * translation[a];
        k.velocity[a] = s.rate * translation[a];
        k.acceleration[a] = s.acceleration * translation[a];
    }
    return k;
}

/// With p the part of rest - center at right angles to the unit axis n, q = n x p and the angle phi:
///   u = (cos phi - 1) p + sin phi q;   r = cos phi p + sin phi q;   v = phi' n x r;   a = phi'' n x r - phi'^2 r
/// cos phi - 1 = -2 sin^2(phi / 2) keeps all digits at small angles.
Kinematics rotated(const Rotation& rotation, const Vector3& rest, const Vector3& center, const Ramp& s) {
    const double whole = rotation.degrees * std::numbers::pi / 180;
    const double phi = s.value * whole, rate = s.rate * whole, acceleration = s.acceleration * whole;
    const double sine = std::sin(phi), half = std::sin(phi / 2), cosine_minus_one = -2 * half * half;
    // Axes in cyclic order after the rotation's own: n x e_i = e_j, n x e_j = -e_i.
    const auto i = static_cast<std::size_t>((rotation.axis + 1) % 3),
               j = static_cast<std::size_t>((rotation.axis + 2) % 3);
    const double p[2] = {rest[i] - center[i], rest[j] - center[j]};
    const double u[2] = {cosine_minus_one * p[0] - sine * p[1], cosine_minus_one * p[1] + sine * p[0]};
    const double r[2] = {p[0] + u[0], p[1] + u[1]};
    Kinematics k;
    k.displacement[i] = u[0];
    k.displacement[j] = u[1];
    k.velocity[i] = -rate * r[1];
    k.velocity[j] = rate * r[0];
    k.acceleration[i] = -acceleration * r[1] - rate * rate * r[0];
    k.acceleration[j] = acceleration * r[0] - rate * rate * r[1];
    return k;
}

} // namespace

Ramp ramp(double time, double over) {
    if (time >= over) {
        return {1, 0, 0};
    }
    const double r = std::max(time / over, 0.0);
    return {r * r * r * (10 + r * (-15 + 6 * r)), 30 * r * r * (1 - r) * (1 - r) / over,
            60 * r * (1 - r) * (1 - 2 * r) / over / over}; // a tiny square would be 0
}

namespace {

Kinematics moved_along(const Move& move, const Vector3& rest, const Vector3& center, const Ramp& s) {
    if (const Rotation* rotation = std::get_if<Rotation>(&move.motion)) {
        return rotated(*rotation, rest, center, s);
    }
    return translated(std::get<Vector3>(move.motion), s);
}

} // namespace

Kinematics moved(const Move& move, const Vector3& rest, const Vector3& center, double time) {
    return moved_along(move, rest, center, ramp(time, move.over));
}

Vector3 moved_part(const Move& move, const Vector3& rest, const Vector3& center, double fraction) {
    return moved_along(move, rest, center, {fraction, 0, 0}).displacement;
}

} // namespace hybmss
