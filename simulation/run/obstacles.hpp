#pragma once

/// \file
/// A scene's obstacles made concrete for one body.

#include "hybmss/contact.hpp"
#include "hybmss/simulation/scene.hpp"
#include "simulation/run/boundary_conditions.hpp"

#include <span>
#include <vector>

namespace hybmss {

class Obstacles {
public:
    /// `body_time_step`: the body's own critical one, s. Throws SceneError where the method or an obstacle's size does
    /// not allow contact.
    Obstacles(const Scene& scene, double body_time_step);

    bool empty() const { return obstacles_.empty(); }
    /// As at time 0, with stiffnesses above 0.
    std::span<const Obstacle> at_start() const { return obstacles_; }
    /// When the last motion has come to its end, s: never, where one has a constant velocity.
    double end_of_motion() const { return end_of_motion_; }
    /// Velocities are from now on those that lead to where they are a step later.
    void set_time_step(double time_step) { time_step_ = time_step; }
    /// Where they are at a time. Valid until the next call.
    std::span<const RigidPose> at(double time);
    /// The angles by which they have turned at the time of the last at(), rad, as vectors along their axes.
    std::span<const Vector3> angles() const { return angles_; }
    std::span<const RigidPose> poses() const { return poses_; }

    /// m: a cell, or half the way to the middle of the obstacle, where nodes are stopped.
    double greatest_good_depth(std::size_t obstacle) const;

private:
    std::vector<SceneObstacle> entries_;
    double cell_size_;
    std::vector<Obstacle> obstacles_;
    std::vector<RigidPose> poses_;
    std::vector<Vector3> angles_;
    double end_of_motion_ = 0;
    double time_step_ = 0;
};

} // namespace hybmss
