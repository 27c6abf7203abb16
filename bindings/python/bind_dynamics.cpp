#include "bindings.hpp"

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/skin.hpp"
#include "hybmss/world.hpp"

#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace hybmss::python {

namespace {

using Vector3 = std::array<double, 3>;

class Dynamics {
public:
    /// Of a lattice, a material and options, or a network and options.
    template <class... Of>
    explicit Dynamics(const py::object& dtype, const Of&... of) {
        if (is_double(dtype)) {
            body_ = std::make_shared<ExplicitDynamics<double>>(of...);
        } else {
            body_ = std::make_shared<ExplicitDynamics<float>>(of...);
        }
    }
    /// One that lives as long as this does, or elsewhere.
    template <class T>
    Dynamics(std::shared_ptr<ExplicitDynamics<T>> body, const Vector3& origin)
        : origin_(origin), body_(std::move(body)) {}
    template <class Visit>
    auto visit(const Visit& visit) const {
        return std::visit([&](const auto& body) { return visit(*body); }, body_);
    }

    const Vector3& origin() const { return origin_; }

private:
    Vector3 origin_ = {0, 0, 0}; ///< m, where its world has it
    std::variant<std::shared_ptr<ExplicitDynamics<float>>, std::shared_ptr<ExplicitDynamics<double>>> body_;
};

class PythonWorld {
public:
    PythonWorld(const py::object& dtype, int threads) {
        if (is_double(dtype)) {
            world_ = std::make_shared<World<double>>(threads);
        } else {
            world_ = std::make_shared<World<float>>(threads);
        }
    }
    template <class Visit>
    auto visit(const Visit& visit) const {
        return std::visit([&](const auto& world) { return visit(*world); }, world_);
    }
    /// A body that keeps its world alive.
    Dynamics body(std::size_t number) const {
        return std::visit(
            [&]<class T>(const std::shared_ptr<World<T>>& world) {
                const std::shared_ptr<ExplicitDynamics<T>> body(world, &world->body(number));
                return Dynamics(body, origins_[number]);
            },
            world_);
    }

