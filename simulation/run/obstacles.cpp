#include "simulation/run/boundary_conditions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace hybmss {

// Of dynamics/contact/obstacle_geometry.hpp, whose products of vectors are here beside others where files are joined.
double middle_of(const ObstacleShape& shape);
bool is_made(const ObstacleShape& shape);
std::array<double, 3> inertia_of(const ObstacleShape& shape, double mass, std::size_t number); // of free_obstacle.hpp

namespace {

bool moves(const SceneObstacle& entry) {
    return entry.translate || entry.rotate;
}

/// The rotation by `angle` about a coordinate axis, row by row.
std::array<double, 9> rotation_about(int axis, double angle) {
    const auto n = static_cast<std::size_t>(axis), i = (n + 1) % 3, j = (n + 2) % 3;
    std::array<double, 9> r{};
    r[3 * n + n] = 1;
    r[3 * i + i] = r[3 * j + j] = std::cos(angle);
    r[3 * j + i] = std::sin(angle);
    r[3 * i + j] = -r[3 * j + i];
    return r;
}

/// Nodes alone touch obstacles, and a node in an obstacle is pushed out on the nearest side.
void check_size(const Scene& scene, std::size_t number) {
    const std::string path = "obstacle[" + std::to_string(number) + "].";
    const double h = scene.body.cell_size;
    const ObstacleShape& shape = scene.obstacles[number].shape;
    const auto check_radius = [&](std::string_view name, double radius) {
        if (radius < h) {
            throw scene_error(scene, path + std::string(name) + ".radius",
                              "it must be at least the cell size, " + std::to_string(h) + " m: a smaller " +
                                  std::string(name) + " slips between the body's nodes");
        }
    };
    if (const auto* sphere = std::get_if<SphereShape>(&shape)) {
        check_radius("sphere", sphere->radius);
    }
    if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
        check_radius("capsule", capsule->radius);
    }
    if (const auto* box = std::get_if<BoxShape>(&shape);
        box && *std::min_element(box->size.begin(), box->size.end()) < h) {
        throw scene_error(scene, path + "box",
                          "every edge must be at least the cell size, " + std::to_string(h) +
                              " m, long: the body's nodes may pass through a thinner box, or it between them");
    }
    if (!is_made(shape)) {
        throw scene_error(scene, path + std::string(shape_key(shape)),
                          "it is empty: it must have points, triangles or heights");
    }
    if (std::holds_alternative<HullShape>(shape) || std::holds_alternative<MeshShape>(shape)) {
        const double across = 2 * middle_of(shape);
        if (across < h) {
            throw scene_error(scene, path + std::string(shape_key(shape)),
                              "it is " + std::to_string(across) + " m thick: it must be at least the cell size, " +
                                  std::to_string(h) + " m, or it slips between the body's nodes");
        }
    }
}

/// Throws what is one line for the scene.
void check_free(const Scene& scene, std::size_t number) {
    const SceneObstacle& entry = scene.obstacles[number];
    const std::string path = "obstacle[" + std::to_string(number) + "].";
    if (!explicit_in_time(scene.solver.method)) {
        throw scene_error(scene, path + "mass",
                          "a free obstacle moves with \"symplectic-euler\" and \"leapfrog\" only: with another method "
                          "obstacles have no mass");
    }
    if (scene.body.skin_touches) {
        throw scene_error(scene, path + "mass",
                          "a skin touches obstacles that are led: with body.contact = \"skin\" obstacles have no mass");
    }
    if (entry.inertia == Vector3{0, 0, 0}) {
        try {
            static_cast<void>(inertia_of(entry.shape, entry.mass, number));
        } catch (const std::invalid_argument& refused) {
            const std::string why = refused.what();
            throw scene_error(scene, path + "mass", why.substr(why.find(": ") + 2));
        }
    }
}

} // namespace

std::string_view shape_key(const ObstacleShape& shape) {
    return std::array<std::string_view, 7>{
        "plane", "sphere", "box", "capsule", "hull", "mesh", "height"}[shape.index()];
}

