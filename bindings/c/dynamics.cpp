#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/world.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss::c_interface {
namespace {

/// Where a body is at rest, and what is left of it.
struct Place {
    std::array<double, 3> origin = {0, 0, 0}; ///< m, of a lattice's low corner
    std::optional<Lattice> cut = {};          ///< what cells there are; none before the first cut

    /// The lattice to cut, of what the body was made of.
    Lattice& to_cut(const hybmss_body& body) {
        const Lattice& whole = lattice_of(body, "a lattice has cells to remove").lattice;
        return cut ? *cut : cut.emplace(whole);
    }
};

template <class T>
struct Moving {
    std::shared_ptr<ExplicitDynamics<T>> owned; ///< by this alone, or lent by a world that lives as long
    ExplicitDynamics<T>& body;
    mutable Scratch<T> scratch;
    std::shared_ptr<Place> place = std::make_shared<Place>(); ///< a world knows it too

    Moving(const hybmss_body& shape, const PlanOptions& options)
        : Moving(std::make_shared<ExplicitDynamics<T>>(made_of<ExplicitDynamics<T>>(shape, options))) {}
    explicit Moving(std::shared_ptr<ExplicitDynamics<T>> lent) : owned(std::move(lent)), body(*owned) {}

    /// get(view) writes the view.
    template <class Get>
    void read(const hybmss_field* out, const Get& get) const {
        check<T>(out, body.node_count(), "out");
        const Output<T> field(*out, body.node_count(), scratch);
        get(field.view());
        field.set();
    }
    /// set(view) reads the view.
    template <class Set>
    void write(const hybmss_const_field* in, const Set& set) const {
        check<T>(in, body.node_count(), "in");
        set(Input<T>(*in, body.node_count(), scratch).view());
    }
};

/// Those of a body in the order of its nodes, also where they are fewer after cuts.
std::vector<SurfaceNode> surface_of(const hybmss_body& body, const Place& place) {
    if (const auto* network = std::get_if<Network>(&body.shape)) {
        return surface_nodes(*network);
    }
    const Lattice& whole = std::get<LatticeBody>(body.shape).lattice;
    if (!place.cut) {
        return surface_nodes(whole, place.origin);
    }
    std::vector<SurfaceNode> surface = surface_nodes(*place.cut, place.origin);
    const std::vector<std::uint32_t> grid = place.cut->nodes(), all = whole.nodes();
    for (SurfaceNode& node : surface) {
        node.node = static_cast<std::uint32_t>(std::lower_bound(all.begin(), all.end(), grid[node.node]) - all.begin());
    }
    return surface;
}

hybmss_obstacle_reading reading_of(const ObstacleReading& read) {
    hybmss_obstacle_reading out{};
    std::copy(read.force.begin(), read.force.end(), out.force);
    std::copy(read.torque.begin(), read.torque.end(), out.torque);
    out.depth = read.depth;
    out.greatest_depth = read.greatest_depth;
    out.energy = read.energy;
    out.dissipated = read.dissipated;
    std::copy(read.impulse.begin(), read.impulse.end(), out.impulse);
    std::copy(read.angular_impulse.begin(), read.angular_impulse.end(), out.angular_impulse);
    out.nodes = read.nodes;
    return out;
}

template <class T>
struct Together {
    std::shared_ptr<World<T>> world;            ///< bodies that it has lent keep it alive
    std::vector<std::shared_ptr<Place>> places; ///< of its bodies

