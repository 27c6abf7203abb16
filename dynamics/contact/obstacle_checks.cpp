#include "dynamics/contact/obstacle_checks.hpp"

#include "dynamics/contact/obstacle_distance.hpp"

#include <stdexcept>

namespace hybmss {

void refuse_obstacle(std::size_t obstacle, const std::string& what) {
    throw std::invalid_argument("obstacle " + std::to_string(obstacle) + ": " + what);
}

void require_rigid(const RigidPose& pose, std::size_t obstacle) {
    if (!is_finite(pose.position) || !is_finite(pose.rotation) || !is_finite(pose.velocity) ||
        !is_finite(pose.angular_velocity)) {
        refuse_obstacle(obstacle, "its pose is not finite");
    }
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
            double product = a == b ? -1 : 0;
            for (std::size_t c = 0; c < 3; ++c) {
                product += pose.rotation[3 * a + c] * pose.rotation[3 * b + c];
            }
            if (std::abs(product) > 1e-9) {
                refuse_obstacle(obstacle, "its rotation must be a matrix of three orthonormal rows");
            }
        }
    }
}

ObstacleShape checked(const ObstacleShape& shape, std::size_t obstacle) {
    if (const auto* plane = std::get_if<PlaneShape>(&shape)) {
        const Point& n = plane->normal;
        const double size = std::hypot(n[0], n[1], n[2]);
        if (!std::isfinite(size) || !(size > 0)) {
            refuse_obstacle(obstacle, "the normal of its plane must be finite and not zero");
        }
        return PlaneShape{{n[0] / size, n[1] / size, n[2] / size}};
    }
    if (const auto* sphere = std::get_if<SphereShape>(&shape);
        sphere && (!std::isfinite(sphere->radius) || !(sphere->radius > 0))) {
        refuse_obstacle(obstacle,
                        "radius = " + std::to_string(sphere->radius) + " is not allowed: it must be finite and > 0");
    }
    if (const auto* box = std::get_if<BoxShape>(&shape)) {
        for (const double size : box->size) {
            if (!std::isfinite(size) || !(size > 0)) {
                refuse_obstacle(obstacle,
                                "size = " + std::to_string(size) + " is not allowed: it must be finite and > 0");
            }
        }
    }
    return shape;
}

} // namespace hybmss
