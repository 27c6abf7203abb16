#pragma once

/// \file
/// Rigid obstacles that a body touches, with Coulomb friction: planes, spheres, boxes, capsules, convex hulls, closed
/// meshes and height fields.

#include "hybmss/export.h"
#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

namespace hybmss {

/// A node that may touch an obstacle: one that is not inside the body.
struct SurfaceNode {
    std::uint32_t node = 0;
    std::array<double, 3> rest_position = {0, 0, 0}; ///< m
};

/// The nodes with fewer than eight cells around them, ascending. `origin`: the low corner of the grid, m. O(cells).
HYBMSS_EXPORT std::vector<SurfaceNode> surface_nodes(const Lattice& lattice,
                                                     const std::array<double, 3>& origin = {0, 0, 0});
/// The nodes that belong to fewer than eight cells, ascending; of a network without cells, all.
HYBMSS_EXPORT std::vector<SurfaceNode> surface_nodes(const Network& network);

/// A point of a body's skin that may touch an obstacle: it goes with eight nodes by their weights, whose sum is 1.
struct SkinPoint {
    std::array<std::uint32_t, 8> nodes = {};
    std::array<double, 8> weights = {};
    std::array<double, 3> rest_position = {0, 0, 0}; ///< m
};

/// The half-space behind a plane through the obstacle's position.
struct PlaneShape {
    std::array<double, 3> normal = {0, 1, 0}; ///< points to where the body is; of any length above 0
    bool operator==(const PlaneShape&) const = default;
};
struct SphereShape {
    double radius = 1; ///< m, > 0
    bool operator==(const SphereShape&) const = default;
};
/// A cuboid about the obstacle's position, its edges along the axes where it is not turned.
struct BoxShape {
    std::array<double, 3> size = {1, 1, 1}; ///< edge lengths, m, > 0
    bool operator==(const BoxShape&) const = default;
};
/// All that is within a radius of a straight line whose middle is the obstacle's position.
struct CapsuleShape {
    std::array<double, 3> axis = {0, 1, 0}; ///< from one end of the line to the other, m; of zero length: a ball
    double radius = 1;                      ///< m, > 0
    bool operator==(const CapsuleShape&) const = default;
};

// Shapes that are made once. Copies share what was made, and may be used by obstacles of many bodies and by several
// threads at once. One without data, as the default constructor leaves it, is refused as an obstacle's.

struct ConvexHull;
struct DistanceField;
struct HeightField;

/// All that is within the convex hull of points. Inside, the way out is that of the nearest face.
struct HYBMSS_EXPORT HullShape {
    HullShape() = default;
    /// m, in the obstacle's axes; what is inside, or a 1e-7th of the extent from a face, makes no face. Throws
    /// std::invalid_argument for points that are not finite or lie in a plane, and for a hull of more than 4096
    /// triangles: each node that is near takes a pass over the faces.
    explicit HullShape(std::span<const std::array<double, 3>> points);
    std::span<const std::array<double, 3>> points() const; ///< those given
    bool operator==(const HullShape& other) const;

    std::shared_ptr<const ConvexHull> hull;
};

/// What a closed mesh of triangles encloses, by its signed distance on a grid of cubes: quadratic B-splines through the
/// grid's nodes, so that forces are continuous, and planes are met exactly. What is smaller than a cell of the grid is
/// lost, and edges are rounded by one. Where two sides are as near, the force becomes less.
struct HYBMSS_EXPORT MeshShape {
    MeshShape() = default;
    /// m, in the obstacle's axes; triangles of vertices' numbers, all of the same turn. Vertices at the very same place
    /// are one. `cells`: of the grid, along the longest side of the mesh's box, 4 to 256. Takes some microseconds and 8
    /// bytes for each node of the grid. Throws std::invalid_argument for what is not finite, for triangles of no area
    /// or of vertices that do not exist, and for a mesh that is not closed: where an edge does not belong to two
    /// triangles of the same turn.
    MeshShape(std::span<const std::array<double, 3>> vertices, std::span<const std::array<std::uint32_t, 3>> triangles,
              int cells = 64);
    std::span<const std::array<double, 3>> vertices() const; ///< those given
    std::span<const std::array<std::uint32_t, 3>> triangles() const;
    int cells() const;
    bool operator==(const MeshShape& other) const;