Obstacles::Obstacles(const Scene& scene, double body_time_step)
    : entries_(scene.obstacles), cell_size_(scene.body.cell_size),
      extent_(cell_size_ * static_cast<double>(*std::max_element(scene.body.cells.begin(), scene.body.cells.end()))),
      is_static_(timeless(scene.solver.method)) {
    if (!entries_.empty() && is_static_ && scene.solver.method != SolverMethod::static_equilibrium) {
        throw scene_error(scene, "solver.method",
                          "a scene with [[obstacle]] must be solved by another one: what touches and what does not is "
                          "no linear problem");
    }
    for (std::size_t o = 0; o < entries_.size(); ++o) {
        const SceneObstacle& entry = entries_[o];
        check_size(scene, o);
        if (entry.mass > 0) {
            check_free(scene, o);
        }
        const std::string path = "obstacle[" + std::to_string(o) + "].";
        if (entry.friction > 0 && !explicit_in_time(scene.solver.method)) {
            throw scene_error(scene, path + "friction",
                              "friction is computed by \"symplectic-euler\" and \"leapfrog\" only: with another method "
                              "it must be 0");
        }
        if (is_static_ && entry.velocity != Vector3{0, 0, 0}) {
            throw scene_error(scene, path + "velocity",
                              "an equilibrium has no time: `translate` leads an obstacle along the load steps");
        }
        // On a flat surface a node with c cells around it has the mass rho h^3 c/8 and the area h^2 c/4.
        const double stiffness = entry.stiffness
                                     ? *entry.stiffness * 2 / (scene.material.density * scene.body.cell_size)
                                     : default_contact_stiffness(body_time_step);
        obstacles_.push_back({entry.shape,
                              {.position = entry.position},
                              entry.friction,
                              stiffness,
                              default_friction_delay(body_time_step),
                              entry.mass,
                              entry.inertia});
        if (moves(entry)) {
            end_of_motion_ = std::max(end_of_motion_, entry.over);
        }
        if (entry.velocity != Vector3{0, 0, 0} && entry.mass == 0) {
            end_of_motion_ = std::numeric_limits<double>::infinity();
        }
    }
    poses_.resize(entries_.size());
    angles_.resize(entries_.size());
    at(0);
    for (std::size_t o = 0; o < entries_.size(); ++o) {
        obstacles_[o].pose = poses_[o];
    }
}

std::span<const RigidPose> Obstacles::at(double time) {
    for (std::size_t o = 0; o < entries_.size(); ++o) {
        const SceneObstacle& entry = entries_[o];
        Ramp s = is_static_ ? Ramp{.value = time} : ramp(time, entry.over);
        if (time_step_ > 0 && !is_static_) {
            s.rate = (ramp(time + time_step_, entry.over).value - s.value) / time_step_;
        }
        RigidPose& pose = poses_[o];
        for (std::size_t a = 0; a < 3; ++a) {
            const double way = entry.translate ? (*entry.translate)[a] : 0;
            pose.position[a] = entry.position[a] + s.value * way + entry.velocity[a] * time;
            pose.velocity[a] = s.rate * way + entry.velocity[a];
        }
        if (entry.rotate) {
            const double whole = entry.rotate->degrees * std::numbers::pi / 180;
            const auto axis = static_cast<std::size_t>(entry.rotate->axis);
            angles_[o][axis] = s.value * whole;
            pose.angular_velocity[axis] = s.rate * whole;
            pose.rotation = rotation_about(entry.rotate->axis, s.value * whole);
        }
    }
    return poses_;
}

double Obstacles::steps_to_press() const {
    double steps = 1;
    for (std::size_t o = 0; o < entries_.size(); ++o) {
        const SceneObstacle& entry = entries_[o];
        const Vector3 led = entry.translate.value_or(Vector3{0, 0, 0});
        double way = std::hypot(led[0], led[1], led[2]);
        if (entry.rotate && !std::holds_alternative<SphereShape>(entry.shape)) {
            way += extent_ * std::abs(entry.rotate->degrees) * std::numbers::pi / 180;
        }
        steps = std::max(steps, std::ceil(way / (2 * cell_size_)));
    }
    return std::min(steps, 1000.0);
}

double Obstacles::greatest_good_depth(std::size_t obstacle) const {
    return std::min(cell_size_, middle_of(obstacles_[obstacle].shape) / 2);
}

} // namespace hybmss
