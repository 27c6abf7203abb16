#include "dynamics/contact/skin_contact.hpp"

#include "dynamics/explicit_dynamics_implementation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <unordered_map>

namespace hybmss {

template <class T>
SkinContact<T>::SkinContact(const Body<T>& body, double wave_speed, std::span<const SkinPoint> skin,
                            std::span<const Obstacle> obstacles)
    : length_unit_(body.length_unit()), wave_speed_(wave_speed),
      obstacles_(completed(obstacles, body.critical_time_step())) {
    require_led(obstacles_, "a skin touches obstacles that are led; nodes touch free ones too");
    for (const SkinPoint& point : skin) {
        double sum = 0;
        Vertex vertex{point.rest_position, point.nodes, {}, point.weights, {}, {}, 0};
        for (std::size_t c = 0; c < 8; ++c) {
            check_node({point.nodes[c], point.rest_position}, body.node_count());
            vertex.index[c] = body.index_of(point.nodes[c]);
            sum += point.weights[c];
        }
        if (!(std::abs(sum - 1) < 1e-6)) {
            throw std::invalid_argument("skin point " + std::to_string(&point - skin.data()) +
                                        ": the sum of its weights is " + std::to_string(sum) + ", it must be 1");
        }
        vertices_.push_back(vertex);
    }
    weigh(body);
    before_.resize(vertices_.size());
    touches_.assign(obstacles_.size(), std::vector<Touch>(vertices_.size()));
    watches_.assign(obstacles_.size(), std::vector<Watch>(block_count()));
    sums_.resize(obstacles_.size());
}

/// By the masses of now and what is held.
template <class T>
void SkinContact<T>::weigh(const Body<T>& body) {
    const auto is_held = [&](std::size_t index, std::size_t axis) {
        const auto found = std::lower_bound(prescribed_.begin(), prescribed_.end(), std::pair(index, axis),
                                            [](const PrescribedComponent<T>& p, const auto& of) {
                                                return std::pair(p.index, std::size_t{p.axis}) < of;
                                            });
        return found != prescribed_.end() && found->index == index && found->axis == axis;
    };
    std::unordered_map<std::uint32_t, double> weights, responses; // of a node, by all points
    for (const Vertex& vertex : vertices_) {
        for (std::size_t c = 0; c < 8; ++c) {
            weights[vertex.nodes[c]] += std::abs(vertex.weights[c]);
        }
    }
    for (Vertex& vertex : vertices_) {
        vertex.mass = 0;
        bool whole = true;
        for (std::size_t c = 0; c < 8; ++c) {
            const double weight = std::abs(vertex.weights[c]), mass = body.masses()[vertex.nodes[c]];
            whole = whole && (weight == 0 || mass > 0);
            vertex.mass += weight > 0 ? weight / weights[vertex.nodes[c]] * mass : 0;
        }
        vertex.mass = whole ? vertex.mass : 0;
        for (std::size_t c = 0; c < 8 && whole; ++c) {
            if (vertex.weights[c] != 0) {
                responses[vertex.nodes[c]] +=
                    std::abs(vertex.weights[c]) * vertex.mass / body.masses()[vertex.nodes[c]];
            }
        }
    }
    for (Vertex& vertex : vertices_) {
        vertex.response = 1;
        vertex.share = {0, 0, 0};
        for (std::size_t c = 0; c < 8; ++c) {
            vertex.gain[c] = {0, 0, 0};
            const double weight = vertex.weights[c];
            if (weight == 0 || vertex.mass == 0) {
                continue;
            }
            vertex.response = std::max(vertex.response, responses[vertex.nodes[c]]);
            for (std::size_t a = 0; a < 3; ++a) {
                if (!is_held(vertex.index[c], a)) {
                    vertex.gain[c][a] = weight * vertex.mass / body.masses()[vertex.nodes[c]];
                    vertex.share[a] += weight;
                }
            }
        }
    }
}

template <class T>
void SkinContact<T>::come_nearer(double way) {
    for (auto& watches : watches_) {
        for (Watch& watch : watches) {
            watch.near -= way;
        }
    }
}

template <class T>
void SkinContact<T>::move(std::span<const RigidPose> poses) {
    const std::vector<RigidPose> made = rigid(poses, obstacles_.size()); // refused before any is moved
    for (std::size_t o = 0; o < made.size(); ++o) {
        obstacles_[o].pose = made[o];
    }
    elapsed_ = 0;
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
void SkinContact<T>::body_was_cut(const Body<T>& body, const Lattice&, const NodeNumbers&, std::span<const CutNode>) {
    weigh(body);
}

template <class T>
void SkinContact<T>::set_prescribed(std::span<const PrescribedComponent<T>> prescribed) {
    const auto before = [](const auto& a, const auto& b) {
        return std::pair(a.index, a.axis) < std::pair(b.index, b.axis);
    };
    std::vector<PrescribedComponent<T>> now(prescribed.begin(), prescribed.end());
    std::sort(now.begin(), now.end(), before);
    double way = 0;
    const bool same =
        std::equal(now.begin(), now.end(), prescribed_.begin(), prescribed_.end(), [&](const auto& a, const auto& b) {
            way = std::max(way, std::abs(static_cast<double>(a.displacement) - static_cast<double>(b.displacement)));
            return a.index == b.index && a.axis == b.axis;
        });
    prescribed_ = std::move(now);
    held_changed_ = held_changed_ || !same;
    come_nearer(same ? 2 * std::sqrt(3.0) * length_unit_ * way : std::numeric_limits<double>::infinity());
}

template <class T>
void SkinContact<T>::set_loaded(std::span<const LoadedComponent<T>> loaded) {
    double greatest = 0;
    for (const LoadedComponent<T>& load : loaded) {
        greatest = std::max(greatest, std::abs(static_cast<double>(load.acceleration)));
    }
    loaded_ = std::sqrt(3.0) * length_unit_ * greatest;
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
void SkinContact<T>::set_pushed(double acceleration) {
    pushed_ = acceleration;
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
void SkinContact<T>::state_was_set() {
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
Point SkinContact<T>::sum(const Vertex& vertex, const NodeField<T>& field, Point start) const {
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<const T> c = component(field, a);
        double along = 0;
        for (std::size_t i = 0; i < 8; ++i) {
            along += vertex.weights[i] *
                     static_cast<double>(c.first[static_cast<std::ptrdiff_t>(vertex.index[i]) * c.stride]);
        }
        start[a] += length_unit_ * along;
    }
    return start;
}
template <class T>
Point SkinContact<T>::position(const Vertex& vertex, const State<T>& state) const {
    return sum(vertex, state.displacement, vertex.rest);
}
template <class T>
Point SkinContact<T>::velocity(const Vertex& vertex, const State<T>& state) const {
    return sum(vertex, state.velocity, Point{0, 0, 0});
}

// As Contact::step_node().
template <class T>
template <class Shape>
void SkinContact<T>::step_vertex(const Shape& shape, std::size_t o, const RigidPose& pose, std::size_t n,
                                 const Point& y, const State<T>& state, const StepFactors& factors) {
    const Obstacle& obstacle = obstacles_[o];
    const Vertex& vertex = vertices_[n];
    Touch& touch = touches_[o][n];
    const double dt = factors.time_step, gain = factors.late_force;
    const Point v = plus(velocity(vertex, state), -1, velocity_at(pose, y));
    const Point from = plus(y, -dt, from_space(pose.rotation, v));
    const SurfaceDistance surface = surface_after(shape, from, y);
    const double was = std::max(-distance_to(shape, from), 0.0), would_be = std::max(-surface.distance, 0.0);
    near_.push_back({o, n, was});
    if (would_be == 0) {
        return;
    }
    const Point normal = to_space(pose.rotation, surface.normal);
    const auto freely = [&vertex](Point a) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            a[axis] *= vertex.share[axis];
        }
        return a;
    };
    // The way out by an acceleration of 1 of all points around, in depth, and the push by what it is deep.
    const double way = dt * gain * vertex.response * dot(normal, freely(normal)) * surface.slope,
                 stiffness = obstacle.stiffness * surface.slope;
    double push = stiffness * would_be / (1 + stiffness * way);
    if (way > 0) {
        push = std::max(push, stopping_push(surface, would_be - std::max(middle_of(shape) / 2, was), way));
    }
    touch.acceleration = plus({}, push, normal);
    if (obstacle.friction > 0 && push > 0) {
        const Point along = plus(v, -dot(v, normal), normal);
        touch.push = touch.push > 0 ? touch.push + (push - touch.push) * dt / (obstacle.friction_delay + dt) : push;
        const double most = obstacle.friction * touch.push, stops = 1 / (gain * vertex.response);
        const double factor = length(along) * stops > most ? -most / length(along) : -stops;
        touch.acceleration = plus(touch.acceleration, factor, along);
    }
}

template <class T>
void SkinContact<T>::push(const Vertex& vertex, const Point& acceleration, State<T>& state,
                          const StepFactors& factors) const {
    for (std::size_t a = 0; a < 3; ++a) {
        const Component<T> c = component(state.velocity, a), u = component(state.displacement, a);
        for (std::size_t i = 0; i < 8; ++i) {
            const double change = factors.late_force * vertex.gain[i][a] * acceleration[a] / length_unit_;
            const auto at = static_cast<std::ptrdiff_t>(vertex.index[i]);
            c.first[at * c.stride] += static_cast<T>(change);
            u.first[at * u.stride] += static_cast<T>(factors.time_step * change);
        }
    }
}

// Blocks sleep as those of Contact do.
template <class T>
template <class Shape>
void SkinContact<T>::step_block(const Shape& shape, std::size_t o, const RigidPose& pose, std::size_t block,
                                const State<T>& state, const StepFactors& factors) {
    Watch& watch = watches_[o][block];
    const double dt = factors.time_step;
    const bool looks = watch.looks(dt);
    watch.speed += factors.acting * (length(factors.acceleration) + loaded_ + pushed_);
    watch.near -= watch.speed * dt;
    if (!looks) {
        return;
    }
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, vertices_.size());
    const bool turns = dot(pose.angular_velocity, pose.angular_velocity) > 0;
    double nearest = std::numeric_limits<double>::infinity(), fastest = 0;
    for (std::size_t n = begin; n < end; ++n) {
        Touch& touch = touches_[o][n];
        touch.acceleration = {0, 0, 0};
        if (vertices_[n].mass == 0) {
            continue;
        }
        const Point y = from_space(pose.rotation, plus(position(vertices_[n], state), -1, pose.position));
        const double distance = distance_to(shape, y), speed = length(velocity(vertices_[n], state));
        const double way = dt * (speed + length(velocity_at(pose, y)));
        touch.push = distance < way + dt * wave_speed_ ? touch.push : 0;
        if (distance < way) {
            step_vertex(shape, o, pose, n, y, state, factors);
        }
        nearest = std::min(nearest, distance - way);
        fastest = std::max(fastest, speed);
    }
    if (!(nearest > 0) || turns) {
        watch.near = 0;
        return;
    }
    watch.speed = 2 * (fastest + length(pose.velocity)) + wave_speed_;
    watch.near = std::min(nearest, kAsleep * watch.speed * dt);
}

/// Work and energy by the trapezoidal rule, as Contact has them, when all have pushed.
template <class T>
void SkinContact<T>::step(State<T>& state, const StepFactors& factors) {
    elapsed_ += factors.time_step;
    near_.clear();
    std::vector<RigidPose> poses;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const RigidPose& pose = poses.emplace_back(pose_after(obstacles_[o].pose, elapsed_));
        const std::size_t first = near_.size();
        std::visit(
            [&](const auto& shape) {
                for (std::size_t block = 0; block < block_count(); ++block) {
                    step_block(shape, o, pose, block, state, factors);
                }
            },
            obstacles_[o].shape);
        for (std::size_t n = first; n < near_.size(); ++n) {
            push(vertices_[near_[n].vertex], touches_[o][near_[n].vertex].acceleration, state, factors);
        }
    }
    for (const Near& near : near_) {
        const Vertex& vertex = vertices_[near.vertex];
        const RigidPose& pose = poses[near.obstacle];
        const Point& acceleration = touches_[near.obstacle][near.vertex].acceleration;
        Sums& sums = sums_[near.obstacle];
        const Point y = from_space(pose.rotation, plus(position(vertex, state), -1, pose.position));
        const double depth = std::visit([&](const auto& shape) { return std::max(-distance_to(shape, y), 0.0); },
                                        obstacles_[near.obstacle].shape);
        const Point twice = plus(plus(before_[near.vertex], 1, velocity(vertex, state)), -2, velocity_at(pose, y));
        sums.dissipated -= vertex.mass / 2 *
                           (factors.acting * dot(acceleration, twice) +
                            obstacles_[near.obstacle].stiffness * (depth * depth - near.was * near.was));
        sums.greatest_depth = std::max(sums.greatest_depth, depth);
        const Point impulse = plus({}, vertex.mass * factors.late_force, acceleration);
        sums.impulse = plus(sums.impulse, 1, impulse);
        sums.angular_impulse = plus(sums.angular_impulse, 1, cross(to_space(pose.rotation, y), impulse));
    }
}

