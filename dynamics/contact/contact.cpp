// What contact does in a step, and how it reads at a state.
#include "dynamics/contact/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace hybmss {

// Inlined: what comes back through memory is read before it is there, which takes as long as all the rest.
template <class T>
[[gnu::always_inline]] inline Point Contact<T>::place(const RigidPose& pose, const Node& node,
                                                      const State<T>& state) const {
    Point x;
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<const T> u = component(state.displacement, a);
        const auto displacement = static_cast<double>(u.first[static_cast<std::ptrdiff_t>(node.index) * u.stride]);
        x[a] = node.rest[a] - pose.position[a] + length_unit_ * displacement;
    }
    return from_space(pose.rotation, x);
}

template <class T>
[[gnu::always_inline]] inline Point Contact<T>::velocity(const Node& node, const State<T>& state) const {
    Point w;
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<const T> v = component(state.velocity, a);
        w[a] = length_unit_ * static_cast<double>(v.first[static_cast<std::ptrdiff_t>(node.index) * v.stride]);
    }
    return w;
}

/// Work and energy by the trapezoidal rule, as the step itself conserves them: an impulse does the work of its force
/// times the mean of the velocities before and after the whole step. What it takes from the body and the spring does
/// not keep is lost.
///
/// Half way to the obstacle's middle a node is stopped, however soft the spring: it must not come out on the other
/// side.
template <class T>
template <class Shape>
[[gnu::always_inline]] inline bool Contact<T>::step_node(const Shape& shape, std::size_t o, const RigidPose& pose,
                                                         std::size_t n, const Point& y, State<T>& state,
                                                         const Step& step, Watch& watch) {
    const Obstacle& obstacle = obstacles_[o];
    const Node& node = nodes_[n];
    const Point ground = velocity_at(pose, y);
    const Point v = plus(velocity(node, state), -1, ground);
    const Point from = plus(y, -step.time_step, from_space(pose.rotation, v));
    const SurfaceDistance surface = surface_after(shape, from, y);
    const double was = std::max(-distance_to(shape, from), 0.0), would_be = std::max(-surface.distance, 0.0);
    if (would_be == 0 && was == 0) {
        return false;
    }
    const Point normal = to_space(pose.rotation, surface.normal);
    const auto freely = [&node](Point a) { // what an acceleration does to a node that is held along some axes
        for (std::size_t axis = 0; axis < 3; ++axis) {
            a[axis] *= node.held >> axis & 1 ? 0 : 1;
        }
        return a;
    };
    // The way out by an acceleration of 1 along the normal, in depth, and the push by what it is deep.
    const double way = step.time_step * step.gain * dot(normal, freely(normal)) * surface.slope,
                 stiffness = obstacle.stiffness * surface.slope;
    double push = stiffness * would_be / (1 + stiffness * way);
    if (way > 0) {
        push = std::max(push, stopping_push(surface, would_be - std::max(middle_of(shape) / 2, was), way));
    }
    Point acceleration = {push * normal[0], push * normal[1], push * normal[2]};
    if (has_friction(o) && push > 0) {
        const Point along = plus(v, -dot(v, normal), normal);
        Grip& grip = grips_[o][n];
        grip.push = grip.push > 0
                        ? grip.push + (push - grip.push) * step.time_step / (obstacle.friction_delay + step.time_step)
                        : push;
        const double most = obstacle.friction * grip.push, wanted = length(along) / step.gain;
        const double factor = wanted > most ? -most / length(along) : -1 / step.gain;
        grip.friction = {factor * along[0], factor * along[1], factor * along[2]};
        acceleration = plus(acceleration, 1, grip.friction);
    }
    const Point gained = freely(acceleration);
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<T> c = component(state.velocity, a), u = component(state.displacement, a);
        const double change = step.gain * gained[a] / length_unit_;
        c.first[static_cast<std::ptrdiff_t>(node.index) * c.stride] += static_cast<T>(change);
        u.first[static_cast<std::ptrdiff_t>(node.index) * u.stride] += static_cast<T>(step.time_step * change);
    }
    const double depth = std::max(would_be - way * push, 0.0);
    const Point after = plus(v, step.gain, gained);
    const Point before = plus(before_[n], -1, ground);
    watch.dissipated -=
        node.mass / 2 *
        (step.acting * dot(acceleration, plus(before, 1, after)) + obstacle.stiffness * (depth * depth - was * was));
    watch.greatest_depth = std::max(watch.greatest_depth, depth);
    const Point impulse = plus({}, node.mass * step.gain, acceleration);
    watch.impulse = plus(watch.impulse, 1, impulse);
    watch.angular_impulse = plus(watch.angular_impulse, 1, cross(to_space(pose.rotation, from), impulse));
    return depth > 0;
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
                            State<T>& state, const Step& step) {
    Watch& watch = watches_[o][block];
    const bool looks = watch.looks(step.time_step, step.gain_of_speed);
    watch.speed += step.gain_of_speed;
    watch.near -= watch.speed * step.time_step;
    if (!looks) {
        return;
    }
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, nodes_.size());
    const double obstacle_speed = length(pose.velocity);
    const bool turns = dot(pose.angular_velocity, pose.angular_velocity) > 0;
    double nearest = std::numeric_limits<double>::infinity(), fastest = 0;
    for (std::size_t n = begin; n < end; ++n) {
        const Node& node = nodes_[n];
        if (node.mass == 0) {
            continue;
        }
        const Point y = place(pose, node, state);
        double distance = distance_to(shape, y);
        const double speed = length(velocity(node, state)); // one that is pushed back was at least as fast
        const double way = step.time_step * (speed + (turns ? length(velocity_at(pose, y)) : obstacle_speed));
        if (has_friction(o)) {
            Grip& grip = grips_[o][n];
            grip.friction = {0, 0, 0};
            // Nearer than that, no block falls asleep.
            grip.push = distance < way + step.time_step * wave_speed_ ? grip.push : 0;
        }
        if (distance < way && step_node(shape, o, pose, n, y, state, step, watch)) {
            distance = 0;
        }
        nearest = std::min(nearest, distance);
        fastest = std::max(fastest, speed);
    }
    if (!(nearest > 0) || (turns && !std::is_same_v<Shape, SphereShape>)) {
        watch.near = 0;
        return;
    }
    watch.speed = 2 * (fastest + obstacle_speed) + wave_speed_;
    watch.near = std::min(nearest, kAsleep * watch.speed * step.time_step);
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
    if (!same) {
        number_nodes();
        for (Node& node : nodes_) {
            node.held = 0;
        }
        for (const PrescribedComponent<T>& p : prescribed) {
            if (const auto found = numbers_.find(p.index); found != numbers_.end()) {
                nodes_[found->second].held |= static_cast<std::uint8_t>(1 << p.axis);
            }
        }
    }
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
void Contact<T>::set_pushed(double acceleration) {
    push_acceleration_ = acceleration;
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
void Contact<T>::add_stages(const Body<T>&, State<T>& state, const StepFactors& factors, std::vector<Stage>& stages) {
    time_step_ = factors.time_step;
    stages.push_back({piece_count(), [this, &state, gain = gain_of_speed(factors)](std::size_t piece, std::size_t) {
                          const std::size_t begin = piece * kBlocksAPiece,
                                            end = std::min(begin + kBlocksAPiece, block_count());
                          for (std::size_t block = begin; block < end; ++block) {
                              if (std::none_of(watches_.begin(), watches_.end(), [&](const auto& watches) {
                                      return watches[block].looks(time_step_, gain);
                                  })) {
                                  continue;
                              }
                              const std::size_t last = std::min((block + 1) * kBlock, nodes_.size());
                              for (std::size_t n = block * kBlock; n < last; ++n) {
                                  before_[n] = velocity(nodes_[n], state);
                              }
                          }
                      }});
}

template <class T>
void Contact<T>::add_last_stages(const Body<T>&, State<T>& state, const StepFactors& factors,
                                 std::vector<Stage>& stages) {
    const Step step{factors.time_step, factors.late_force, factors.acting, gain_of_speed(factors)};
    stages.push_back({elapsed_.size(), [this, &state, step](std::size_t piece, std::size_t) {
                          const std::size_t begin = piece * kBlocksAPiece,
                                            end = std::min(begin + kBlocksAPiece, block_count());
                          elapsed_[piece] += step.time_step;
                          // One obstacle after the other, so that a node in two of them gets its pushes in one order.
                          for (std::size_t o = 0; o < obstacles_.size(); ++o) {
                              const RigidPose pose = pose_after(o, elapsed_[piece]);
                              std::visit(
                                  [&](const auto& shape) {
                                      for (std::size_t block = begin; block < end; ++block) {
                                          step_block(shape, o, pose, block, state, step);
                                      }
                                  },
                                  obstacles_[o].shape);
                          }
                      }});
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
                    const Point y = place(pose, nodes_[n], state);
                    if (distance_to(shape, y) < 0) {
                        const SurfaceDistance surface = surface_at(shape, y);
                        const double mass = nodes_[n].mass;
                        Point force = to_space(pose.rotation, surface.normal);
                        for (std::size_t a = 0; a < 3; ++a) {
                            force[a] *= -mass * obstacles_[o].stiffness * surface.distance * surface.slope;
                            force[a] += has_friction(o) ? mass * grips_[o][n].friction[a] : 0;
                        }
                        visit(o, pose, nodes_[n], y, -surface.distance, force);
                    }
                }
            },
            obstacles_[o].shape);
    }
}

