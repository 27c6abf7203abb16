#include "solvers/newton/contact_potential.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <variant>

namespace hybmss {
namespace {

/// R A R^T
Symmetric to_space(const Matrix& r, const Symmetric& a) {
    const Matrix full = {a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5]};
    Symmetric out{};
    std::size_t entry = 0;
    for (std::size_t p = 0; p < 3; ++p) {
        for (std::size_t q = p; q < 3; ++q, ++entry) {
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    out[entry] += r[3 * p + i] * full[3 * i + j] * r[3 * q + j];
                }
            }
        }
    }
    return out;
}

} // namespace

template <class T>
ContactPotential<T>::ContactPotential(const Body<T>& body, std::span<const SurfaceNode> surface,
                                      std::span<const Obstacle> obstacles)
    : length_unit_(body.length_unit()), obstacles_(completed(obstacles, body.critical_time_step())) {
    require_led(obstacles_, "free obstacles move in explicit steps alone");
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        if (obstacles_[o].friction > 0) {
            throw std::invalid_argument("obstacle " + std::to_string(o) +
                                        ": friction = " + std::to_string(obstacles_[o].friction) +
                                        " is not allowed: contact has a potential without friction only");
        }
    }
    for (const SurfaceNode& node : surface) {
        check_node(node, body.node_count());
        nodes_.push_back({node.rest_position, node.node, body.index_of(node.node), body.masses()[node.node]});
    }
    std::sort(nodes_.begin(), nodes_.end(), [](const Node& a, const Node& b) { return a.number < b.number; });
    const auto twice = std::adjacent_find(nodes_.begin(), nodes_.end(),
                                          [](const Node& a, const Node& b) { return a.number == b.number; });
    if (twice != nodes_.end()) {
        throw std::invalid_argument("surface node " + std::to_string(twice->number) +
                                    " is given twice: each may be given once");
    }
}

template <class T>
void ContactPotential<T>::move(std::span<const RigidPose> poses) {
    const std::vector<RigidPose> made = rigid(poses, obstacles_.size());
    for (std::size_t o = 0; o < made.size(); ++o) {
        obstacles_[o].pose = made[o];
    }
}

template <class T>
Point ContactPotential<T>::position(const Node& node, const State<T>& state) const {
    Point x = node.rest;
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<const T> u = component(state.displacement, a);
        x[a] += length_unit_ * static_cast<double>(u.first[static_cast<std::ptrdiff_t>(node.index) * u.stride]);
    }
    return x;
}

template <class T>
double ContactPotential<T>::distance(const Node& node, std::size_t obstacle, const State<T>& state) const {
    const RigidPose& pose = obstacles_[obstacle].pose;
    const Point y = from_space(pose.rotation, plus(position(node, state), -1, pose.position));
    return std::visit([&](const auto& shape) { return surface_at(shape, y).distance; }, obstacles_[obstacle].shape);
}

template <class T>
template <class Visit>
void ContactPotential<T>::for_each_touch(const State<T>& state, const Visit& visit) const {
    for (const Node& node : nodes_) {
        const Point x = position(node, state);
        for (std::size_t o = 0; o < obstacles_.size(); ++o) {
            const RigidPose& pose = obstacles_[o].pose;
            const Point y = from_space(pose.rotation, plus(x, -1, pose.position));
            std::visit(
                [&](const auto& shape) {
                    if (distance_to(shape, y) < 0) {
                        visit(node, o, y, shape, surface_at(shape, y));
                    }
                },
                obstacles_[o].shape);
        }
    }
}

template <class T>
std::vector<ComingTouch> ContactPotential<T>::touches(const State<T>& there) const {
    std::vector<ComingTouch> touches;
    for_each_touch(there, [&](const Node& node, std::size_t o, const Point&, const auto&, const SurfaceDistance& at) {
        touches.push_back({node.number, static_cast<std::size_t>(&node - nodes_.data()), o,
                           to_space(obstacles_[o].pose.rotation, at.normal),
                           node.mass * obstacles_[o].stiffness * at.slope * at.slope * length_unit_});
    });
    return touches;
}