template <class T>
void SkinContact<T>::add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                                std::vector<Stage>& stages) {
    time_step_ = factors.time_step;
    if (held_changed_) {
        weigh(body);
        held_changed_ = false;
    }
    stages.push_back({block_count(), [this, &state](std::size_t block, std::size_t) {
                          if (std::any_of(watches_.begin(), watches_.end(),
                                          [&](const auto& watches) { return watches[block].looks(time_step_); })) {
                              const std::size_t end = std::min((block + 1) * kBlock, vertices_.size());
                              for (std::size_t n = block * kBlock; n < end; ++n) {
                                  before_[n] = velocity(vertices_[n], state);
                              }
                          }
                      }});
}

template <class T>
void SkinContact<T>::add_last_stages(const Body<T>&, State<T>& state, const StepFactors& factors,
                                     std::vector<Stage>& stages) {
    stages.push_back({1, [this, &state, factors](std::size_t, std::size_t) { step(state, factors); }});
}

template <class T>
template <class Visit>
void SkinContact<T>::for_each_touch(const State<T>& state, const Visit& visit) const {
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        const RigidPose pose = pose_after(obstacles_[o].pose, elapsed_);
        for (std::size_t n = 0; n < vertices_.size(); ++n) {
            if (vertices_[n].mass == 0) {
                continue;
            }
            const Point& acceleration = touches_[o][n].acceleration;
            const Point y = from_space(pose.rotation, plus(position(vertices_[n], state), -1, pose.position));
            const double depth = std::visit([&](const auto& shape) { return std::max(-distance_to(shape, y), 0.0); },
                                            obstacles_[o].shape);
            if (depth > 0 || dot(acceleration, acceleration) > 0) {
                visit(o, pose, vertices_[n], y, depth, plus({}, vertices_[n].mass, acceleration));
            }
        }
    }
}

