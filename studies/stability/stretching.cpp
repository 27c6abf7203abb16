#include "studies/stability/stretching.hpp"

#include "reference/homogeneous_lattice.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace hybmss::stability {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using reference::HomogeneousLattice;
using reference::Vector3d;

constexpr double kLargestStep = 0.01, kSmallestStep = 1e-6; // of the stretch
constexpr double kDifference = 1e-6; // of the stress, for its derivatives: only a Newton step depends on it
constexpr double kSmallestStretch = 0.01, kFarthestStep = 0.02;

/// The stresses along x and z at the side stretches (x, z).
Vector2d side_stress(const Material& material, double stretch, const Vector2d& sides) {
    const reference::Matrix3d p =
        HomogeneousLattice(material, Vector3d(sides[0], stretch, sides[1]).asDiagonal()).stress();
    return {p(0, 0), p(2, 2)};
}

/// Newton's method from a prediction of the sides. Empty where it does not arrive, or at no minimum.
std::optional<Vector2d> relaxed_sides(const Material& material, double stretch, Vector2d sides) {
    for (int iteration = 0; iteration < 30; ++iteration) {
        Matrix2d stiffness;
        for (int axis = 0; axis < 2; ++axis) {
            const Vector2d change = kDifference * Vector2d::Unit(axis);
            stiffness.col(axis) =
                (side_stress(material, stretch, sides + change) - side_stress(material, stretch, sides - change)) /
                (2 * kDifference);
        }
        const Vector2d step = stiffness.inverse() * side_stress(material, stretch, sides);
        if (!(step.cwiseAbs().maxCoeff() < kFarthestStep)) { // off to another branch, or not a number
            return std::nullopt;
        }
        sides -= step;
        if (!(sides.minCoeff() > kSmallestStretch)) {
            return std::nullopt;
        }
        if (step.cwiseAbs().maxCoeff() < 1e-10) {
            // Positive definite: a minimum over both sides, also against one that widens while the other narrows.
            const bool minimum = stiffness(0, 0) > 0 && stiffness.determinant() > 0;
            return minimum ? std::optional(sides) : std::nullopt;
        }
    }
    return std::nullopt;
}

} // namespace

std::string_view name(Stretching stretching) {
    switch (stretching) {
    case Stretching::bar:
        return "bar";
    case Stretching::confined:
        return "confined";
    default:
        return "dilation";
    }
}

std::optional<Vector3d> stretches(const Material& material, Stretching stretching, double stretch) {
    if (stretching == Stretching::confined) {
        return Vector3d(1, stretch, 1);
    }
    if (stretching == Stretching::dilation) {
        return Vector3d(stretch, stretch, stretch);
    }
    Vector2d sides(1, 1);
    double now = 1, step = kLargestStep;
    while (now != stretch) {
        const double next = std::abs(stretch - now) <= step ? stretch : now + std::copysign(step, stretch - now);
        // Nearly incompressible sides must follow the volume, or the first step sees a stress that hides the minimum.
        const auto relaxed = relaxed_sides(material, next, sides * std::pow(now / next, material.poisson_ratio));
        if (relaxed) {
            now = next;
            sides = *relaxed;
            step = std::min(2 * step, kLargestStep);
        } else if (step /= 2; step < kSmallestStep) {
            return std::nullopt;
        }
    }
    return Vector3d(sides[0], stretch, sides[1]);
}

} // namespace hybmss::stability
