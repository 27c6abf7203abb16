#pragma once

/// \file
/// A rigid obstacle with mass in a step, and the nodes that touch it: what they push each other by.

#include "dynamics/contact/obstacle_geometry.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// How a free obstacle moves.
struct FreeMotion {
    RigidPose pose;             ///< its velocities those of the momenta
    Point spin = {0, 0, 0};     ///< kg m^2/s, in space: the angular momentum about its centre
    double work_of_gravity = 0; ///< J, since it was set
};

/// A node that may touch a free obstacle in the step at hand.
struct FreeTouch {
    std::size_t node;    ///< of its contact
    double mass;         ///< kg
    Point arm;           ///< m, from the obstacle's centre to the node, where both began the step
    Point normal;        ///< the way out
    Point velocity;      ///< m/s, as seen from the obstacle, if neither pushes
    double depth;        ///< m, at the step's end, likewise; negative outside
    double was;          ///< m, at its beginning
    double slope;        ///< of the depth by the way along the normal
    double stiffness;    ///< 1/s^2
    double gain, acting; ///< s: of velocity by acceleration; that this acts
    double time_step;    ///< s
    double way;          ///< s^2: what an acceleration of 1 takes of the depth, the obstacle at rest
    double stopped;      ///< m: no deeper than that, however soft it is
    double friction;     ///< Coulomb's coefficient
    double follows;      ///< part of a change of the push that friction follows in a step
    double push_before;  ///< m/s^2: what friction went by; 0 at the first touch
    std::uint8_t held;   ///< axes along which it is held, as bits
    // What is found, m/s^2.
    double push = 0, grip = 0; ///< grip: what friction goes by
    Point rubbed = {0, 0, 0};  ///< by friction
    double end_depth = 0;      ///< m
};

/// One step of it. Its velocities at the end are those for which the impulses on the nodes, each found as on an
/// obstacle that is led with them, are what its momenta lose:
///
///     M (V' - V - g dt) = -sum J(V'),    L' - L = -sum r x J(V')
///
/// by Newton's iteration in these six. No node comes before another, and an obstacle much lighter than a node is as
/// stable as any. r is where both began the step, so that angular momentum about any point is kept to rounding.
class FreeObstacle {
public:
    /// `acting`, s, and `gravity`, m/s^2: of the kick that the step begins with.
    FreeObstacle(const Obstacle& obstacle, const FreeMotion& before, double time_step, double acting,
                 const Point& gravity);

    /// Where it ends the step if no node touches it, with its velocities.
    const RigidPose& unpushed() const { return unpushed_; }
    const RigidPose& before() const { return before_.pose; }

    /// Finds what all touches do.
    void solve(std::span<FreeTouch> touches);
    /// m/s, of its point at the arm, after solve(): the mean of before and after the step.
    Point mean_velocity(const Point& arm) const;
    /// m/s, that it has gained in the step at most.
    double faster() const;
    /// After solve().
    FreeMotion after() const;

private:
    /// m/s and rad/s: of the velocities, by what nodes do.
    struct Change {
        Point velocity = {0, 0, 0}, turn = {0, 0, 0};
    };
    Point turned_by(const Point& spin) const; ///< rad/s
    Point spin_of(const Point& turn) const;
    /// Sets what is found of a touch; returns the derivatives of its acceleration by the obstacle's velocity there, row
    /// by row.
    static Matrix respond(FreeTouch& touch, const Change& change);

    const Obstacle& obstacle_;
    FreeMotion before_;
    double time_step_;
    Point weight_impulse_; ///< N s
    RigidPose unpushed_;
    Change change_;
};

/// After a force and a torque (N and N m) in `seconds`, where it is.
FreeMotion kicked(const Obstacle& obstacle, FreeMotion motion, double seconds, const Point& force, const Point& torque);

/// kg m^2: of a full shape of this mass about the obstacle's axes. `number`: of the obstacle, for what it throws,
/// std::invalid_argument, where these are not principal axes through the centre of mass.
Point inertia_of(const ObstacleShape& shape, double mass, std::size_t number);

} // namespace hybmss
