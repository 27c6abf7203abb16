// What contact does in a step, and how it reads at a state.
#include "dynamics/contact/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace hybmss {

template <class T>
RigidPose Contact<T>::pose_after(std::size_t obstacle, double time) const {
    RigidPose pose = obstacles_[obstacle].pose;
    if (time > 0) {
        pose.position = plus(pose.position, time, pose.velocity);
        pose.rotation = turned(pose.rotation, {time * pose.angular_velocity[0], time * pose.angular_velocity[1],
                                               time * pose.angular_velocity[2]});
    }
    return pose;
}

template <class T>
Point Contact<T>::place(const RigidPose& pose, const Node& node, const State<T>& state, double length_unit) const {
    Point x;
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<const T> u = component(state.displacement, a);
        const auto displacement = static_cast<double>(u.first[static_cast<std::ptrdiff_t>(node.index) * u.stride]);
        x[a] = node.rest[a] - pose.position[a] + length_unit * displacement;
    }
    return from_space(pose.rotation, x);
}

/// Work and energy by the trapezoidal rule, as the step itself conserves them: over the way d along the surface the
/// tangential force does the work -m w^2 d . (s + s')/2, stores m w^2 (s'^2 - s^2)/2, and so, with s' = s + d - slip,
/// loses m w^2 slip . (s + s')/2.
template <class T>
typename Contact<T>::Touch Contact<T>::touch(const Obstacle& obstacle, const Point& place,
                                             const SurfaceDistance& surface, const Grip* grip) const {
    Touch touch{std::max(-surface.distance, 0.0), surface.normal, {}, 0};
    if (!grip || (touch.depth == 0 && !grip->holds)) {
        return touch;
    }
    touch.grip.place = place;
    touch.grip.holds = touch.depth > 0;
    touch.grip.known = true;
    if (!grip->known) {
        return touch;
    }
    // The spring turns with the surface: its part along the normal is dropped.
    const Point wanted = plus(grip->stretch, 1, plus(place, -1, grip->place));
    const Point along = plus(wanted, -dot(wanted, surface.normal), surface.normal);
    const double limit = obstacle.friction * touch.depth, size = length(along);
    const double kept = size > limit ? limit / size : 1;
    for (std::size_t a = 0; a < 3; ++a) {
        touch.grip.stretch[a] = kept * along[a];
        touch.dissipated += (1 - kept) * along[a] * (grip->stretch[a] + touch.grip.stretch[a]) / 2;
    }
    return touch;
}