template <class T>
double SkinContact<T>::energy(const Body<T>&, State<T>& state) const {
    double sum = 0;
    for_each_touch(state, [&](std::size_t o, const RigidPose&, const Vertex& vertex, const Point&, double depth,
                              const Point&) { sum += 0.5 * vertex.mass * obstacles_[o].stiffness * depth * depth; });
    return sum;
}

template <class T>
double SkinContact<T>::dissipated(const Body<T>&, State<T>& state) const {
    double sum = 0;
    for (const Sums& sums : sums_) {
        sum += sums.dissipated;
    }
    // As Contact: the first half of what the next step's force will have taken.
    for_each_touch(state, [&](std::size_t, const RigidPose&, const Vertex& vertex, const Point&, double,
                              const Point& force) { sum -= 0.5 * time_step_ * dot(force, velocity(vertex, state)); });
    return sum;
}

template <class T>
void SkinContact<T>::add_forces(const Body<T>&, State<T>& state, NodeField<T>& force) const {
    for_each_touch(state,
                   [&](std::size_t, const RigidPose&, const Vertex& vertex, const Point&, double, const Point& f) {
                       for (std::size_t a = 0; a < 3; ++a) {
                           const Component<T> c = component(force, a);
                           for (std::size_t i = 0; i < 8; ++i) {
                               c.first[static_cast<std::ptrdiff_t>(vertex.index[i]) * c.stride] +=
                                   static_cast<T>(vertex.weights[i] * f[a]);
                           }
                       }
                   });
}