    explicit Together(int threads) : world(std::make_shared<World<T>>(threads)) {}
};

StepParameters step_parameters(const hybmss_step_parameters* given) {
    require(given, "parameters");
    if (given->integrator != HYBMSS_SYMPLECTIC_EULER && given->integrator != HYBMSS_LEAPFROG) {
        throw std::invalid_argument("integrator = " + std::to_string(given->integrator) +
                                    " is not allowed: it must be 0 (HYBMSS_SYMPLECTIC_EULER) or 1 (HYBMSS_LEAPFROG)");
    }
    const double* g = given->acceleration;
    return {given->time_step, {g[0], g[1], g[2]}, given->mass_damping, static_cast<Integrator>(given->integrator)};
}

long steps(std::int64_t count) {
    if (count < 0) {
        throw std::invalid_argument("count = " + std::to_string(count) + " is not allowed: it must be at least 0");
    }
    return static_cast<long>(count);
}

Anchor anchor(const hybmss_anchor* given, const char* name) {
    require(given, name);
    Anchor out;
    if (given->body != HYBMSS_IN_SPACE) {
        out.body = given->body;
    }
    std::copy_n(given->point, 3, out.point.begin());
    return out;
}

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_dynamics {
    std::variant<std::unique_ptr<Moving<float>>, std::unique_ptr<Moving<double>>> held;
};
struct hybmss_world {
    std::variant<std::unique_ptr<Together<float>>, std::unique_ptr<Together<double>>> held;
};

extern "C" {

hybmss_status hybmss_dynamics_create(const hybmss_body* body, hybmss_precision precision,
                                     const hybmss_plan_options* options, hybmss_dynamics** dynamics) {
    return create<Moving>(body, precision, options, dynamics, "dynamics");
}

void hybmss_dynamics_destroy(hybmss_dynamics* dynamics) {
    delete dynamics;
}

hybmss_status hybmss_dynamics_prescribe(hybmss_dynamics* dynamics, const hybmss_prescribed_node* nodes, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(nodes, "nodes", count);
        std::vector<PrescribedNode> prescribed;
        std::transform(nodes, nodes + count, std::back_inserter(prescribed), prescribed_node);
        moving.body.prescribe(prescribed);
    });
}

hybmss_status hybmss_dynamics_load(hybmss_dynamics* dynamics, const hybmss_nodal_load* loads, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(loads, "loads", count);
        std::vector<NodalLoad> given;
        std::transform(loads, loads + count, std::back_inserter(given), [](const hybmss_nodal_load& load) {
            return NodalLoad{load.node, {load.force[0], load.force[1], load.force[2]}};
        });
        moving.body.load(given);
    });
}

hybmss_status hybmss_body_surface_faces(const hybmss_body* body, uint32_t* nodes, size_t* count) {
    return guarded([&] {
        require(body, "body");
        require(count, "count");
        const auto* const network = std::get_if<Network>(&body->shape);
        const std::vector<SurfaceFace> faces =
            network ? surface_faces(*network) : surface_faces(std::get<LatticeBody>(body->shape).lattice);
        for (std::size_t f = 0; nodes && f < faces.size(); ++f) {
            std::copy(faces[f].nodes.begin(), faces[f].nodes.end(), nodes + 4 * f);
        }
        *count = faces.size();
    });
}

hybmss_status hybmss_dynamics_press(hybmss_dynamics* dynamics, const hybmss_body* body, const uint32_t* nodes,
                                    const double* pressures, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count(), "dynamics");
        require(nodes, "nodes", count);
        require(pressures, "pressures", count);
        moving.body.press(faces_of(*body, nodes, count, moving.place->origin), {pressures, count});
    });
}

hybmss_status hybmss_dynamics_set_pressures(hybmss_dynamics* dynamics, const double* pressures, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(pressures, "pressures", count);
        moving.body.set_pressures({pressures, count});
    });
}

hybmss_status hybmss_dynamics_damp_springs(hybmss_dynamics* dynamics, double stiffness_damping) {
    return guarded(dynamics, "dynamics", [&](auto& moving) { moving.body.damp_springs(stiffness_damping); });
}

hybmss_status hybmss_dynamics_relax(hybmss_dynamics* dynamics, const hybmss_body* body,
                                    const hybmss_relaxation* branches, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count(), "dynamics");
        require(branches, "branches", count);
        const LatticeBody& whole = lattice_of(*body, "a lattice has a material that relaxes");
        std::vector<Relaxation> given;
        for (std::size_t b = 0; b < count; ++b) {
            given.push_back({branches[b].part, branches[b].time});
        }
        moving.body.relax(moving.place->cut ? *moving.place->cut : whole.lattice, whole.material, given);
    });
}

