// What contact is made of: surface nodes and obstacles, as they are given, moved, cut, and remembered by a checkpoint.
#include "dynamics/contact/contact.hpp"
#include "dynamics/explicit_dynamics_implementation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

namespace hybmss {

std::vector<SurfaceNode> surface_nodes(const Lattice& lattice, const std::array<double, 3>& origin) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    const auto [nx, ny, nz] = lattice.cells();
    const auto filled = [&, nx = nx, ny = ny, nz = nz](int i, int j, int k) {
        return i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz && lattice.cell_scale(i, j, k) > 0;
    };
    std::vector<SurfaceNode> surface;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto row = static_cast<std::size_t>(nx) + 1, layer = row * (static_cast<std::size_t>(ny) + 1);
        const int i = static_cast<int>(nodes[n] % row), j = static_cast<int>(nodes[n] % layer / row),
                  k = static_cast<int>(nodes[n] / layer);
        int around = 0;
        for (int corner = 0; corner < 8; ++corner) {
            around += filled(i - (corner & 1), j - (corner >> 1 & 1), k - (corner >> 2));
        }
        if (around < 8) {
            std::array<double, 3> position = lattice.rest_position(nodes[n]);
            for (std::size_t a = 0; a < 3; ++a) {
                position[a] += origin[a];
            }
            surface.push_back({static_cast<std::uint32_t>(n), position});
        }
    }
    return surface;
}

std::vector<SurfaceNode> surface_nodes(const Network& network) {
    std::vector<int> cells(network.rest_positions.size(), 0);
    for (const Network::Cell& cell : network.cells) {
        for (const auto node : cell.nodes) {
            ++cells[static_cast<std::size_t>(node)];
        }
    }
    std::vector<SurfaceNode> surface;
    for (std::size_t n = 0; n < cells.size(); ++n) {
        if (cells[n] < 8) {
            surface.push_back({static_cast<std::uint32_t>(n), network.rest_positions[n]});
        }
    }
    return surface;
}

namespace {

template <std::size_t N>
bool is_finite(const std::array<double, N>& values) {
    for (const double v : values) {
        if (!std::isfinite(v)) {
            return false;
        }
    }
    return true;
}

std::string name_of(std::size_t obstacle) {
    return "obstacle " + std::to_string(obstacle);
}

[[noreturn]] void refuse_obstacle(std::size_t obstacle, const std::string& what) {
    throw std::invalid_argument(name_of(obstacle) + ": " + what);
}

} // namespace

RigidPose rigid(RigidPose pose, const std::string& whose) {
    if (!is_finite(pose.position) || !is_finite(pose.rotation) || !is_finite(pose.velocity) ||
        !is_finite(pose.angular_velocity)) {
        throw std::invalid_argument(whose + ": its pose is not finite");
    }
    // Newton's iteration for the nearest orthogonal matrix, R <- R - (R R^T - 1) R / 2, squares the error.
    for (int iteration = 0; iteration < 3; ++iteration) {
        const Matrix r = pose.rotation;
        double largest = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b) {
                double error = a == b ? -1 : 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    error += r[3 * a + c] * r[3 * b + c];
                }
                largest = std::max(largest, std::abs(error));
                for (std::size_t c = 0; c < 3; ++c) {
                    pose.rotation[3 * a + c] -= error * r[3 * b + c] / 2;
                }
            }
        }
        if (largest > 1e-5) {
            throw std::invalid_argument(whose + ": its rotation must be a matrix of three orthonormal rows, to 1e-5");
        }
        if (largest <= 1e-9) { // of an engine in double: taken as it is
            pose.rotation = r;
            break;
        }
    }
    return pose;
}

