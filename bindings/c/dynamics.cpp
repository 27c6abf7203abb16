#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"
#include "hybmss/explicit_dynamics.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss::c_interface {
namespace {

template <class T>
struct Moving {
    ExplicitDynamics<T> body;
    mutable Scratch<T> scratch;
    std::optional<Lattice> cut; ///< what cells there are; none before the first cut

    Moving(const hybmss_body& shape, const PlanOptions& options) : body(made_of<ExplicitDynamics<T>>(shape, options)) {}

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

/// Throws std::invalid_argument unless `body` may be the one that a dynamics of so many nodes was made of.
void require_own(const hybmss_body* body, std::size_t nodes) {
    require(body, "body");
    if (body->node_count != nodes) {
        throw std::invalid_argument("body has " + std::to_string(body->node_count) + " nodes and the dynamics " +
                                    std::to_string(nodes) + ": it must be the body that the dynamics was made of");
    }
}

/// Those of a body in the order of its nodes, also where they are fewer after cuts.
std::vector<SurfaceNode> surface_of(const hybmss_body& body, const std::optional<Lattice>& cut) {
    if (const auto* network = std::get_if<Network>(&body.shape)) {
        return surface_nodes(*network);
    }
    const Lattice& whole = std::get<LatticeBody>(body.shape).lattice;
    if (!cut) {
        return surface_nodes(whole);
    }
    std::vector<SurfaceNode> surface = surface_nodes(*cut);
    const std::vector<std::uint32_t> grid = cut->nodes(), all = whole.nodes();
    for (SurfaceNode& node : surface) {
        node.node = static_cast<std::uint32_t>(std::lower_bound(all.begin(), all.end(), grid[node.node]) - all.begin());
    }
    return surface;
}

RigidPose pose_of(const hybmss_pose& given) {
    RigidPose pose;
    std::copy_n(given.position, 3, pose.position.begin());
    std::copy_n(given.rotation, 9, pose.rotation.begin());
    std::copy_n(given.velocity, 3, pose.velocity.begin());
    std::copy_n(given.angular_velocity, 3, pose.angular_velocity.begin());
    return pose;
}

Obstacle obstacle_of(const hybmss_obstacle& given) {
    const double(&d)[3] = given.dimensions;
    Obstacle obstacle{{}, pose_of(given.pose), given.friction, given.stiffness, given.friction_delay};
    switch (given.shape) {
    case HYBMSS_PLANE:
        obstacle.shape = PlaneShape{{d[0], d[1], d[2]}};
        break;
    case HYBMSS_SPHERE:
        obstacle.shape = SphereShape{d[0]};
        break;
    case HYBMSS_BOX:
        obstacle.shape = BoxShape{{d[0], d[1], d[2]}};
        break;
    default:
        throw std::invalid_argument("shape = " + std::to_string(given.shape) + " is not allowed: it must be 0 to 2");
    }
    return obstacle;
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

PrescribedNode prescribed_node(const hybmss_prescribed_node& given) {
    if (given.axes > 7) {
        throw std::invalid_argument("axes of prescribed node " + std::to_string(given.node) + " = " +
                                    std::to_string(given.axes) + " is not allowed: it must be 0 to 7");
    }
    PrescribedNode node{given.node, static_cast<std::uint8_t>(given.axes), {}, {}};
    std::copy_n(given.displacement, 3, node.displacement.begin());
    std::copy_n(given.velocity, 3, node.velocity.begin());
    return node;
}

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_dynamics {
    std::variant<std::unique_ptr<Moving<float>>, std::unique_ptr<Moving<double>>> held;
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

hybmss_status hybmss_dynamics_damp_springs(hybmss_dynamics* dynamics, double stiffness_damping) {
    return guarded(dynamics, "dynamics", [&](auto& moving) { moving.body.damp_springs(stiffness_damping); });
}

hybmss_status hybmss_dynamics_remove_cells(hybmss_dynamics* dynamics, const hybmss_body* body, const uint32_t* cells,
                                           size_t count, size_t* removed) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count());
        require(cells, "cells", count);
        const Lattice& whole = lattice_of(*body, "a lattice has cells to remove").lattice;
        if (!moving.cut) {
            moving.cut = whole;
        }
        const std::size_t gone = moving.body.remove_cells(*moving.cut, {cells, count});
        if (removed) {
            *removed = gone;
        }
    });
}

hybmss_status hybmss_dynamics_set_obstacles(hybmss_dynamics* dynamics, const hybmss_body* body,
                                            const hybmss_obstacle* obstacles, size_t count) {
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require_own(body, moving.body.node_count());
        require(obstacles, "obstacles", count);
        std::vector<Obstacle> given;
        std::transform(obstacles, obstacles + count, std::back_inserter(given), obstacle_of);
        moving.body.set_obstacles(surface_of(*body, moving.cut), given);
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
    return guarded(dynamics, "dynamics", [&](auto& moving) {
        require(parameters, "parameters");
        if (count < 0) {
            throw std::invalid_argument("count = " + std::to_string(count) + " is not allowed: it must be at least 0");
        }
        const double* g = parameters->acceleration;
        if (parameters->integrator != HYBMSS_SYMPLECTIC_EULER && parameters->integrator != HYBMSS_LEAPFROG) {
            throw std::invalid_argument(
                "integrator = " + std::to_string(parameters->integrator) +
                " is not allowed: it must be 0 (HYBMSS_SYMPLECTIC_EULER) or 1 (HYBMSS_LEAPFROG)");
        }
        const StepParameters step{parameters->time_step,
                                  {g[0], g[1], g[2]},
                                  parameters->mass_damping,
                                  static_cast<Integrator>(parameters->integrator)};
        moving.body.step(step, static_cast<long>(count));
    });
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

} // extern "C"