template <class T>
std::vector<ComingTouch> ContactPotential<T>::coming(std::vector<ComingTouch> touches, const State<T>& here) const {
    for (ComingTouch& touch : touches) {
        touch.gap = distance(nodes_[touch.place], touch.obstacle, here) / length_unit_;
    }
    std::erase_if(touches, [](const ComingTouch& touch) { return touch.gap < 0; });
    return touches;
}

template <class T>
double ContactPotential<T>::value(const State<T>& state) const {
    double sum = 0;
    for_each_touch(state, [&](const Node& node, std::size_t o, const Point&, const auto&, const SurfaceDistance& at) {
        sum += 0.5 * node.mass * obstacles_[o].stiffness * at.distance * at.distance;
    });
    return sum;
}

template <class T>
double ContactPotential<T>::add_gradient(const State<T>& state, NodeField<T>& gradient) const {
    double largest = 0;
    for_each_touch(state, [&](const Node& node, std::size_t o, const Point&, const auto&, const SurfaceDistance& at) {
        const Point normal = to_space(obstacles_[o].pose.rotation, at.normal);
        for (std::size_t a = 0; a < 3; ++a) {
            const double derivative = node.mass * obstacles_[o].stiffness * at.distance * at.slope * normal[a];
            const Component<T> g = component(gradient, a);
            g.first[static_cast<std::ptrdiff_t>(node.index) * g.stride] += static_cast<T>(derivative);
            largest = std::max(largest, std::abs(derivative));
        }
    });
    return largest;
}

// W' = m w^2 d d', W'' = m w^2 (d' d'^T + d d''), d < 0 and d' = slope n
template <class T>
std::vector<TouchedNode> ContactPotential<T>::second_derivatives(const State<T>& state) const {
    std::vector<TouchedNode> nodes;
    for_each_touch(state,
                   [&](const Node& node, std::size_t o, const Point& y, const auto& shape, const SurfaceDistance& at) {
                       if (nodes.empty() || nodes.back().node != node.number) {
                           nodes.push_back({node.number, {}, {}});
                       }
                       const Matrix& rotation = obstacles_[o].pose.rotation;
                       const double stiffness = node.mass * obstacles_[o].stiffness * length_unit_;
                       const Point normal = to_space(rotation, at.normal);
                       add_square(stiffness * at.slope * at.slope, normal, nodes.back().along);
                       add_square(stiffness * at.slope * at.slope, normal, nodes.back().whole);
                       const Symmetric curvature = to_space(rotation, curvature_at(shape, y));
                       for (std::size_t e = 0; e < 6; ++e) {
                           nodes.back().whole[e] += stiffness * at.distance * curvature[e];
                       }
                   });
    return nodes;
}

template <class T>
std::vector<ObstacleReading> ContactPotential<T>::readings(const State<T>& state) const {
    std::vector<ObstacleReading> readings(obstacles_.size());
    for_each_touch(state, [&](const Node& node, std::size_t o, const Point& y, const auto&, const SurfaceDistance& at) {
        ObstacleReading& reading = readings[o];
        const Matrix& rotation = obstacles_[o].pose.rotation;
        const double stiffness = node.mass * obstacles_[o].stiffness;
        const Point force = plus({}, -stiffness * at.distance * at.slope, to_space(rotation, at.normal));
        reading.force = plus(reading.force, 1, force);
        reading.torque = plus(reading.torque, 1, cross(to_space(rotation, y), force));
        reading.nodes += 1;
        reading.depth = std::max(reading.depth, -at.distance);
        reading.greatest_depth = reading.depth;
        reading.energy += 0.5 * stiffness * at.distance * at.distance;
    });
    return readings;
}

template class ContactPotential<float>;
template class ContactPotential<double>;

} // namespace hybmss
