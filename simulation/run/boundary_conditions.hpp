#pragma once

/// \file
/// The nodes that a scene fixes, moves and loads, its obstacles, and how what it moves travels.

#include "hybmss/contact.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/simulation/scene.hpp"
#include "simulation/scene/scene_body.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
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

/// By how much nodes begin away from rest, where the body's place turns it: one a node. Else none at all. Throws
/// SceneError for a static scene.
std::vector<Vector3> initial_displacements(const Scene& scene, std::span<const Vector3> rest);

/// The point of a body at rest that begins at x, m.
Vector3 at_rest(const SceneBody& body, const Vector3& x);

/// rest + displacements, or `rest` where there are none.
std::vector<Vector3> positions(std::span<const Vector3> rest, std::span<const Vector3> displacements);

/// How many of some nodes are held, and how many of these by a fix or move that holds other nodes too but not all of
/// them.
struct SharedSupports {
    std::size_t held = 0, shared = 0;
    std::string by; ///< where the latter are, as the scene has it, with commas between
};

/// The region at `path` as the scene's text has it; of a scene without text the path.
std::string where_text(const Scene& scene, const std::string& path);

/// Which axes of which nodes are held, and how they move.
class Supports {
public:
    /// `turned`: initial_displacements(). Throws SceneError where a region is empty, or where two entries ask different
    /// things of one axis of one node.
    Supports(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> turned = {});

    /// When the last motion has come to its end, s; 0 without any.
    double end_of_motion() const { return end_of_motion_; }

    /// The held nodes' state at `time`, ascending by node; each appears once. Valid until the next call.
    std::span<const PrescribedNode> at(double time);
    /// The held nodes when the part `fraction` of every way is done, without velocity. Valid until the next call.
    std::span<const PrescribedNode> at_part(double fraction);
    /// Accelerations at the time of the last at(), entry by entry.
    std::span<const Vector3> accelerations() const { return accelerations_; }
    std::span<const PrescribedNode> present() const { return present_; }

    /// Who holds each axis of a node: move m as m, fix f as -1 - f, or nobody.
    struct Held {
        static constexpr int kFree = std::numeric_limits<int>::min();
        std::array<int, 3> by = {kFree, kFree, kFree};
    };
    /// The region of one of those in the scene: "fix[0].where".
    static std::string path_of(int by);
    /// Of the held nodes, entry by entry.
    std::span<const Held> holders() const { return held_; }
    /// `nodes` ascend.
    SharedSupports shared(const Scene& scene, std::span<const Vector3> rest,
                          std::span<const std::uint32_t> nodes) const;

    std::size_t fixed_node_count() const { return fixed_node_count_; }
    std::size_t moved_node_count() const { return moved_node_count_; }

private:
    /// Sets every held axis of every node to kinematics(move, rest position, center).
    template <class KinematicsOf>
    std::span<const PrescribedNode> set(const KinematicsOf& kinematics);

    std::vector<Move> moves_;
    std::vector<Vector3> centers_;
    std::vector<Held> held_;
    std::vector<Vector3> held_rest_;   ///< where motions begin
    std::vector<Vector3> held_turned_; ///< by how much that is from rest
    std::vector<PrescribedNode> present_;
    std::vector<Vector3> accelerations_;
    double end_of_motion_ = 0;
    std::size_t fixed_node_count_ = 0, moved_node_count_ = 0;
};

/// The nodes of a scene's region. Throws SceneError at `path` where there is none.
std::vector<std::uint32_t> nodes_of(const Scene& scene, std::span<const Vector3> rest, const Region& region,
                                    const std::string& path);

/// The nodes of a [[load]], and the share of each: by how many cells, by their fills, touch it; or the area (m^2), mass
/// (kg) or volume (m^3) that it carries.
struct LoadedNodes {
    std::vector<std::uint32_t> nodes;
    std::vector<double> shares;
    double sum = 0; ///< of the shares; 1 where these are of something
    /// Of a moment M besides: where nodes are from the middle, m, and the inverse of their inertia: they are loaded by
    /// share (inverse M) x arm.
    std::vector<Vector3> arms = {};
    std::array<Vector3, 3> inverse_inertia = {};
};