template <class T>
std::vector<ObstacleReading> SkinContact<T>::readings(const Body<T>&, State<T>& state) const {
    std::vector<ObstacleReading> readings(obstacles_.size());
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        readings[o].dissipated = sums_[o].dissipated;
        readings[o].greatest_depth = sums_[o].greatest_depth;
        readings[o].impulse = sums_[o].impulse;
        readings[o].angular_impulse = sums_[o].angular_impulse;
    }
    for_each_touch(state, [&](std::size_t o, const RigidPose& pose, const Vertex& vertex, const Point& y, double depth,
                              const Point& force) {
        this->add_touch(readings[o], 0.5 * vertex.mass * obstacles_[o].stiffness * depth * depth, depth,
                        to_space(pose.rotation, y), force, 0.5 * time_step_ * dot(force, velocity(vertex, state)));
    });
    return readings;
}

template <class T>
std::vector<RigidPose> SkinContact<T>::poses(const State<T>&, const StepFactors*) const {
    std::vector<RigidPose> poses;
    for (const Obstacle& obstacle : obstacles_) {
        poses.push_back(pose_after(obstacle.pose, elapsed_));
    }
    return poses;
}

template <class T>
std::size_t SkinContact<T>::bytes() const {
    return vertices_.size() * (sizeof(Vertex) + sizeof(Point) + obstacles_.size() * (sizeof(Touch) + sizeof(Near))) +
           obstacles_.size() * (sizeof(Obstacle) + sizeof(Sums) + block_count() * sizeof(Watch)) +
           prescribed_.size() * sizeof(PrescribedComponent<T>);
}