hybmss_status hybmss_dynamics_actuate(hybmss_dynamics* dynamics, const hybmss_body* body, const uint32_t* cells,
                                      const double* stretches, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count(), "dynamics");
        require(cells, "cells", count);
        const std::vector<RestStretch> given = stretches_of(stretches, count);
        const LatticeBody& whole = lattice_of(*body, "a lattice has cells of another size at rest");
        moving.body.actuate(moving.place->cut ? *moving.place->cut : whole.lattice, whole.material, {cells, count},
                            given);
    });
}

hybmss_status hybmss_dynamics_set_rest_stretches(hybmss_dynamics* dynamics, const double* stretches, size_t count) {
    return guarded(dynamics, "dynamics",
                   [&](auto& moving) { moving.body.set_rest_stretches(stretches_of(stretches, count)); });
}

hybmss_status hybmss_dynamics_remove_cells(hybmss_dynamics* dynamics, const hybmss_body* body, const uint32_t* cells,
                                           size_t count, size_t* removed) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count(), "dynamics");
        require(cells, "cells", count);
        const std::size_t gone = moving.body.remove_cells(moving.place->to_cut(*body), {cells, count});
        if (removed) {
            *removed = gone;
        }
    });
}

hybmss_status hybmss_solid_create_hull(const double* points, size_t count, hybmss_solid** solid) {
    return guarded([&] {
        require(solid, "solid");
        require_entries(points, "points", count, 3 * sizeof(double));
        std::vector<std::array<double, 3>> given(count);
        for (std::size_t p = 0; p < count; ++p) {
            std::copy_n(points + 3 * p, 3, given[p].begin());
        }
        *solid = new hybmss_solid{HullShape(given)};
    });
}

hybmss_status hybmss_solid_create_mesh(const double* vertices, size_t vertex_count, const uint32_t* triangles,
                                       size_t triangle_count, int32_t cells, hybmss_solid** solid) {
    return guarded([&] {
        require(solid, "solid");
        const TriangleMesh mesh = mesh_of(vertices, vertex_count, triangles, triangle_count);
        *solid = new hybmss_solid{MeshShape(mesh.vertices, mesh.triangles, cells == 0 ? 64 : cells)};
    });
}

hybmss_status hybmss_solid_create_heights(const double* heights, const size_t counts[2], const double spacing[2],
                                          hybmss_solid** solid) {
    return guarded([&] {
        require(solid, "solid");
        require(counts, "counts");
        require(spacing, "spacing");
        // Counts whose product overflows are refused by the shape.
        const std::size_t count =
            counts[1] == 0 || counts[0] > (std::size_t{1} << 26) / counts[1] ? 0 : counts[0] * counts[1];
        require(heights, "heights", count);
        *solid = new hybmss_solid{
            HeightShape({counts[0], counts[1]}, {spacing[0], spacing[1]}, std::span<const double>(heights, count))};
    });
}

void hybmss_solid_destroy(hybmss_solid* solid) {
    delete solid;
}

hybmss_status hybmss_dynamics_set_obstacles(hybmss_dynamics* dynamics, const hybmss_body* body,
                                            const hybmss_obstacle* obstacles, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count(), "dynamics");
        require(obstacles, "obstacles", count);
        std::vector<Obstacle> given;
        std::transform(obstacles, obstacles + count, std::back_inserter(given), obstacle_of);
        moving.body.set_obstacles(surface_of(*body, *moving.place), given);
    });
}

hybmss_status hybmss_dynamics_set_skin_obstacles(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                 const double* vertices, size_t vertex_count, const uint32_t* triangles,
                                                 size_t triangle_count, const hybmss_obstacle* obstacles,
                                                 size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count(), "dynamics");
        const Lattice& lattice = lattice_of(*body, "a lattice has a skin").lattice;
        const TriangleMesh mesh = mesh_of(vertices, vertex_count, triangles, triangle_count);
        require(obstacles, "obstacles", count);
        std::vector<Obstacle> given;
        std::transform(obstacles, obstacles + count, std::back_inserter(given), obstacle_of);
        moving.body.set_skin_obstacles(skin_points(lattice, mesh, moving.place->origin), given);
    });
}