namespace {

/// The shape with a normal of unit length.
ObstacleShape checked(const ObstacleShape& shape, std::size_t obstacle) {
    if (const auto* plane = std::get_if<PlaneShape>(&shape)) {
        const Point& n = plane->normal;
        const double size = std::hypot(n[0], n[1], n[2]);
        if (!std::isfinite(size) || !(size > 0)) {
            refuse_obstacle(obstacle, "the normal of its plane must be finite and not zero");
        }
        return PlaneShape{{n[0] / size, n[1] / size, n[2] / size}};
    }
    const auto check_radius = [&](double radius) {
        if (!std::isfinite(radius) || !(radius > 0)) {
            refuse_obstacle(obstacle,
                            "radius = " + std::to_string(radius) + " is not allowed: it must be finite and > 0");
        }
    };
    if (const auto* sphere = std::get_if<SphereShape>(&shape)) {
        check_radius(sphere->radius);
    }
    if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
        check_radius(capsule->radius);
        if (!std::isfinite(dot(capsule->axis, capsule->axis))) {
            refuse_obstacle(obstacle, "the axis of its capsule must be finite");
        }
    }
    if (!is_made(shape)) {
        refuse_obstacle(obstacle,
                        "its hull, mesh or height field is empty: it must be made of points, triangles or heights");
    }
    if (const auto* box = std::get_if<BoxShape>(&shape)) {
        for (const double size : box->size) {
            if (!std::isfinite(size) || !(size > 0)) {
                refuse_obstacle(obstacle,
                                "size = " + std::to_string(size) + " is not allowed: it must be finite and > 0");
            }
        }
    }
    return shape;
}

} // namespace

std::vector<Obstacle> completed(std::span<const Obstacle> given, double body_time_step) {
    std::vector<Obstacle> obstacles(given.begin(), given.end());
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
        Obstacle& obstacle = obstacles[o];
        obstacle.shape = checked(obstacle.shape, o);
        obstacle.pose = rigid(obstacle.pose, name_of(o));
        const auto require_from_0 = [&](const char* what, double value) {
            if (!std::isfinite(value) || value < 0) {
                refuse_obstacle(o, std::string(what) + " = " + std::to_string(value) +
                                       " is not allowed: it must be finite and at least 0");
            }
        };
        require_from_0("friction", obstacle.friction);
        require_from_0("stiffness", obstacle.stiffness);
        require_from_0("friction_delay", obstacle.friction_delay);
        require_from_0("mass", obstacle.mass);
        if (obstacle.mass > 0) {
            if (std::holds_alternative<PlaneShape>(obstacle.shape) ||
                std::holds_alternative<HeightShape>(obstacle.shape)) {
                refuse_obstacle(o, "mass = " + std::to_string(obstacle.mass) +
                                       " is not allowed: a plane and a height field have no end, and cannot be free");
            }
            if (obstacle.inertia == Point{0, 0, 0}) {
                obstacle.inertia = inertia_of(obstacle.shape, obstacle.mass, o);
            }
            for (const double moment : obstacle.inertia) {
                if (!std::isfinite(moment) || !(moment > 0)) {
                    refuse_obstacle(o, "inertia = " + std::to_string(moment) +
                                           " is not allowed: all three must be finite and > 0");
                }
            }
        }
        if (obstacle.stiffness == 0) {
            if (!std::isfinite(body_time_step)) {
                refuse_obstacle(o, "stiffness = 0 is not allowed: the body has none of its own");
            }
            obstacle.stiffness = default_contact_stiffness(body_time_step);
        }
        if (obstacle.friction_delay == 0 && std::isfinite(body_time_step)) { // without springs nothing flutters
            obstacle.friction_delay = default_friction_delay(body_time_step);
        }
    }
    return obstacles;
}

void require_led(std::span<const Obstacle> obstacles, const char* why) {
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
        if (obstacles[o].mass > 0) {
            refuse_obstacle(o, "mass = " + std::to_string(obstacles[o].mass) + " is not allowed: " + why);
        }
    }
}

std::vector<RigidPose> rigid(std::span<const RigidPose> poses, std::size_t obstacles) {
    if (poses.size() != obstacles) {
        throw std::invalid_argument(std::to_string(poses.size()) + " poses given for " + std::to_string(obstacles) +
                                    " obstacles: there must be as many");
    }
    std::vector<RigidPose> made;
    for (std::size_t o = 0; o < poses.size(); ++o) {
        made.push_back(rigid(poses[o], name_of(o)));
    }
    return made;
}