    std::shared_ptr<const DistanceField> field;
};

/// All that is below heights along the obstacle's y axis, given on a grid in x and z that begins at its position:
/// quadratic B-splines which meet the heights, and planes everywhere. Beyond its border the ground is level, as high as
/// there. Depth is that along y, times the cosine of the field's mean slope.
struct HYBMSS_EXPORT HeightShape {
    HeightShape() = default;
    /// m. `counts`: of heights along x and z, at least 2; `spacing`: m, of the grid along them, > 0; `heights`: m, x
    /// fastest. Throws std::invalid_argument for anything else, and for what is not finite.
    HeightShape(const std::array<std::size_t, 2>& counts, const std::array<double, 2>& spacing,
                std::span<const double> heights);
    std::array<std::size_t, 2> counts() const;
    std::array<double, 2> spacing() const;
    std::span<const double> heights() const; ///< those given
    bool operator==(const HeightShape& other) const;

    std::shared_ptr<const HeightField> field;
};

using ObstacleShape = std::variant<PlaneShape, SphereShape, BoxShape, CapsuleShape, HullShape, MeshShape, HeightShape>;

/// Where a rigid obstacle is and how it moves on.
struct RigidPose {
    std::array<double, 3> position = {0, 0, 0}; ///< m
    /// Row by row: from the obstacle's axes to space. Rows orthonormal to 1e-5, as a quaternion in float gives them,
    /// stand for the rotation nearby.
    std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    std::array<double, 3> velocity = {0, 0, 0};         ///< m/s
    std::array<double, 3> angular_velocity = {0, 0, 0}; ///< rad/s, in space
};

/// 1/s^2, by the body's own critical time step: a sphere pressed into a block by Hertz' law is a hundredth too soft at
/// most, from 1.4 cells in the radius of what touches.
inline double default_contact_stiffness(double critical_time_step) {
    return 16 / (critical_time_step * critical_time_step);
}

/// s, likewise: long enough that nodes do not flutter, short beside a body's own vibrations.
inline double default_friction_delay(double critical_time_step) {
    return 10 * critical_time_step;
}

/// A rigid obstacle. A node of mass m at the depth p below its surface is pushed out by the force m stiffness p; along
/// the surface it sticks, up to the force friction times that, and slips beyond. No stiffness shortens the stable time
/// step: contact is taken implicitly, which takes energy out of what beats against an obstacle.
struct Obstacle {
    ObstacleShape shape = {};
    RigidPose pose = {};
    double friction = 0; ///< Coulomb's coefficient, >= 0
    /// 1/s^2: per kg of a node. 0: default_contact_stiffness().
    double stiffness = 0;
    /// s, by which friction follows the force that presses a node on. Without any, an elastic body that slides on a
    /// rigid one is unstable at every wave length. 0: default_friction_delay().
    double friction_delay = 0;
    /// kg. 0: it is led. Else it is a free rigid body, in explicit steps: gravity and the bodies that it touches move
    /// it, from its pose and velocities on, and take from it what they get. Its position is its centre of mass. It may
    /// be far lighter than a node, and takes nothing from the stable step. Other obstacles it does not touch.
    double mass = 0;
    /// kg m^2, of a free one about the obstacle's axes, which must be the principal ones. All 0: those of the full
    /// shape.
    std::array<double, 3> inertia = {0, 0, 0};
};

/// What an obstacle and a body do to each other at one moment.
struct ObstacleReading {
    std::array<double, 3> force = {0, 0, 0};  ///< N, that the obstacle exerts on the body
    std::array<double, 3> torque = {0, 0, 0}; ///< N m, likewise, about the obstacle's position
    std::size_t nodes = 0;                    ///< that touch it
    double depth = 0;                         ///< m: of the deepest node
    double greatest_depth = 0;                ///< m: of the deepest node since the obstacle was set
    double energy = 0;                        ///< J that contact with it stores
    double dissipated = 0;                    ///< J that friction and impacts on it took since it was set
    /// N s and N m s: the sums of all steps' forces and torques by their time since the obstacle was set. What a body
    /// gains of momentum by obstacles is the sum of their impulses, to rounding; a force is that of the last step
    /// alone.
    std::array<double, 3> impulse = {0, 0, 0}, angular_impulse = {0, 0, 0};
    /// J, of a free one: as the next step finds it, and what gravity has done since it was set. Their change is what it
    /// gave the body, and `dissipated`, to rounding.
    double kinetic = 0, work_of_gravity = 0;
};

} // namespace hybmss
