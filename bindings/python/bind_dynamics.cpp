#include "bindings.hpp"

#include "hybmss/explicit_dynamics.hpp"

#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace hybmss::python {

namespace {

using Vector3 = std::array<double, 3>;

class Dynamics {
public:
    Dynamics(const Lattice& lattice, const Material& material, const py::object& dtype, const PlanOptions& options) {
        if (is_double(dtype)) {
            body_ = std::make_unique<ExplicitDynamics<double>>(lattice, material, options);
        } else {
            body_ = std::make_unique<ExplicitDynamics<float>>(lattice, material, options);
        }
    }
    template <class Visit>
    auto visit(const Visit& visit) const {
        return std::visit([&](const auto& body) { return visit(*body); }, body_);
    }

private:
    std::variant<std::unique_ptr<ExplicitDynamics<float>>, std::unique_ptr<ExplicitDynamics<double>>> body_;
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
    unsigned mask = 0;
    for (const char axis : axes) {
        if (axis < 'x' || axis > 'z') {
            throw std::invalid_argument("axes = \"" + axes + "\" is not allowed: it must be made of x, y and z");
        }
        mask |= 1u << (axis - 'x');
    }
    std::vector<PrescribedNode> prescribed;
    for (const std::uint32_t node : nodes) {
        prescribed.push_back({node, static_cast<std::uint8_t>(mask), displacement, velocity});
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

void step(Dynamics& dynamics, double time_step, long count, const Vector3& acceleration, double mass_damping,
          const std::string& integrator) {
    if (integrator != "symplectic-euler" && integrator != "leapfrog") {
        throw std::invalid_argument("integrator = \"" + integrator +
                                    "\" is not allowed: it must be \"symplectic-euler\" or \"leapfrog\"");
    }
    const Integrator by = integrator == "leapfrog" ? Integrator::leapfrog : Integrator::symplectic_euler;
    const py::gil_scoped_release released;
    dynamics.visit([&](auto& body) { body.step({time_step, acceleration, mass_damping, by}, count); });
}

} // namespace

void bind_dynamics(py::module_& module) {
    py::class_<Dynamics> type(module, "ExplicitDynamics",
                              "A body that moves by explicit steps and owns its state. For one thread at a time.");
    type.def(py::init([](const Lattice& lattice, const Material& material, const py::object& dtype, int threads,
                         const std::string& layout, const std::string& instruction_set, const std::string& accuracy,
                         const std::string& effort) {
                 return Dynamics(lattice, material, dtype,
                                 plan_options(threads, layout, instruction_set, accuracy, effort));
             }),
             py::arg("lattice"), py::arg("material"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0, py::arg("layout") = "", py::arg("instruction_set") = "automatic",
             py::arg("accuracy") = "accurate", py::arg("effort") = "estimate");
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
    type.def("load", &load, py::arg("nodes"), py::arg("force"),
             "Pulls each of these nodes with the force (N), no others.");
    type.def("step", &step, py::arg("time_step"), py::arg("count") = 1, py::kw_only(),
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
}

} // namespace hybmss::python