void check_node(const SurfaceNode& node, std::size_t nodes) {
    if (node.node >= nodes || !is_finite(node.rest_position)) {
        throw std::invalid_argument("surface node " + std::to_string(node.node) + ": it must be below the body's " +
                                    std::to_string(nodes) + " nodes, and its position finite");
    }
}

template <class T>
Contact<T>::Contact(const Body<T>& body, double wave_speed, std::span<const SurfaceNode> surface,
                    std::span<const Obstacle> obstacles)
    : length_unit_(body.length_unit()), wave_speed_(wave_speed),
      obstacles_(completed(obstacles, body.critical_time_step())) {
    if (!surface.empty()) {
        known_ = surface.front();
    }
    // Neighbours together: blocks of space about as large as a block of nodes on a face.
    Point low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (std::size_t s = 0; s < surface.size(); ++s) {
        check_node(surface[s], body.node_count());
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], surface[s].rest_position[a]);
            high[a] = std::max(high[a], surface[s].rest_position[a]);
        }
    }
    std::vector<SurfaceNode> sorted(surface.begin(), surface.end());
    const double edge =
        surface.empty() ? 1
                        : std::max(length(plus(high, -1, low)) *
                                       std::sqrt(static_cast<double>(kBlock) / 4 / static_cast<double>(surface.size())),
                                   std::numeric_limits<double>::min());
    const auto key = [&](const SurfaceNode& node) {
        const auto at = [&](std::size_t a) { return std::floor((node.rest_position[a] - low[a]) / edge); };
        return std::tuple(at(2), at(1), at(0), node.node);
    };
    std::sort(sorted.begin(), sorted.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
    for (std::size_t s = 0; s < sorted.size(); ++s) {
        if (s > 0 && sorted[s].node == sorted[s - 1].node) {
            throw std::invalid_argument("surface node " + std::to_string(sorted[s].node) +
                                        " is given twice: each may be given once");
        }
        nodes_.push_back({sorted[s].rest_position, body.index_of(sorted[s].node), body.masses()[sorted[s].node]});
    }
    before_.resize(nodes_.size());
    grips_.resize(obstacles_.size());
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        grips_[o].resize(has_friction(o) ? nodes_.size() : 0);
    }
    for (const Obstacle& obstacle : obstacles_) {
        Point spin = from_space(obstacle.pose.rotation, obstacle.pose.angular_velocity);
        for (std::size_t a = 0; a < 3; ++a) {
            spin[a] *= obstacle.inertia[a];
        }
        motions_.push_back({obstacle.pose, to_space(obstacle.pose.rotation, spin)});
    }
    shared_.assign(obstacles_.size(), false);
    watches_.assign(obstacles_.size(), std::vector<Watch>(block_count()));
    elapsed_.assign(piece_count(), 0.0);
}

template <class T>
void Contact<T>::move(std::span<const RigidPose> poses) {
    const std::vector<RigidPose> made = rigid(poses, obstacles_.size()); // refused before any is moved
    for (std::size_t o = 0; o < made.size(); ++o) {
        if (is_free(o)) {
            continue;
        }
        const RigidPose before = pose_after(o, elapsed());
        const RigidPose& pose = made[o];
        const bool turns =
            before.rotation != pose.rotation && !std::holds_alternative<SphereShape>(obstacles_[o].shape);
        const double way =
            turns ? std::numeric_limits<double>::infinity() : length(plus(pose.position, -1, before.position));
        const double faster = length(pose.velocity) - length(before.velocity);
        for (Watch& watch : watches_[o]) {
            watch.near -= way;
            watch.speed += std::max(2 * faster, 0.0);
        }
        obstacles_[o].pose = pose;
    }
    std::fill(elapsed_.begin(), elapsed_.end(), 0.0);
}

template <class T>
void Contact<T>::body_was_cut(const Body<T>& body, const Lattice& lattice, const NodeNumbers& numbers,
                              std::span<const CutNode> nodes) {
    if (!known_) { // nothing could touch before, and the cut lays nothing bare
        return;
    }
    const Point low = lattice.rest_position(numbers.grid_node(known_->node));
    for (const CutNode& node : nodes) {
        Point rest = known_->rest_position;
        for (std::size_t a = 0; a < 3; ++a) {
            rest[a] += lattice.cell_size() * static_cast<double>(node.place[a]) - low[a];
        }
        node_was_cut(body, node.node, rest);
    }
    elapsed_.resize(piece_count(), elapsed());
}