/// m by which a node may come nearer before its block must be looked at again are used up at the speed
///
///     2 (fastest node + obstacle) + wave speed + (gravity + loads) t,
///
/// and by twice the way of nodes that are led: springs give a node of a body in one piece no more than the material's
/// wave speed, or the speed of what pulls at it. That holds for a short time, so a block is looked at after kAsleep
/// steps at the latest.
template <class T>
template <class Shape>
void Contact<T>::step_block(const Shape& shape, std::size_t o, const RigidPose& pose, std::size_t block,
                            State<T>& state, double time_step, double gain_of_speed) {
    Watch& watch = watches_[o][block];
    watch.speed += gain_of_speed;
    watch.near -= watch.speed * time_step;
    if (watch.near > 0) {
        return;
    }
    const Obstacle& obstacle = obstacles_[o];
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, nodes_.size());
    double nearest = std::numeric_limits<double>::infinity();
    bool held = false;
    const Component<T> v[3] = {component(state.velocity, 0), component(state.velocity, 1),
                               component(state.velocity, 2)};
    const double gain = time_step * obstacle.stiffness / length_unit_;
    for (std::size_t n = begin; n < end; ++n) {
        const Node& node = nodes_[n];
        if (node.mass == 0) {
            continue;
        }
        const Point y = place(pose, node, state, length_unit_);
        const double distance = distance_to(shape, y);
        nearest = std::min(nearest, distance);
        Grip* grip = has_grips(o) ? &grips_[o][n] : nullptr;
        if (!(distance < 0) && !(grip && grip->holds)) {
            if (grip) {
                // Where it comes from, should it touch next: friction begins with the first step in the obstacle.
                grip->place = y;
                grip->known = true;
            }
            continue;
        }
        const Touch now = touch(obstacle, y, surface_at(shape, y), grip);
        if (grip) {
            *grip = now.grip;
            held = held || now.grip.holds;
            watch.dissipated += node.mass * obstacle.stiffness * now.dissipated;
        }
        watch.greatest_depth = std::max(watch.greatest_depth, now.depth);
        Point push = {0, 0, 0};
        for (std::size_t a = 0; a < 3; ++a) {
            push[a] = now.depth * now.normal[a] - now.grip.stretch[a];
        }
        push = to_space(pose.rotation, push);
        for (std::size_t a = 0; a < 3; ++a) {
            T& velocity = v[a].first[static_cast<std::ptrdiff_t>(node.index) * v[a].stride];
            velocity = static_cast<T>(static_cast<double>(velocity) + gain * push[a]);
        }
    }
    const bool turns = dot(pose.angular_velocity, pose.angular_velocity) > 0 && !std::is_same_v<Shape, SphereShape>;
    if (!(nearest > 0) || held || turns) {
        watch.near = 0;
        return;
    }
    double fastest = 0;
    for (std::size_t n = begin; n < end; ++n) {
        double square = 0;
        for (const Component<T>& c : v) {
            const auto w = static_cast<double>(c.first[static_cast<std::ptrdiff_t>(nodes_[n].index) * c.stride]);
            square += w * w;
        }
        fastest = std::max(fastest, square);
    }
    // A step early, so that the place before the first touch is known.
    watch.speed = 2 * (length_unit_ * std::sqrt(fastest) + length(pose.velocity)) + wave_speed_;
    watch.near = std::min(nearest - (watch.speed + gain_of_speed) * time_step, kAsleep * watch.speed * time_step);
    if (watch.near > (watch.speed + gain_of_speed) * time_step && has_grips(o)) {
        for (std::size_t n = begin; n < end; ++n) {
            grips_[o][n].known = false;
        }
    }
}

template <class T>
void Contact<T>::come_nearer(double way) {
    for (auto& watches : watches_) {
        for (Watch& watch : watches) {
            watch.near -= way;
        }
    }
}

template <class T>
void Contact<T>::set_prescribed(std::span<const PrescribedComponent<T>> prescribed) {
    double way = 0;
    const bool same = std::equal(prescribed.begin(), prescribed.end(), prescribed_.begin(), prescribed_.end(),
                                 [&](const auto& now, const auto& before) {
                                     way = std::max(way, std::abs(static_cast<double>(now.displacement) -
                                                                  static_cast<double>(before.displacement)));
                                     return now.index == before.index && now.axis == before.axis;
                                 });
    // Along all three axes; twice, as what is pulled may overtake what pulls.
    come_nearer(same ? 2 * std::sqrt(3.0) * length_unit_ * way : std::numeric_limits<double>::infinity());
    prescribed_.assign(prescribed.begin(), prescribed.end());
}

template <class T>
void Contact<T>::set_loaded(std::span<const LoadedComponent<T>> loaded) {
    double greatest = 0;
    for (const LoadedComponent<T>& load : loaded) {
        greatest = std::max(greatest, std::abs(static_cast<double>(load.acceleration)));
    }
    load_acceleration_ = std::sqrt(3.0) * length_unit_ * greatest;
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
void Contact<T>::add_stages(const Body<T>&, State<T>& state, const StepParameters& parameters,
                            std::vector<Stage>& stages) {
    const double time_step = parameters.time_step;
    const double gain_of_speed = time_step * (length(parameters.acceleration) + load_acceleration_);
    const auto run = [this, &state, time_step, gain_of_speed](std::size_t piece, std::size_t) {
        const std::size_t begin = piece * kBlocksAPiece, end = std::min(begin + kBlocksAPiece, block_count());
        // One obstacle after the other, so that a node in two of them gets its pushes in one order.
        for (std::size_t o = 0; o < obstacles_.size(); ++o) {
            const RigidPose pose = pose_after(o, elapsed_[piece]);
            std::visit(
                [&](const auto& shape) {
                    for (std::size_t block = begin; block < end; ++block) {
                        step_block(shape, o, pose, block, state, time_step, gain_of_speed);
                    }
                },
                obstacles_[o].shape);
        }
        elapsed_[piece] += time_step;
    };
    stages.push_back({elapsed_.size(), run});
}

template <class T>
template <class Visit>
void Contact<T>::for_each_touch(const State<T>& state, const Visit& visit) const {
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const RigidPose pose = pose_after(o, elapsed());
        std::visit(
            [&](const auto& shape) {
                for (std::size_t n = 0; n < nodes_.size(); ++n) {
                    if (nodes_[n].mass == 0) {
                        continue;
                    }
                    const Point y = place(pose, nodes_[n], state, length_unit_);
                    const Grip* grip = has_grips(o) ? &grips_[o][n] : nullptr;
                    if (distance_to(shape, y) < 0 || (grip && grip->holds)) {
                        visit(o, pose, nodes_[n], y, touch(obstacles_[o], y, surface_at(shape, y), grip));
                    }
                }
            },
            obstacles_[o].shape);
    }
}

