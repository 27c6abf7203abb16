#pragma once

#include "dynamics/contact/obstacle_geometry.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "solvers/newton/vector_space.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// What contact adds to the second derivatives at a node, N by the body's unit.
struct TouchedNode {
    std::uint32_t node;
    Symmetric along; ///< by how far the node moves along the normal: positive semidefinite
    Symmetric whole; ///< and by how the normal turns as it moves
};

/// A node that a step would press into an obstacle which it does not touch yet: the spring that it would have,
/// stiffness/2 (gap + normal . way)^2 in N by the body's unit, as a model for shorter steps.
struct ComingTouch {
    std::uint32_t node;
    std::size_t place, obstacle; ///< among the surface's nodes; its number
    Point normal;                ///< where the step would end
    double stiffness;            ///< N by the body's unit
    double gap = 0;              ///< in the body's unit
};

/// The potential of contact with rigid obstacles, without friction:
///
///     sum over surface nodes and obstacles of 1/2 m w^2 depth^2
///
/// with the node's mass m and the obstacle's stiffness w^2, where the depth is above zero: the spring of Contact, whose
/// force it has. Twice differentiable but where a node comes to touch.
template <class T>
class ContactPotential {
public:
    /// Throws std::invalid_argument for what the structs do not allow, and for friction.
    ContactPotential(const Body<T>& body, std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles);

    /// One pose an obstacle; velocities are not used. Throws std::invalid_argument for another count and what is no
    /// pose.
    void move(std::span<const RigidPose> poses);
    /// J.
    double value(const State<T>& state) const;
    /// gradient += its derivatives, N: minus the forces on the body. Returns the largest component of a force.
    double add_gradient(const State<T>& state, NodeField<T>& gradient) const;
    /// Its second derivatives, ascending by node.
    std::vector<TouchedNode> second_derivatives(const State<T>& state) const;
    /// What touches at a state.
    std::vector<ComingTouch> touches(const State<T>& there) const;
    /// Those of them that do not touch at another state, with their gaps there.
    std::vector<ComingTouch> coming(std::vector<ComingTouch> touches, const State<T>& here) const;
    /// Forces, torques, nodes, depths and energies at a state, one an obstacle.
    std::vector<ObstacleReading> readings(const State<T>& state) const;

private:
    struct Node {
        Point rest; ///< m
        std::uint32_t number;
        std::size_t index; ///< in the body's fields
        double mass;       ///< kg
    };
    Point position(const Node& node, const State<T>& state) const;
    /// m.
    double distance(const Node& node, std::size_t obstacle, const State<T>& state) const;
    /// visit(node, its obstacle's number, place in its axes, shape, how deep it is and the way out there), in the order
    /// of nodes and obstacles.
    template <class Visit>
    void for_each_touch(const State<T>& state, const Visit& visit) const;

    double length_unit_;
    std::vector<Node> nodes_;
    std::vector<Obstacle> obstacles_;
};

extern template class ContactPotential<float>;
extern template class ContactPotential<double>;

} // namespace hybmss