template <class T>
void Contact<T>::number_nodes() {
    if (numbers_.empty()) {
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            numbers_[nodes_[n].index] = n;
        }
    }
}

// New nodes come last, in the order in which the cells around them were removed, those without mass too: a body that is
// cut again in another number of calls has the same blocks and the same memory.
template <class T>
void Contact<T>::node_was_cut(const Body<T>& body, std::uint32_t number, const Point& rest) {
    number_nodes();
    const std::size_t index = body.index_of(number);
    const auto [entry, is_new] = numbers_.try_emplace(index, nodes_.size());
    if (is_new) {
        nodes_.push_back({rest, index, 0});
        before_.emplace_back();
        for (const PrescribedComponent<T>& p : prescribed_) {
            nodes_.back().held |= static_cast<std::uint8_t>(p.index == index ? 1 << p.axis : 0);
        }
    }
    nodes_[entry->second].mass = body.masses()[number];
    for (std::size_t o = 0; is_new && o < obstacles_.size(); ++o) {
        grips_[o].resize(has_friction(o) ? nodes_.size() : 0);
        watches_[o].resize(block_count());
        watches_[o].back().near = 0;
    }
}

// The time since the obstacles were moved and the last time step; then for every obstacle eight numbers a block, and
// four a node where there is friction, and 22 of a free one. What blocks wait for is not kept: looking earlier finds
// nothing.
template <class T>
std::size_t Contact<T>::memory_size() const {
    std::size_t size = 2;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        size += 8 * watches_[o].size() + 4 * grips_[o].size() + (is_free(o) ? 22 : 0);
    }
    return size;
}

template <class T>
std::vector<double> Contact<T>::memory() const {
    std::vector<double> memory = {elapsed(), time_step_};
    memory.reserve(memory_size());
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        for (const Watch& watch : watches_[o]) {
            memory.insert(memory.end(), {watch.dissipated, watch.greatest_depth});
            for (const Point* sum : {&watch.impulse, &watch.angular_impulse}) {
                memory.insert(memory.end(), sum->begin(), sum->end());
            }
        }
        for (const Grip& grip : grips_[o]) {
            memory.insert(memory.end(), grip.friction.begin(), grip.friction.end());
            memory.push_back(grip.push);
        }
        if (is_free(o)) {
            const RigidPose& pose = motions_[o].pose;
            memory.insert(memory.end(), pose.rotation.begin(), pose.rotation.end());
            for (const Point* part : {&pose.position, &pose.velocity, &pose.angular_velocity, &motions_[o].spin}) {
                memory.insert(memory.end(), part->begin(), part->end());
            }
            memory.push_back(motions_[o].work_of_gravity);
        }
    }
    return memory;
}

template <class T>
void Contact<T>::set_memory(std::span<const double> memory) {
    const double* next = memory.data();
    std::fill(elapsed_.begin(), elapsed_.end(), *next++);
    time_step_ = *next++;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        for (Watch& watch : watches_[o]) {
            watch.near = 0;
            watch.dissipated = *next++;
            watch.greatest_depth = *next++;
            for (Point* sum : {&watch.impulse, &watch.angular_impulse}) {
                next = (std::copy_n(next, 3, sum->begin()), next + 3);
            }
        }
        for (Grip& grip : grips_[o]) {
            next = (std::copy_n(next, 3, grip.friction.begin()), next + 3);
            grip.push = *next++;
        }
        if (is_free(o)) {
            RigidPose& pose = motions_[o].pose;
            next = (std::copy_n(next, 9, pose.rotation.begin()), next + 9);
            for (Point* part : {&pose.position, &pose.velocity, &pose.angular_velocity, &motions_[o].spin}) {
                next = (std::copy_n(next, 3, part->begin()), next + 3);
            }
            motions_[o].work_of_gravity = *next++;
        }
    }
}

// How a moving body comes by obstacles.