template <class T>
double Contact<T>::energy(const Body<T>&, State<T>& state) const {
    double sum = 0;
    for_each_touch(state, [&](std::size_t o, const RigidPose&, const Node& node, const Point&, const Touch& touch) {
        sum += 0.5 * node.mass * obstacles_[o].stiffness *
               (touch.depth * touch.depth + dot(touch.grip.stretch, touch.grip.stretch));
    });
    return sum;
}

template <class T>
double Contact<T>::dissipated(const Body<T>&, State<T>& state) const {
    double sum = 0;
    for (const auto& watches : watches_) {
        for (const Watch& watch : watches) {
            sum += watch.dissipated;
        }
    }
    // The slip up to this state, which the next step will book.
    for_each_touch(state, [&](std::size_t o, const RigidPose&, const Node& node, const Point&, const Touch& touch) {
        sum += node.mass * obstacles_[o].stiffness * touch.dissipated;
    });
    return sum;
}

template <class T>
void Contact<T>::add_forces(const Body<T>&, State<T>& state, NodeField<T>& force) const {
    for_each_touch(state, [&](std::size_t o, const RigidPose& pose, const Node& node, const Point&, const Touch& t) {
        const Point push = to_space(pose.rotation, plus(t.grip.stretch, -t.depth, t.normal));
        for (std::size_t a = 0; a < 3; ++a) {
            const Component<T> f = component(force, a);
            f.first[static_cast<std::ptrdiff_t>(node.index) * f.stride] -=
                static_cast<T>(node.mass * obstacles_[o].stiffness * push[a]);
        }
    });
}

template <class T>
std::vector<ObstacleReading> Contact<T>::readings(const Body<T>&, State<T>& state) const {
    std::vector<ObstacleReading> readings(obstacles_.size());
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        for (const Watch& watch : watches_[o]) {
            readings[o].greatest_depth = std::max(readings[o].greatest_depth, watch.greatest_depth);
        }
    }
    for_each_touch(state, [&](std::size_t o, const RigidPose& pose, const Node& node, const Point& y, const Touch& t) {
        if (t.depth == 0) {
            return;
        }
        ObstacleReading& reading = readings[o];
        const double k = node.mass * obstacles_[o].stiffness;
        const Point push = plus(t.grip.stretch, -t.depth, t.normal);
        reading.force = plus(reading.force, -k, to_space(pose.rotation, push));
        reading.torque = plus(reading.torque, -k, to_space(pose.rotation, cross(y, push)));
        reading.nodes += 1;
        reading.depth = std::max(reading.depth, t.depth);
        reading.greatest_depth = std::max(reading.greatest_depth, t.depth);
    });
    return readings;
}

template <class T>
std::size_t Contact<T>::bytes() const {
    std::size_t sum = nodes_.size() * sizeof(Node) + elapsed_.size() * sizeof(double) +
                      prescribed_.size() * sizeof(PrescribedComponent<T>);
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        sum += sizeof(Obstacle) + grips_[o].size() * sizeof(Grip) + watches_[o].size() * sizeof(Watch);
    }
    return sum;
}

template <class T>
void Contact<T>::state_was_set() {
    come_nearer(std::numeric_limits<double>::infinity());
}

template class Contact<float>;
template class Contact<double>;

} // namespace hybmss