hybmss_status hybmss_dynamics_move_obstacles(hybmss_dynamics* dynamics, const hybmss_pose* poses, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(poses, "poses", count);
        std::vector<RigidPose> given;
        std::transform(poses, poses + count, std::back_inserter(given), pose_of);
        moving.body.move_obstacles(given);
    });
}

hybmss_status hybmss_dynamics_obstacle_poses(const hybmss_dynamics* dynamics, hybmss_pose* poses, size_t count) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(poses, "poses", count);
        const std::vector<RigidPose> now = moving.body.obstacle_poses();
        require_count(count, now.size(), "poses");
        std::transform(now.begin(), now.end(), poses, [](const RigidPose& pose) {
            hybmss_pose out{};
            std::copy_n(pose.position.begin(), 3, out.position);
            std::copy_n(pose.rotation.begin(), 9, out.rotation);
            std::copy_n(pose.velocity.begin(), 3, out.velocity);
            std::copy_n(pose.angular_velocity.begin(), 3, out.angular_velocity);
            return out;
        });
    });
}

hybmss_status hybmss_dynamics_obstacle_readings(const hybmss_dynamics* dynamics, hybmss_obstacle_reading* readings,
                                                size_t count) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(readings, "readings", count);
        const std::vector<ObstacleReading> read = moving.body.obstacle_readings();
        require_count(count, read.size(), "readings");
        std::transform(read.begin(), read.end(), readings, reading_of);
    });
}

hybmss_status hybmss_dynamics_step(hybmss_dynamics* dynamics, const hybmss_step_parameters* parameters, int64_t count) {
    return guarded(dynamics, "dynamics",
                   [&](auto& moving) { moving.body.step(step_parameters(parameters), steps(count)); });
}

hybmss_status hybmss_dynamics_get_displacements(const hybmss_dynamics* dynamics, const hybmss_field* out) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        moving.read(out, [&](const auto& view) { moving.body.get_displacements(view); });
    });
}

hybmss_status hybmss_dynamics_get_velocities(const hybmss_dynamics* dynamics, const hybmss_field* out) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        moving.read(out, [&](const auto& view) { moving.body.get_velocities(view); });
    });
}

hybmss_status hybmss_dynamics_get_forces(const hybmss_dynamics* dynamics, const hybmss_field* out) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        moving.read(out, [&](const auto& view) { moving.body.get_forces(view); });
    });
}

hybmss_status hybmss_dynamics_set_displacements(hybmss_dynamics* dynamics, const hybmss_const_field* in) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        moving.write(in, [&](const auto& view) { moving.body.set_displacements(view); });
    });
}

hybmss_status hybmss_dynamics_set_velocities(hybmss_dynamics* dynamics, const hybmss_const_field* in) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        moving.write(in, [&](const auto& view) { moving.body.set_velocities(view); });
    });
}

hybmss_status hybmss_dynamics_energies(const hybmss_dynamics* dynamics, double* springs, double* volume,
                                       double* kinetic) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        const PotentialEnergy energy = moving.body.potential_energy();
        const double motion = moving.body.kinetic_energy();
        for (const auto& [value, out] :
             {std::pair{energy.springs, springs}, {energy.volume, volume}, {motion, kinetic}}) {
            if (out) {
                *out = value;
            }
        }
    });
}

hybmss_status hybmss_dynamics_not_finite_at(const hybmss_dynamics* dynamics, int64_t* steps) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(steps, "steps");
        *steps = moving.body.not_finite_at();
    });
}

hybmss_status hybmss_dynamics_masses(const hybmss_dynamics* dynamics, double* masses, size_t count) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(masses, "masses", count);
        const std::span<const double> all = moving.body.masses();
        require_count(count, all.size(), "masses");
        std::copy(all.begin(), all.end(), masses);
    });
}

hybmss_status hybmss_dynamics_critical_time_step(const hybmss_dynamics* dynamics, double* time_step) {
    return guarded(dynamics, "dynamics", [&](const auto& moving) {
        require(time_step, "time_step");
        *time_step = moving.body.critical_time_step();
    });
}