template <class T>
double Contact<T>::energy(const Body<T>&, State<T>& state) const {
    double sum = 0;
    for_each_touch(state, [&](std::size_t o, const RigidPose&, const Node& node, const Point&, double depth,
                              const Point&) { sum += 0.5 * node.mass * obstacles_[o].stiffness * depth * depth; });
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
    // The first half of what the next step's force will have taken: that on the way to this state. The obstacle's share
    // of it is there too.
    for_each_touch(state, [&](std::size_t, const RigidPose&, const Node& node, const Point&, double,
                              const Point& force) { sum -= 0.5 * time_step_ * dot(force, velocity(node, state)); });
    return sum;
}

template <class T>
void Contact<T>::add_forces(const Body<T>&, State<T>& state, NodeField<T>& force) const {
    for_each_touch(state, [&](std::size_t, const RigidPose&, const Node& node, const Point&, double, const Point& f) {
        for (std::size_t a = 0; a < 3; ++a) {
            const Component<T> c = component(force, a);
            c.first[static_cast<std::ptrdiff_t>(node.index) * c.stride] += static_cast<T>(f[a]);
        }
    });
}

template <class T>
std::vector<ObstacleReading> Contact<T>::readings(const Body<T>&, State<T>& state) const {
    std::vector<ObstacleReading> readings(obstacles_.size());
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        for (const Watch& watch : watches_[o]) {
            ObstacleReading& reading = readings[o];
            reading.greatest_depth = std::max(reading.greatest_depth, watch.greatest_depth);
            reading.dissipated += watch.dissipated;
            reading.impulse = plus(reading.impulse, 1, watch.impulse);
            reading.angular_impulse = plus(reading.angular_impulse, 1, watch.angular_impulse);
        }
    }
    for_each_touch(state, [&](std::size_t o, const RigidPose& pose, const Node& node, const Point& y, double depth,
                              const Point& force) {
        this->add_touch(readings[o], 0.5 * node.mass * obstacles_[o].stiffness * depth * depth, depth,
                        to_space(pose.rotation, y), force,
                        0.5 * time_step_ * dot(force, velocity(node, state))); // as dissipated() says
    });
    return readings;
}

template <class T>
std::size_t Contact<T>::bytes() const {
    std::size_t sum = nodes_.size() * (sizeof(Node) + sizeof(Point)) + elapsed_.size() * sizeof(double) +
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