template <class T>
void ExplicitDynamics<T>::set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles) {
    Implementation& i = *implementation_;
    i.template replace<ObstacleEffect<T>>(
        obstacles.empty() ? nullptr : std::make_unique<Contact<T>>(*i.body, i.wave_speed, surface, obstacles));
}

template <class T>
void ExplicitDynamics<T>::move_obstacles(std::span<const RigidPose> poses) {
    if (auto* const contact = implementation_->template find<ObstacleEffect<T>>()) {
        contact->move(poses);
    } else if (!poses.empty()) {
        throw std::invalid_argument(std::to_string(poses.size()) + " poses given: the body has no obstacles");
    }
}

template <class T>
std::vector<RigidPose> ExplicitDynamics<T>::obstacle_poses() const {
    const Implementation& i = *implementation_;
    const auto* const contact = i.template find<ObstacleEffect<T>>();
    if (!contact) {
        return {};
    }
    const std::optional<StepFactors> half = i.half ? std::optional(half_kick(*i.half)) : std::nullopt;
    return contact->poses(i.state, half ? &*half : nullptr);
}

template <class T>
std::vector<ObstacleReading> ExplicitDynamics<T>::obstacle_readings() const {
    const Implementation& i = *implementation_;
    const auto* const contact = i.template find<ObstacleEffect<T>>();
    return contact ? i.at_whole_step([&] { return contact->readings(*i.body, i.state); })
                   : std::vector<ObstacleReading>();
}

template <class T>
void ExplicitDynamics<T>::get_contact_forces(VectorField<T> out) const {
    const Implementation& i = *implementation_;
    NodeField<T> force;
    Body<T>::allocate_like(i.state.velocity, force);
    if (const auto* const contact = i.template find<ObstacleEffect<T>>()) {
        i.at_whole_step([&] { contact->add_forces(*i.body, i.state, force); });
    }
    i.body->read(force, 1, out);
}

template Contact<float>::Contact(const Body<float>&, double, std::span<const SurfaceNode>, std::span<const Obstacle>);
template void Contact<float>::node_was_cut(const Body<float>&, std::uint32_t, const Point&);
template void Contact<float>::move(std::span<const RigidPose>);
template void Contact<float>::number_nodes();
template void Contact<float>::body_was_cut(const Body<float>&, const Lattice&, const NodeNumbers&,
                                           std::span<const CutNode>);
template std::size_t Contact<float>::memory_size() const;
template std::vector<double> Contact<float>::memory() const;
template void Contact<float>::set_memory(std::span<const double>);
template void ExplicitDynamics<float>::set_obstacles(std::span<const SurfaceNode>, std::span<const Obstacle>);
template void ExplicitDynamics<float>::move_obstacles(std::span<const RigidPose>);
template std::vector<ObstacleReading> ExplicitDynamics<float>::obstacle_readings() const;
template std::vector<RigidPose> ExplicitDynamics<float>::obstacle_poses() const;
template void ExplicitDynamics<float>::get_contact_forces(VectorField<float>) const;
template Contact<double>::Contact(const Body<double>&, double, std::span<const SurfaceNode>, std::span<const Obstacle>);
template void Contact<double>::node_was_cut(const Body<double>&, std::uint32_t, const Point&);
template void Contact<double>::move(std::span<const RigidPose>);
template void Contact<double>::number_nodes();
template void Contact<double>::body_was_cut(const Body<double>&, const Lattice&, const NodeNumbers&,
                                            std::span<const CutNode>);
template std::size_t Contact<double>::memory_size() const;
template std::vector<double> Contact<double>::memory() const;
template void Contact<double>::set_memory(std::span<const double>);
template void ExplicitDynamics<double>::set_obstacles(std::span<const SurfaceNode>, std::span<const Obstacle>);
template void ExplicitDynamics<double>::move_obstacles(std::span<const RigidPose>);
template std::vector<ObstacleReading> ExplicitDynamics<double>::obstacle_readings() const;
template std::vector<RigidPose> ExplicitDynamics<double>::obstacle_poses() const;
template void ExplicitDynamics<double>::get_contact_forces(VectorField<double>) const;

} // namespace hybmss