hybmss_status hybmss_world_create(hybmss_precision precision, int32_t threads, hybmss_world** world) {
    return guarded([&] {
        require(world, "world");
        auto made = std::make_unique<hybmss_world>();
        if (is_double(precision, "precision")) {
            made->held = std::make_unique<Together<double>>(threads);
        } else {
            made->held = std::make_unique<Together<float>>(threads);
        }
        *world = made.release();
    });
}

void hybmss_world_destroy(hybmss_world* world) {
    delete world;
}

hybmss_status hybmss_world_add(hybmss_world* world, const hybmss_body* body, const hybmss_plan_options* options,
                               const double* origin, size_t* number, hybmss_dynamics** dynamics) {
    return guarded(world, "world", [&]<class T>(Together<T>& together) {
        require(body, "body");
        require(number, "number");
        const GivenOptions given(options);
        std::array<double, 3> low = {0, 0, 0};
        if (origin) {
            std::copy_n(origin, 3, low.begin());
        }
        const auto* lattice = std::get_if<LatticeBody>(&body->shape);
        if (!lattice && low != std::array<double, 3>{0, 0, 0}) {
            throw std::invalid_argument("origin of a network is not allowed: its nodes have positions of their own");
        }
        auto lent = dynamics ? std::make_unique<hybmss_dynamics>() : nullptr;
        auto made = made_of<ExplicitDynamics<T>>(*body, given.options);
        World<T>& all = *together.world;
        const std::size_t added = lattice ? all.add(std::move(made), lattice->lattice, low)
                                          : all.add(std::move(made), std::get<Network>(body->shape));
        together.places.push_back(std::make_shared<Place>(Place{low, {}}));
        if (lent) {
            auto moving =
                std::make_unique<Moving<T>>(std::shared_ptr<ExplicitDynamics<T>>(together.world, &all.body(added)));
            moving->place = together.places.back();
            lent->held = std::move(moving);
            *dynamics = lent.release();
        }
        *number = added;
    });
}

hybmss_status hybmss_world_place(hybmss_world* world, size_t number, const hybmss_pose* pose) {
    return guarded(world, "world", [&](auto& together) {
        require(pose, "pose");
        together.world->place(number, pose_of(*pose));
    });
}

hybmss_status hybmss_world_remove_cells(hybmss_world* world, size_t number, const hybmss_body* body,
                                        const uint32_t* cells, size_t count, size_t* removed) {
    return guarded(world, "world", [&](auto& together) {
        require_own(body, together.world->body(number).node_count(), "dynamics");
        require(cells, "cells", count);
        const std::size_t gone =
            together.world->remove_cells(number, together.places[number]->to_cut(*body), {cells, count});
        if (removed) {
            *removed = gone;
        }
    });
}

hybmss_status hybmss_world_split_parts(hybmss_world* world, size_t number, const hybmss_body* body,
                                       const hybmss_plan_options* options, hybmss_body_part* parts, size_t capacity,
                                       size_t* count) {
    return guarded(world, "world", [&]<class T>(Together<T>& together) {
        World<T>& all = *together.world;
        require_own(body, all.body(number).node_count(), "dynamics");
        require(count, "count");
        require(parts, "parts", capacity);
        const LatticeBody& whole = lattice_of(*body, "a lattice has parts");
        const GivenOptions given(options);
        // Handles are made before anything changes.
        std::vector<std::unique_ptr<hybmss_body>> bodies;
        std::vector<std::unique_ptr<hybmss_dynamics>> lent;
        const std::vector<BodyPart> split =
            all.split_parts(number, together.places[number]->to_cut(*body), [&](const Lattice& lattice) {
                if (bodies.size() == capacity) {
                    throw std::invalid_argument("capacity = " + std::to_string(capacity) +
                                                " is not allowed: the body has more parts");
                }
                bodies.push_back(std::make_unique<hybmss_body>(
                    hybmss_body{LatticeBody{lattice, whole.material}, lattice.nodes().size()}));
                lent.push_back(std::make_unique<hybmss_dynamics>());
                return made_of<ExplicitDynamics<T>>(*bodies.back(), given.options);
            });
        for (std::size_t p = 0; p < split.size(); ++p) {
            together.places.push_back(std::make_shared<Place>(Place{together.places[number]->origin, {}}));
            auto moving = std::make_unique<Moving<T>>(
                std::shared_ptr<ExplicitDynamics<T>>(together.world, &all.body(split[p].body)));
            moving->place = together.places.back();
            lent[p]->held = std::move(moving);
            parts[p] = {split[p].body, bodies[p].release(), lent[p].release()};
        }
        *count = split.size();
    });
}

