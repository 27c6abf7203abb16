#pragma once

/// \file
/// The nodes that a scene fixes, moves and loads, and how what it moves travels.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/simulation/scene.hpp"
#include "simulation/scene/scene_body.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

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

/// The state at `time` of the node at `rest`; rotations turn about the axis through `center`.
Kinematics moved(const Move& move, const Vector3& rest, const Vector3& center, double time);

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

/// The sum of all [[load]]s on each node, N; nothing at all where the scene has none. Throws SceneError where a region
/// is empty.
std::vector<Vector3> nodal_loads(const Scene& scene, const Lattice& lattice, std::span<const Vector3> rest);

/// Springs do not tell a turn from none: where plates turn by more than half a turn against each other, an equilibrium
/// of them may be that of a body that is twisted by a whole turn less, its cells having slipped through each other.
/// Returns "", or what happened. Looks at plates that lie in one layer of nodes across the axis of their rotation, and
/// at what is held fast like them.
std::string lost_turns(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> displacements);

} // namespace hybmss
