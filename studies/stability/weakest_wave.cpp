#include "studies/stability/stability_map.hpp"

#include "reference/homogeneous_lattice.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>

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

namespace {

using reference::HomogeneousLattice;
using reference::Matrix3d;
using reference::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr int kWavesPerAxis = 10; // a wave vector each pi/10: finer grids find the same waves, refined as they are
constexpr double kPhaseTolerance = 1e-4;

double least(const Matrix3d& symmetric) {
    return Eigen::SelfAdjointEigenSolver<Matrix3d>().computeDirect(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// The direct formula above loses digits where eigenvalues are close; the result proper is iterated.
double accurate_least(const Matrix3d& symmetric) {
    return Eigen::SelfAdjointEigenSolver<Matrix3d>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// sum_e 4 sin^2(q_e h / 2)
double grid_eigenvalue(const Vector3d& phase) {
    return 4 * (phase / 2).array().sin().square().sum();
}

struct Found {
    Vector3d at;
    double value;
};

/// Steps along the axes while they go down, then halves the step. The box [0, upper]^n holds the search.
template <class Function>
Found descend(const Function& function, Found start, double step, const Vector3d& upper) {
    for (; step > kPhaseTolerance; step /= 2) {
        for (bool better = true; better;) {
            better = false;
            for (int axis = 0; axis < 3; ++axis) {
                for (const double sign : {-1.0, 1.0}) {
                    Vector3d next = start.at;
                    next[axis] = std::clamp(next[axis] + sign * step, 0.0, upper[axis]);
                    const double value = next == start.at ? start.value : function(next);
                    if (value < start.value) {
                        start = {next, value};
                        better = true;
                    }
                }
            }
        }
    }
    return start;
}

/// The least of `function` over the grid of wave vectors of one octant without its origin, refined.
template <class Function>
Found least_wave(const Function& function) {
    Found best{Vector3d::Zero(), HUGE_VAL};
    for (int k = 0; k <= kWavesPerAxis; ++k) {
        for (int j = 0; j <= kWavesPerAxis; ++j) {
            for (int i = 0; i <= kWavesPerAxis; ++i) {
                if (i + j + k > 0) {
                    const Vector3d phase = kPi / kWavesPerAxis * Vector3d(i, j, k);
                    const double value = function(phase);
                    if (value < best.value) {
                        best = {phase, value};
                    }
                }
            }
        }
    }
    return descend(function, best, kPi / kWavesPerAxis / 2, Vector3d::Constant(kPi));
}

Vector3d direction(const Vector3d& angles) {
    return {std::sin(angles[0]) * std::cos(angles[1]), std::cos(angles[0]), std::sin(angles[0]) * std::sin(angles[1])};
}

/// The same over the directions of long waves: the angle from y and the one about it.
template <class Function>
Found least_direction(const Function& function) {
    const Vector3d upper(kPi / 2, kPi / 2, 0);
    Found best{Vector3d::Zero(), HUGE_VAL};
    for (int j = 0; j <= kWavesPerAxis; ++j) {
        for (int i = 0; i <= kWavesPerAxis; ++i) {
            const Vector3d angles = kPi / 2 / kWavesPerAxis * Vector3d(i, j, 0);
            const double value = function(angles);
            if (value < best.value) {
                best = {angles, value};
            }
        }
    }
    return descend(function, best, kPi / kWavesPerAxis / 4, upper);
}

} // namespace

Wave weakest_wave(const HomogeneousLattice& lattice, double shear_modulus) {
    const auto relative = [&](const Vector3d& phase) {
        // Near the origin the quotient is that of two zeros; the long waves stand for it.
        const double grid = grid_eigenvalue(phase);
        return grid > 1e-6 ? least(lattice.wave_stiffness(phase)) / (shear_modulus * grid) : HUGE_VAL;
    };
    const Found wave = least_wave(relative);
    const Found longest = least_direction(
        [&](const Vector3d& angles) { return least(lattice.acoustic_tensor(direction(angles))) / shear_modulus; });
    const double of_wave = accurate_least(lattice.wave_stiffness(wave.at)) / (shear_modulus * grid_eigenvalue(wave.at));
    const double of_longest = accurate_least(lattice.acoustic_tensor(direction(longest.at))) / shear_modulus;
    // Short waves of the same stiffness as the long ones are common (along an axis, under dilation): call those long.
    if (of_longest <= of_wave + 1e-6) {
        return {of_longest, direction(longest.at), true};
    }
    return {of_wave, wave.at, false};
}

} // namespace hybmss::stability