/// Of every [[load]]. Throws SceneError where a region is empty. `network`: of a body that is one; its nodes have
/// shares by their masses, or by the lattice's cells where these are at `corners`.
std::vector<LoadedNodes> loaded_nodes(const Scene& scene, const Lattice& lattice, std::span<const Vector3> rest,
                                      const Network* network = nullptr,
                                      std::span<const std::array<std::uint32_t, 8>> corners = {});

/// The faces that [[pressure]]s press: one that several do as often.
struct PressedFaces {
    std::vector<SurfaceFace> faces;
    std::vector<std::uint32_t> by; ///< which [[pressure]], one a face

    /// Pa, one a face, at a time.
    std::vector<double> at(const Scene& scene, double time) const;
    bool changing(const Scene& scene) const;
};
/// Throws SceneError where a region holds no face, and where `static` or backward Euler could not take the surface with
/// these supports.
PressedFaces pressed_faces(const Scene& scene, const Lattice& lattice, const Supports& supports);

/// The cells of all [[actuate]].
struct ActuatedCells {
    std::vector<std::uint32_t> cells; ///< in the grid
    std::vector<std::uint32_t> by;    ///< which [[actuate]], one a cell

    /// One a cell, at a time; `part`: of the way there from the size that they were made with.
    std::vector<RestStretch> at(const Scene& scene, double time, double part = 1) const;
    bool changing(const Scene& scene) const;
};
/// Throws SceneError where one has no cell, and where a cell is in two.
ActuatedCells actuated_cells(const Scene& scene, const Lattice& lattice);

/// By how much cells' stiffness by their mass is larger than that of cells as they were made, at most, at any time;
/// >= 1.
double stiffening_by_actuation(const Scene& scene);

/// Sets the sum of all [[load]]s at a time, N, on the nodes that they load; `forces` has one a node.
void set_nodal_loads(const Scene& scene, std::span<const LoadedNodes> loaded, double time, std::span<Vector3> forces);
/// Of all nodes; nothing at all where the scene has no [[load]].
std::vector<Vector3> nodal_loads(const Scene& scene, std::span<const LoadedNodes> loaded, std::size_t nodes,
                                 double time);

/// The last time of all tables of loads, pressures and gravity, s; -infinity where the scene has none.
double end_of_tables(const Scene& scene);

/// The velocities that [[start]]s give, m/s, one a node, `begin` being where nodes begin. Throws SceneError where a
/// region is empty, and for a node that would begin with another velocity than the one it is held at.
std::vector<Vector3> start_velocities(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> begin,
                                      std::span<const double> masses, const Supports& supports);

/// Springs do not tell a turn from none: where plates turn by more than half a turn against each other, an equilibrium
/// of them may be that of a body that is twisted by a whole turn less, its cells having slipped through each other.
/// Returns "", or what happened. Looks at plates that lie in one layer of nodes across the axis of their rotation, and
/// at what is held fast like them.
std::string lost_turns(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> displacements);

/// The key of [[obstacle]] that gives such a shape.
std::string_view shape_key(const ObstacleShape& shape);

/// A scene's obstacles made concrete for one body.
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
    /// Where they are at a time; of an equilibrium, at a part of the load steps. Valid until the next call.
    std::span<const RigidPose> at(double time);
    /// The angles by which they have turned at the time of the last at(), rad, as vectors along their axes.
    std::span<const Vector3> angles() const { return angles_; }
    std::span<const RigidPose> poses() const { return poses_; }

    /// Load steps of an equilibrium in which none is led by more than two cells: what comes to touch at once is found
    /// at once.
    double steps_to_press() const;
    /// m: a cell, or half the way to the middle of the obstacle, where nodes are stopped.
    double greatest_good_depth(std::size_t obstacle) const;

private:
    std::vector<SceneObstacle> entries_;
    double cell_size_, extent_; ///< m: of a cell; the body's longest edge
    bool is_static_;
    std::vector<Obstacle> obstacles_;
    std::vector<RigidPose> poses_;
    std::vector<Vector3> angles_;
    double end_of_motion_ = 0;
    double time_step_ = 0;
};

} // namespace hybmss