// Two times, eight sums an obstacle, and four numbers of each of its vertices.
template <class T>
std::size_t SkinContact<T>::memory_size() const {
    return 2 + obstacles_.size() * (8 + 4 * vertices_.size());
}

template <class T>
std::vector<double> SkinContact<T>::memory() const {
    std::vector<double> memory = {elapsed_, time_step_};
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        memory.insert(memory.end(), {sums_[o].dissipated, sums_[o].greatest_depth});
        for (const Point* sum : {&sums_[o].impulse, &sums_[o].angular_impulse}) {
            memory.insert(memory.end(), sum->begin(), sum->end());
        }
        for (const Touch& touch : touches_[o]) {
            memory.insert(memory.end(), touch.acceleration.begin(), touch.acceleration.end());
            memory.push_back(touch.push);
        }
    }
    return memory;
}

template <class T>
void SkinContact<T>::set_memory(std::span<const double> memory) {
    const double* next = memory.data();
    elapsed_ = *next++;
    time_step_ = *next++;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        sums_[o].dissipated = *next++;
        sums_[o].greatest_depth = *next++;
        for (Point* sum : {&sums_[o].impulse, &sums_[o].angular_impulse}) {
            next = (std::copy_n(next, 3, sum->begin()), next + 3);
        }
        for (Touch& touch : touches_[o]) {
            next = (std::copy_n(next, 3, touch.acceleration.begin()), next + 3);
            touch.push = *next++;
        }
    }
    come_nearer(std::numeric_limits<double>::infinity());
}

template <class T>
void ExplicitDynamics<T>::set_skin_obstacles(std::span<const SkinPoint> skin, std::span<const Obstacle> obstacles) {
    Implementation& i = *implementation_;
    i.template replace<ObstacleEffect<T>>(
        obstacles.empty() ? nullptr : std::make_unique<SkinContact<T>>(*i.body, i.wave_speed, skin, obstacles));
}

template class SkinContact<float>;
template class SkinContact<double>;
template void ExplicitDynamics<float>::set_skin_obstacles(std::span<const SkinPoint>, std::span<const Obstacle>);
template void ExplicitDynamics<double>::set_skin_obstacles(std::span<const SkinPoint>, std::span<const Obstacle>);

} // namespace hybmss
