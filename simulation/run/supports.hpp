#pragma once

/// \file
/// The nodes that fixes and moves hold, merged to one entry a node.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/simulation/scene.hpp"
#include "simulation/run/motion.hpp"
#include "simulation/scene/scene_body.hpp"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace hybmss {

/// Which axes of which nodes are held, and how they move.
class Supports {
public:
    /// Throws SceneError where a region is empty, or where two entries ask different things of one axis of one node.
    Supports(const Scene& scene, std::span<const Vector3> rest);

    /// When the last motion has come to its end, s; 0 without any.
    double end_of_motion() const { return end_of_motion_; }

    /// The held nodes' state at `time`, ascending by node; each appears once. Valid until the next call.
    std::span<const PrescribedNode> at(double time);
    /// The held nodes when the part `fraction` of every way is done, without velocity. Valid until the next call.
    std::span<const PrescribedNode> at_part(double fraction);
    /// Accelerations at the time of the last at(), entry by entry.
    std::span<const Vector3> accelerations() const { return accelerations_; }
    std::span<const PrescribedNode> present() const { return present_; }

    std::size_t fixed_node_count() const { return fixed_node_count_; }
    std::size_t moved_node_count() const { return moved_node_count_; }

private:
    /// Sets every held axis of every node to kinematics(move, rest position, center).
    template <class KinematicsOf>
    std::span<const PrescribedNode> set(const KinematicsOf& kinematics);

    /// Who holds each axis: move m as m, fix f as -1 - f, or nobody.
    struct Held {
        static constexpr int kFree = std::numeric_limits<int>::min();
        std::array<int, 3> by = {kFree, kFree, kFree};
    };

    std::vector<Move> moves_;
    std::vector<Vector3> centers_;
    std::vector<Held> held_;
    std::vector<Vector3> held_rest_;
    std::vector<PrescribedNode> present_;
    std::vector<Vector3> accelerations_;
    double end_of_motion_ = 0;
    std::size_t fixed_node_count_ = 0, moved_node_count_ = 0;
};

/// The nodes of a scene's region. Throws SceneError at `path` where there is none.
std::vector<std::uint32_t> nodes_of(const Scene& scene, std::span<const Vector3> rest, const Region& region,
                                    const std::string& path);

} // namespace hybmss
