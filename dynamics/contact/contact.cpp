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

template <class T>
[[gnu::always_inline]] inline void Contact<T>::accelerate(const Node& node, const Point& gained, const Step& step,
                                                          State<T>& state) const {
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<T> c = component(state.velocity, a), u = component(state.displacement, a);
        const double change = step.gain * gained[a] / length_unit_;
        c.first[static_cast<std::ptrdiff_t>(node.index) * c.stride] += static_cast<T>(change);
        u.first[static_cast<std::ptrdiff_t>(node.index) * u.stride] += static_cast<T>(step.time_step * change);
    }
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
    // The way out by an acceleration of 1 along the normal, in depth, and the push by what it is deep.
    const double way = step.time_step * step.gain * dot(normal, freely(node, normal)) * surface.slope,
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
    const Point gained = freely(node, acceleration);
    accelerate(node, gained, step, state);
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
    if (!watch.passes(step.time_step, step.gain_of_speed)) {
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
        loosen(o, n, distance, way + step.time_step * wave_speed_); // nearer than that, no block falls asleep
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

/// By the pose that it has where nothing touches it; as step_block() otherwise. (What its own gain of speed by nodes
/// brings nearer is told by take_touches().)
template <class T>
template <class Shape>
void Contact<T>::find_touches_of(const Shape& shape, std::size_t o, const FreeObstacle& free, const State<T>& state,
                                 const Step& step, std::vector<FreeTouch>& touches) {
    const Obstacle& obstacle = obstacles_[o];
    const RigidPose& pose = free.unpushed();
    const double obstacle_speed = length(pose.velocity);
    for (std::size_t block = 0; block < block_count(); ++block) {
        Watch& watch = watches_[o][block];
        if (!watch.passes(step.time_step, step.gain_of_speed)) {
            continue;
        }
        double nearest = std::numeric_limits<double>::infinity(), fastest = 0;
        const std::size_t end = std::min((block + 1) * kBlock, nodes_.size());
        for (std::size_t n = block * kBlock; n < end; ++n) {
            const Node& node = nodes_[n];
            if (node.mass == 0) {
                continue;
            }
            const Point y = place(pose, node, state), own = velocity(node, state), ground = velocity_at(pose, y);
            const double distance = distance_to(shape, y), speed = length(own);
            const double reach = step.time_step * (speed + length(ground));
            loosen(o, n, distance, reach + step.time_step * wave_speed_);
            nearest = std::min(nearest, distance);
            fastest = std::max(fastest, speed);
            if (!(distance < reach)) {
                continue;
            }
            nearest = 0;
            const Point v = plus(own, -1, ground);
            const Point from = plus(y, -step.time_step, from_space(pose.rotation, v));
            const SurfaceDistance surface = surface_after(shape, from, y);
            const double was = std::max(-distance_to(shape, from), 0.0);
            if (!(surface.distance < 0) && was == 0) {
                continue;
            }
            FreeTouch touch{};
            touch.node = n;
            touch.mass = node.mass;
            const Point there = plus(pose.position, 1, to_space(pose.rotation, y));
            touch.arm = plus(plus(there, -step.time_step, own), -1, free.before().position);
            touch.normal = to_space(pose.rotation, surface.normal);
            touch.velocity = v;
            touch.depth = -surface.distance;
            touch.was = was;
            touch.slope = surface.slope;
            touch.stiffness = obstacle.stiffness;
            touch.gain = step.gain;
            touch.acting = step.acting;
            touch.time_step = step.time_step;
            touch.way = step.time_step * step.gain * dot(touch.normal, freely(node, touch.normal)) * surface.slope;
            touch.stopped = std::max(middle_of(shape) / 2, was);
            touch.friction = obstacle.friction;
            touch.follows = step.time_step / (obstacle.friction_delay + step.time_step);
            touch.push_before = has_friction(o) ? grips_[o][n].push : 0;
            touches.push_back(touch);
        }
        watch.speed = 2 * (fastest + obstacle_speed) + wave_speed_;
        watch.near = std::min(std::max(nearest, 0.0), kAsleep * watch.speed * step.time_step);
    }
}

template <class T>
void Contact<T>::find_touches(std::size_t o, const FreeObstacle& free, const State<T>& state,
                              const StepFactors& factors, std::vector<FreeTouch>& touches) {
    std::visit([&](const auto& shape) { find_touches_of(shape, o, free, state, ends_by(factors), touches); },
               obstacles_[o].shape);
}

/// Work as in step_node(), the obstacle's being the impulse by the mean of its velocities before and after the step: it
/// is what its kinetic energy changes by, to rounding where its three moments of inertia are equal.
template <class T>
void Contact<T>::take_touches(std::size_t o, const FreeObstacle& free, std::span<const FreeTouch> touches,
                              State<T>& state, const StepFactors& factors) {
    const Step step = ends_by(factors);
    for (const FreeTouch& touch : touches) {
        const std::size_t n = touch.node;
        const Node& node = nodes_[n];
        Watch& watch = watches_[o][n / kBlock];
        if (has_friction(o)) {
            grips_[o][n].push = touch.grip;
            grips_[o][n].friction = touch.rubbed;
        }
        const Point acceleration = plus(touch.rubbed, touch.push, touch.normal), gained = freely(node, acceleration);
        const Point own = velocity(node, state), after = plus(own, step.gain, gained);
        accelerate(node, gained, step, state);
        const Point sum = plus(plus(before_[n], 1, after), -2, free.mean_velocity(touch.arm));
        const double depth = touch.end_depth;
        watch.dissipated -=
            node.mass / 2 *
            (step.acting * dot(acceleration, sum) + obstacles_[o].stiffness * (depth * depth - touch.was * touch.was));
        watch.greatest_depth = std::max(watch.greatest_depth, depth);
        const Point impulse = plus({}, node.mass * step.gain, acceleration);
        watch.impulse = plus(watch.impulse, 1, impulse);
        watch.angular_impulse = plus(watch.angular_impulse, 1, cross(touch.arm, impulse));
    }
    set_motion(o, free.after());
    const bool wakes = !std::holds_alternative<SphereShape>(obstacles_[o].shape) &&
                       dot(motions_[o].pose.angular_velocity, motions_[o].pose.angular_velocity) > 0;
    for (Watch& watch : watches_[o]) {
        watch.speed += 2 * free.faster();
        watch.near = wakes ? 0 : watch.near;
    }
}

template <class T>
FreeMotion Contact<T>::whole_motion(std::size_t obstacle, const State<T>& state, const StepFactors& half) const {
    const Obstacle& free = obstacles_[obstacle];
    Point force = plus({0, 0, 0}, free.mass, half.acceleration), torque = {0, 0, 0};
    for_each_touch(state,
                   [&](std::size_t o, const RigidPose& pose, const Node&, const Point& y, double, const Point& pushed) {
                       if (o == obstacle) {
                           force = plus(force, -1, pushed);
                           torque = plus(torque, -1, cross(to_space(pose.rotation, y), pushed));
                       }
                   });
    return kicked(free, motions_[obstacle], half.acting, force, torque);
}

template <class T>
void Contact<T>::complete(const State<T>& state, const StepFactors& half) {
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        if (is_free(o)) {
            set_motion(o, whole_motion(o, state, half));
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
    const Step step = ends_by(factors);
    stages.push_back({elapsed_.size(), [this, &state, step](std::size_t piece, std::size_t) {
                          const std::size_t begin = piece * kBlocksAPiece,
                                            end = std::min(begin + kBlocksAPiece, block_count());
                          elapsed_[piece] += step.time_step;
                          // One obstacle after the other, so that a node in two of them gets its pushes in one order.
                          for (std::size_t o = 0; o < obstacles_.size(); ++o) {
                              if (is_free(o)) {
                                  continue;
                              }
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
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        if (is_free(o) && !shared_[o]) {
            stages.push_back({1, [this, &state, factors, o](std::size_t, std::size_t) {
                                  FreeObstacle free(obstacles_[o], motions_[o], factors.time_step, factors.acting,
                                                    factors.acceleration);
                                  touches_.clear();
                                  find_touches(o, free, state, factors, touches_);
                                  free.solve(touches_);
                                  take_touches(o, free, touches_, state, factors);
                              }});
        }
    }
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
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        if (is_free(o)) {
            const FreeMotion& motion = motions_[o];
            readings[o].kinetic = 0.5 * (obstacles_[o].mass * dot(motion.pose.velocity, motion.pose.velocity) +
                                         dot(motion.spin, motion.pose.angular_velocity));
            readings[o].work_of_gravity = motion.work_of_gravity;
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
std::vector<RigidPose> Contact<T>::poses(const State<T>& state, const StepFactors* half) const {
    std::vector<RigidPose> poses;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        poses.push_back(half && is_free(o) ? whole_motion(o, state, *half).pose : pose_after(o, elapsed()));
    }
    return poses;
}

template <class T>
std::size_t Contact<T>::bytes() const {
    std::size_t sum = nodes_.size() * (sizeof(Node) + sizeof(Point)) + elapsed_.size() * sizeof(double) +
                      prescribed_.size() * sizeof(PrescribedComponent<T>);
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        sum += sizeof(Obstacle) + (is_free(o) ? sizeof(FreeMotion) : 0) + grips_[o].size() * sizeof(Grip) +
               watches_[o].size() * sizeof(Watch);
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