    std::size_t add(const Lattice& lattice, const Material& material, const Vector3& origin) {
        const std::size_t body = visit(
            [&]<class T>(World<T>& made) { return made.add(ExplicitDynamics<T>(lattice, material), lattice, origin); });
        origins_.push_back(origin);
        return body;
    }
    std::vector<std::pair<std::size_t, Lattice>> split_parts(std::size_t body, Lattice& lattice,
                                                             const Material& material) {
        std::vector<std::pair<std::size_t, Lattice>> parts;
        visit([&]<class T>(World<T>& made) {
            for (BodyPart& part : made.split_parts(
                     body, lattice, [&](const Lattice& cells) { return ExplicitDynamics<T>(cells, material); })) {
                parts.emplace_back(part.body, std::move(part.lattice));
                origins_.push_back(origins_[body]);
            }
        });
        return parts;
    }

private:
    std::vector<Vector3> origins_;
    std::variant<std::shared_ptr<World<float>>, std::shared_ptr<World<double>>> world_;
};

/// A property that reads into a new array and writes from any.
template <class Get, class Set>
void add_field(py::class_<Dynamics>& type, const char* name, const char* words, const Get& get, const Set& set) {
    type.def_property(
        name,
        [get](const Dynamics& dynamics) {
            return dynamics.visit([&]<class T>(const ExplicitDynamics<T>& body) -> py::array {
                py::array_t<T> out = zeros<T>(body.node_count());
                get(body, output<T>(out, body.node_count(), "out"));
                return out;
            });
        },
        [set](Dynamics& dynamics, const py::array& in) {
            dynamics.visit(
                [&]<class T>(ExplicitDynamics<T>& body) { set(body, input<T>(in, body.node_count(), "value")); });
        },
        words);
}

void prescribe(Dynamics& dynamics, const std::vector<std::uint32_t>& nodes, const std::string& axes,
               const Vector3& displacement, const Vector3& velocity) {
    const std::uint8_t mask = axes_of(axes);
    std::vector<PrescribedNode> prescribed;
    for (const std::uint32_t node : nodes) {
        prescribed.push_back({node, mask, displacement, velocity});
    }
    dynamics.visit([&](auto& body) { body.prescribe(prescribed); });
}

void load(Dynamics& dynamics, const std::vector<std::uint32_t>& nodes, const Vector3& force) {
    std::vector<NodalLoad> loads;
    for (const std::uint32_t node : nodes) {
        loads.push_back({node, force});
    }
    dynamics.visit([&](auto& body) { body.load(loads); });
}

/// Of a body or a world.
template <class Moving>
void step(Moving& moving, double time_step, long count, const Vector3& acceleration, double mass_damping,
          const std::string& integrator) {
    if (integrator != "symplectic-euler" && integrator != "leapfrog") {
        throw std::invalid_argument("integrator = \"" + integrator +
                                    "\" is not allowed: it must be \"symplectic-euler\" or \"leapfrog\"");
    }
    const Integrator by = integrator == "leapfrog" ? Integrator::leapfrog : Integrator::symplectic_euler;
    const py::gil_scoped_release released;
    moving.visit([&](auto& body) { body.step({time_step, acceleration, mass_damping, by}, count); });
}

py::dict to_dict(const BodyContactReading& reading) {
    py::dict out;
    out["force"] = reading.force;
    out["nodes"] = reading.nodes;
    out["depth"] = reading.depth;
    out["greatest_depth"] = reading.greatest_depth;
    out["impulse"] = reading.impulse;
    return out;
}

py::dict to_dict(const ObstacleReading& reading) {
    py::dict out;
    out["force"] = reading.force;
    out["torque"] = reading.torque;
    out["nodes"] = reading.nodes;
    out["depth"] = reading.depth;
    out["greatest_depth"] = reading.greatest_depth;
    out["energy"] = reading.energy;
    out["dissipated"] = reading.dissipated;
    out["impulse"] = reading.impulse;
    out["angular_impulse"] = reading.angular_impulse;
    out["kinetic"] = reading.kinetic;
    out["work_of_gravity"] = reading.work_of_gravity;
    return out;
}

template <class Reading>
py::list to_list(const std::vector<Reading>& readings) {
    py::list out;
    for (const Reading& reading : readings) {
        out.append(to_dict(reading));
    }
    return out;
}

void bind_obstacles(py::module_& module, py::class_<Dynamics>& type) {
    py::class_<Obstacle> obstacle(module, "Obstacle", "A rigid solid that bodies touch.");
    obstacle.def_static(
        "plane",
        [](const Vector3& normal, const Vector3& position, double friction) {
            return Obstacle{.shape = PlaneShape{normal}, .pose = {.position = position}, .friction = friction};
        },
        py::arg("normal"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0);
    obstacle.def_static(
        "sphere",
        [](double radius, const Vector3& position, double friction) {
            return Obstacle{.shape = SphereShape{radius}, .pose = {.position = position}, .friction = friction};
        },
        py::arg("radius"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0);
    obstacle.def_static(
        "box",
        [](const Vector3& size, const Vector3& position, double friction) {
            return Obstacle{.shape = BoxShape{size}, .pose = {.position = position}, .friction = friction};
        },
        py::arg("size"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0);
    obstacle.def_static(
        "capsule",
        [](const Vector3& axis, double radius, const Vector3& position, double friction) {
            return Obstacle{.shape = CapsuleShape{axis, radius}, .pose = {.position = position}, .friction = friction};
        },
        py::arg("axis"), py::arg("radius"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0,
        "All within a radius of a straight line of the length and direction of `axis` about the position.");
    obstacle.def_static(
        "hull",
        [](const std::vector<Vector3>& points, const Vector3& position, double friction) {
            return Obstacle{.shape = HullShape(points), .pose = {.position = position}, .friction = friction};
        },
        py::arg("points"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0,
        "The convex hull of points about the position.");
    obstacle.def_static(
        "mesh",
        [](const std::vector<Vector3>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles,
           const Vector3& position, double friction, int cells) {
            return Obstacle{
                .shape = MeshShape(vertices, triangles, cells), .pose = {.position = position}, .friction = friction};
        },
        py::arg("vertices"), py::arg("triangles"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0,
        py::kw_only(), py::arg("cells") = 64,
        "What a closed mesh encloses, by its distance on a grid with so many cells along its longest side.");
    obstacle.def_static(
        "height_field",
        [](const std::vector<std::vector<double>>& heights, const std::array<double, 2>& spacing,
           const Vector3& position, double friction) {
            const std::size_t columns = heights.empty() ? 0 : heights[0].size();
            std::vector<double> all;
            for (const std::vector<double>& row : heights) {
                if (row.size() != columns) {
                    throw std::invalid_argument("heights: a row of " + std::to_string(row.size()) +
                                                " numbers after one of " + std::to_string(columns));
                }
                all.insert(all.end(), row.begin(), row.end());
            }
            return Obstacle{.shape = HeightShape({columns, heights.size()}, spacing, all),
                            .pose = {.position = position},
                            .friction = friction};
        },
        py::arg("heights"), py::arg("spacing"), py::arg("position") = Vector3{0, 0, 0}, py::arg("friction") = 0.0,
        "All that is below heights along y: a row along x, one row after the other along z, from the position on.");
    const auto member = [&obstacle](const char* name, auto RigidPose::*field, const char* words) {
        obstacle.def_property(
            name, [field](const Obstacle& o) { return o.pose.*field; },
            [field](Obstacle& o, const std::decay_t<decltype(RigidPose{}.*field)>& value) { o.pose.*field = value; },
            words);
    };
    member("position", &RigidPose::position, "m");
    member("rotation", &RigidPose::rotation, "Row by row: from the obstacle's axes to space.");
    member("velocity", &RigidPose::velocity, "m/s");
    member("angular_velocity", &RigidPose::angular_velocity, "rad/s");
    obstacle.def_readwrite("friction", &Obstacle::friction, "Coulomb's coefficient.");
    obstacle.def_readwrite("stiffness", &Obstacle::stiffness, "1/s^2: per kg of a node; 0: by the body's own.");
    obstacle.def_readwrite("mass", &Obstacle::mass, "kg; 0: it is led, else bodies and gravity move it.");
    obstacle.def_readwrite("inertia", &Obstacle::inertia, "kg m^2 about its axes; all 0: those of the full shape.");
    type.def(
        "set_obstacles",
        [](Dynamics& dynamics, const Lattice& lattice, const std::vector<Obstacle>& obstacles,
           const std::optional<std::pair<std::vector<Vector3>, std::vector<std::array<std::uint32_t, 3>>>>& skin) {
            dynamics.visit([&](auto& body) {
                if (skin) {
                    const TriangleMesh mesh = {skin->first, skin->second};
                    body.set_skin_obstacles(skin_points(lattice, mesh, dynamics.origin()), obstacles);
                } else {
                    body.set_obstacles(surface_nodes(lattice, dynamics.origin()), obstacles);
                }
            });
        },
        py::arg("lattice"), py::arg("obstacles"), py::kw_only(), py::arg("skin") = py::none(),
        "Replaces the obstacles that the surface of `lattice`, the body's own, touches: its nodes, or the points of a "
        "skin,\nthe vertices and triangles of a mesh in it as boundary_mesh() gives them.");
    type.def(
        "move_obstacles",
        [](Dynamics& dynamics, const std::vector<Obstacle>& obstacles) {
            std::vector<RigidPose> poses;
            poses.reserve(obstacles.size());
            for (const Obstacle& moved : obstacles) {
                poses.push_back(moved.pose);
            }
            dynamics.visit([&](auto& body) { body.move_obstacles(poses); });
        },
        py::arg("obstacles"), "Sets where they are now, and their velocities; what friction holds is kept.");
    type.def_property_readonly(
        "obstacle_poses",
        [](const Dynamics& dynamics) {
            py::list out;
            for (const RigidPose& pose : dynamics.visit([](const auto& body) { return body.obstacle_poses(); })) {
                py::dict one;
                one["position"] = pose.position;
                one["rotation"] = pose.rotation;
                one["velocity"] = pose.velocity;
                one["angular_velocity"] = pose.angular_velocity;
                out.append(one);
            }
            return out;
        },
        "Where they are now, free ones too.");
    type.def_property_readonly("obstacle_readings", [](const Dynamics& dynamics) {
        return dynamics.visit([](const auto& body) { return to_list(body.obstacle_readings()); });
    });
    type.def(
        "remove_cells",
        [](Dynamics& dynamics, Lattice& lattice, const std::vector<std::uint32_t>& cells) {
            return dynamics.visit([&](auto& body) { return body.remove_cells(lattice, cells); });
        },
        py::arg("lattice"), py::arg("cells"), "Removes cells, by their indices, from the body and from its lattice.");
}

void bind_world(py::module_& module) {
    py::class_<PythonWorld> type(module, "World",
                                 "Bodies that touch each other and themselves, and are tied to each other.");
    type.def(py::init<const py::object&, int>(), py::arg("dtype") = "float64", py::kw_only(), py::arg("threads") = 0);
    type.def("add", &PythonWorld::add, py::arg("lattice"), py::arg("material"), py::arg("origin") = Vector3{0, 0, 0},
             "Adds a body whose grid has its low corner at `origin` (m); returns its number.");
    type.def("__len__",
             [](const PythonWorld& world) { return world.visit([](auto& made) { return made.body_count(); }); });
    type.def(
        "__getitem__",
        [](const PythonWorld& world, std::size_t body) {
            try {
                return world.body(body);
            } catch (const std::out_of_range& e) {
                throw py::index_error(e.what());
            }
        },
        "A body, to hold, load, read and set it by.");
    type.def(
        "place",
        [](PythonWorld& world, std::size_t body, const Vector3& position, const std::array<double, 9>& rotation,
           const Vector3& velocity, const Vector3& angular_velocity) {
            world.visit([&](auto& made) { made.place(body, {position, rotation, velocity, angular_velocity}); });
        },
        py::arg("body"), py::arg("position") = Vector3{0, 0, 0}, py::arg("rotation") = RigidPose{}.rotation,
        py::arg("velocity") = Vector3{0, 0, 0}, py::arg("angular_velocity") = Vector3{0, 0, 0},
        "Puts a body as it is at rest to position + rotation X, where it was at X.");
    type.def(
        "touch",
        [](PythonWorld& world, const std::vector<std::pair<std::size_t, std::size_t>>& pairs, double friction) {
            std::vector<BodyContact> contacts;
            for (const auto& [first, second] : pairs) {
                contacts.push_back({.first = first, .second = second, .friction = friction});
            }
            world.visit([&](auto& made) { made.set_contacts(contacts); });
        },
        py::arg("pairs"), py::arg("friction") = 0.0,
        "These pairs of bodies touch, and no others; a body beside itself touches itself.");
    type.def(
        "share_obstacles",
        [](const PythonWorld& world, const std::vector<std::vector<std::pair<std::size_t, std::size_t>>>& ones) {
            std::vector<SharedObstacle> shared;
            for (std::size_t one = 0; one < ones.size(); ++one) {
                for (const auto& [body, obstacle] : ones[one]) {
                    shared.push_back({body, obstacle, one});
                }
            }
            world.visit([&](auto& made) { made.set_shared_obstacles(shared); });
        },
        py::arg("obstacles"),
        "Free obstacles that are the same one in several bodies, no others: for each a list of (body, number there).");
    type.def_property_readonly("contact_readings", [](const PythonWorld& world) {
        return world.visit([](auto& made) { return to_list(made.contact_readings()); });
    });
    type.def(
        "attach",
        [](PythonWorld& world, const std::optional<std::size_t>& body, const Vector3& point,
           const std::optional<std::size_t>& to_body, const std::optional<Vector3>& to_point, double stiffness) {
            return world.visit([&](auto& made) {
                return made.attach({{body, point}, {to_body, to_point.value_or(point)}, stiffness});
            });
        },
        py::arg("body"), py::arg("point"), py::arg("to_body") = py::none(), py::arg("to_point") = py::none(),
        py::arg("stiffness") = std::numeric_limits<double>::infinity(),
        "Ties a point of a body at rest to one of another, or to one in space; stiffness in N/m. Returns its number.");
    type.def(
        "move_anchor",
        [](PythonWorld& world, std::size_t attachment, const Vector3& point) {
            world.visit([&](auto& made) { made.move_anchor(attachment, point); });
        },
        py::arg("attachment"), py::arg("point"));
    type.def(
        "attachment_force",
        [](const PythonWorld& world, std::size_t attachment) {
            return world.visit([&](auto& made) { return made.attachment_force(attachment); });
        },
        py::arg("attachment"), "N, on the body that it was attached to first.");
    type.def(
        "detach",
        [](PythonWorld& world, std::size_t attachment) { world.visit([&](auto& made) { made.detach(attachment); }); },
        py::arg("attachment"));
    type.def(
        "remove_cells",
        [](PythonWorld& world, std::size_t body, Lattice& lattice, const std::vector<std::uint32_t>& cells) {
            return world.visit([&](auto& made) { return made.remove_cells(body, lattice, cells); });
        },
        py::arg("body"), py::arg("lattice"), py::arg("cells"));
    type.def("split_parts", &PythonWorld::split_parts, py::arg("body"), py::arg("lattice"), py::arg("material"),
             "Makes bodies of their own of the parts that cuts have left without a common node; the largest stays. "
             "Returns\nnumber and lattice of each; `lattice` loses their cells. Obstacles, loads and what holds them "
             "are to be set.");
    type.def("step", &step<PythonWorld>, py::arg("time_step"), py::arg("count") = 1, py::kw_only(),
             py::arg("acceleration") = Vector3{0, 0, 0}, py::arg("mass_damping") = 0.0,
             py::arg("integrator") = "symplectic-euler", "As ExplicitDynamics.step, all bodies together.");
    type.def_property_readonly("critical_time_step", [](const PythonWorld& world) {
        return world.visit([](auto& made) { return made.critical_time_step(); });
    });
}

} // namespace

std::uint8_t axes_of(const std::string& axes) {
    unsigned mask = 0;
    for (const char axis : axes) {
        if (axis < 'x' || axis > 'z') {
            throw std::invalid_argument("axes = \"" + axes + "\" is not allowed: it must be made of x, y and z");
        }
        mask |= 1u << (axis - 'x');
    }
    return static_cast<std::uint8_t>(mask);
}

void bind_dynamics(py::module_& module) {
    py::class_<Dynamics> type(module, "ExplicitDynamics",
                              "A body that moves by explicit steps and owns its state. For one thread at a time.");
    type.def(py::init([](const Lattice& lattice, const Material& material, const py::object& dtype, int threads,
                         const std::string& layout, const std::string& instruction_set, const std::string& accuracy,
                         const std::string& effort) {
                 return Dynamics(dtype, lattice, material,
                                 plan_options(threads, layout, instruction_set, accuracy, effort));
             }),
             py::arg("lattice"), py::arg("material"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0, py::arg("layout") = "", py::arg("instruction_set") = "automatic",
             py::arg("accuracy") = "accurate", py::arg("effort") = "estimate");
    type.def(of_network<Dynamics>(), py::arg("network"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0);
    type.def("prescribe", &prescribe, py::arg("nodes"), py::arg("axes") = "xyz",
             py::arg("displacement") = Vector3{0, 0, 0}, py::arg("velocity") = Vector3{0, 0, 0},
             "Holds these nodes along the axes, and no others.");
    type.def(
        "damp_springs",
        [](Dynamics& dynamics, double stiffness_damping) {
            dynamics.visit([&](auto& body) { body.damp_springs(stiffness_damping); });
        },
        py::arg("stiffness_damping"),
        "Damps all springs along themselves from now on: a dashpot of stiffness_damping (s) times its stiffness each.");
    type.def(
        "relax",
        [](Dynamics& dynamics, const Lattice& lattice, const Material& material,
           const std::vector<std::pair<double, double>>& branches) {
            std::vector<Relaxation> given;
            for (const auto& [part, time] : branches) {
                given.push_back({part, time});
            }
            dynamics.visit([&](auto& body) { body.relax(lattice, material, given); });
        },
        py::arg("lattice"), py::arg("material"), py::arg("branches"),
        "Gives the material a memory from now on: branches of (part, time in s), each part times the moduli of slow "
        "loads, which fades by exp(-t / time). The lattice and the material are those that the body was made from.");
    type.def(
        "actuate",
        [](Dynamics& dynamics, const Lattice& lattice, const Material& material,
           const std::vector<std::uint32_t>& cells, const std::vector<RestStretch>& stretches) {
            dynamics.visit([&](auto& body) { body.actuate(lattice, material, cells, stretches); });
        },
        py::arg("lattice"), py::arg("material"), py::arg("cells"), py::arg("stretches"),
        "Makes these cells, and no others, of another size at rest: muscles, swelling. Three stretches a cell, of the "
        "axes x, y and z, from 0.1 to 10. The lattice and the material are those that the body was made from.");
    type.def(
        "set_rest_stretches",
        [](Dynamics& dynamics, const std::vector<RestStretch>& stretches) {
            dynamics.visit([&](auto& body) { body.set_rest_stretches(stretches); });
        },
        py::arg("stretches"), "Other stretches of the same cells.");
    type.def("load", &load, py::arg("nodes"), py::arg("force"),
             "Pulls each of these nodes with the force (N), no others.");
    module.def(
        "surface_faces",
        [](const Lattice& lattice) {
            std::vector<std::array<std::uint32_t, 4>> nodes;
            for (const SurfaceFace& face : surface_faces(lattice)) {
                nodes.push_back(face.nodes);
            }
            return nodes;
        },
        py::arg("lattice"), "Four nodes of each face that no other cell shares, counter-clockwise seen from outside.");
    type.def(
        "press",
        [](Dynamics& dynamics, const Lattice& lattice, const std::vector<std::array<std::uint32_t, 4>>& faces,
           const std::vector<double>& pressures) {
            std::vector<SurfaceFace> pressed;
            for (const auto& nodes : faces) {
                pressed.push_back({nodes, {}});
            }
            set_rest_positions(lattice, pressed, dynamics.origin());
            dynamics.visit([&](auto& body) { body.press(pressed, pressures); });
        },
        py::arg("lattice"), py::arg("faces"), py::arg("pressures"),
        "Presses these faces, and no others, with so many Pa each: into the body above 0, at right angles to them as "
        "they move. `lattice`: the body's own.");
    type.def(
        "set_pressures",
        [](Dynamics& dynamics, const std::vector<double>& pressures) {
            dynamics.visit([&](auto& body) { body.set_pressures(pressures); });
        },
        py::arg("pressures"), "Other pressures on the same faces.");
    type.def("step", &step<Dynamics>, py::arg("time_step"), py::arg("count") = 1, py::kw_only(),
             py::arg("acceleration") = Vector3{0, 0, 0}, py::arg("mass_damping") = 0.0,
             py::arg("integrator") = "symplectic-euler",
             "Takes steps of time_step (s). acceleration: gravity, m/s^2; mass_damping: 1/s; integrator: "
             "\"symplectic-euler\", or \"leapfrog\", of the second order at the same price.");
    add_field(
        type, "displacements", "(nodes, 3), m. Reading makes a new array.",
        [](const auto& body, const auto& out) { body.get_displacements(out); },
        [](auto& body, const auto& in) { body.set_displacements(in); });
    add_field(
        type, "velocities", "(nodes, 3), m/s. Reading makes a new array.",
        [](const auto& body, const auto& out) { body.get_velocities(out); },
        [](auto& body, const auto& in) { body.set_velocities(in); });
    type.def_property_readonly(
        "masses",
        [](const py::object& self) {
            return self.cast<const Dynamics&>().visit([&](const auto& body) -> py::array {
                const std::span<const double> masses = body.masses();
                py::array view(py::dtype::of<double>(), {static_cast<py::ssize_t>(masses.size())},
                               {static_cast<py::ssize_t>(sizeof(double))}, masses.data(), self);
                view.attr("flags").attr("writeable") = false;
                return view;
            });
        },
        "(nodes,), kg: a view of the body's own memory, to read only.");
    type.def_property_readonly(
        "energies",
        [](const Dynamics& dynamics) {
            return dynamics.visit([](const auto& body) {
                const PotentialEnergy energy = body.potential_energy();
                return py::make_tuple(energy.springs, energy.volume, body.kinetic_energy());
            });
        },
        "(springs, volume, kinetic), J.");
    type.def_property_readonly(
        "finite",
        [](const Dynamics& dynamics) { return dynamics.visit([](const auto& body) { return body.finite(); }); },
        "Whether all displacements and velocities are.");
    type.def_property_readonly(
        "not_finite_at",
        [](const Dynamics& dynamics) { return dynamics.visit([](const auto& body) { return body.not_finite_at(); }); },
        "0 while they are; else the steps taken when that was first found out: step() looks every 64 steps or so, this "
        "at once.");
    type.def_property_readonly("critical_time_step", [](const Dynamics& dynamics) {
        return dynamics.visit([](const auto& body) { return body.critical_time_step(); });
    });
    type.def("__str__", [](const Dynamics& dynamics) {
        return dynamics.visit([](const auto& body) { return to_string(body.describe()); });
    });
    bind_obstacles(module, type);
    bind_world(module);
}

} // namespace hybmss::python