hybmss_status hybmss_world_set_contacts(hybmss_world* world, const hybmss_body_contact* contacts, size_t count) {
    return guarded(world, "world", [&](auto& together) {
        require(contacts, "contacts", count);
        std::vector<BodyContact> given;
        std::transform(contacts, contacts + count, std::back_inserter(given), [](const hybmss_body_contact& c) {
            return BodyContact{c.first, c.second, c.friction, c.stiffness, c.friction_delay};
        });
        together.world->set_contacts(given);
    });
}

hybmss_status hybmss_world_set_shared_obstacles(hybmss_world* world, const hybmss_shared_obstacle* obstacles,
                                                size_t count) {
    return guarded(world, "world", [&](auto& together) {
        require(obstacles, "obstacles", count);
        std::vector<SharedObstacle> given;
        std::transform(obstacles, obstacles + count, std::back_inserter(given), [](const hybmss_shared_obstacle& o) {
            return SharedObstacle{o.body, o.obstacle, o.one};
        });
        together.world->set_shared_obstacles(given);
    });
}

hybmss_status hybmss_world_contact_readings(const hybmss_world* world, hybmss_body_contact_reading* readings,
                                            size_t count) {
    return guarded(world, "world", [&](const auto& together) {
        require(readings, "readings", count);
        const std::vector<BodyContactReading> now = together.world->contact_readings();
        require_count(count, now.size(), "readings");
        std::transform(now.begin(), now.end(), readings, [](const BodyContactReading& reading) {
            hybmss_body_contact_reading out{{}, {}, reading.depth, reading.greatest_depth, reading.nodes};
            std::copy_n(reading.force.begin(), 3, out.force);
            std::copy_n(reading.impulse.begin(), 3, out.impulse);
            return out;
        });
    });
}

hybmss_status hybmss_world_attach(hybmss_world* world, const hybmss_anchor* from, const hybmss_anchor* to,
                                  double stiffness, size_t* attachment) {
    return guarded(world, "world", [&](auto& together) {
        require(attachment, "attachment");
        *attachment = together.world->attach({anchor(from, "from"), anchor(to, "to"), stiffness});
    });
}

hybmss_status hybmss_world_move_anchor(hybmss_world* world, size_t attachment, const double* point) {
    return guarded(world, "world", [&](auto& together) {
        require(point, "point");
        together.world->move_anchor(attachment, {point[0], point[1], point[2]});
    });
}

hybmss_status hybmss_world_attachment_force(const hybmss_world* world, size_t attachment, double* force) {
    return guarded(world, "world", [&](const auto& together) {
        require(force, "force");
        const std::array<double, 3> now = together.world->attachment_force(attachment);
        std::copy(now.begin(), now.end(), force);
    });
}

hybmss_status hybmss_world_detach(hybmss_world* world, size_t attachment) {
    return guarded(world, "world", [&](auto& together) { together.world->detach(attachment); });
}

hybmss_status hybmss_world_step(hybmss_world* world, const hybmss_step_parameters* parameters, int64_t count) {
    return guarded(world, "world",
                   [&](auto& together) { together.world->step(step_parameters(parameters), steps(count)); });
}

hybmss_status hybmss_world_critical_time_step(const hybmss_world* world, double* time_step) {
    return guarded(world, "world", [&](const auto& together) {
        require(time_step, "time_step");
        *time_step = together.world->critical_time_step();
    });
}

} // extern "C"
