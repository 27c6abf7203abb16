#include "bindings.hpp"

#include "hybmss/force_plan.hpp"

#include <memory>
#include <string>
#include <variant>

namespace hybmss::python {

namespace {

/// A plan of either precision.
class Plan {
public:
    Plan(const Lattice& lattice, const Material& material, const py::object& dtype, const PlanOptions& options) {
        if (is_double(dtype)) {
            const py::gil_scoped_release released;
            plan_ = std::make_unique<ForcePlan<double>>(lattice, material, options);
        } else {
            const py::gil_scoped_release released;
            plan_ = std::make_unique<ForcePlan<float>>(lattice, material, options);
        }
    }

    template <class Visit>
    auto visit(const Visit& visit) const {
        return std::visit([&](const auto& plan) { return visit(*plan); }, plan_);
    }
    std::size_t nodes() const {
        return visit([](const auto& plan) { return plan.node_count(); });
    }

private:
    std::variant<std::unique_ptr<ForcePlan<float>>, std::unique_ptr<ForcePlan<double>>> plan_;
};

template <class T>
void add_forces(const ForcePlan<T>& plan, const py::array& displacements, py::array& forces) {
    const auto u = input<T>(displacements, plan.node_count(), "displacements");
    const auto f = output<T>(forces, plan.node_count(), "forces");
    const py::gil_scoped_release released;
    plan.add_forces(u, f);
}

template <class T>
void add_product(const ForcePlan<T>& plan, const py::array& displacements, const py::array& direction,
                 py::array& product) {
    const auto u = input<T>(displacements, plan.node_count(), "displacements");
    const auto p = input<T>(direction, plan.node_count(), "direction");
    const auto q = output<T>(product, plan.node_count(), "product");
    const py::gil_scoped_release released;
    plan.add_hessian_product(u, p, q);
}

template <class T>
py::tuple energy(const ForcePlan<T>& plan, const py::array& displacements) {
    const auto u = input<T>(displacements, plan.node_count(), "displacements");
    PotentialEnergy result;
    {
        const py::gil_scoped_release released;
        result = plan.energy(u);
    }
    return py::make_tuple(result.springs, result.volume);
}

} // namespace

PlanOptions plan_options(int threads, const std::string& layout, const std::string& instruction_set,
                         const std::string& accuracy, const std::string& effort) {
    PlanOptions options;
    options.threads = threads;
    options.layout = layout;
    options.instruction_set = parse_instruction_set(instruction_set);
    options.accuracy = parse_accuracy(accuracy);
    options.effort = parse_effort(effort);
    return options;
}

void bind_plans(py::module_& module) {
    py::class_<Plan>(
        module, "ForcePlan",
        "A body prepared for this machine: forces and energies over arrays of the caller's.\n\n"
        "Arrays are (nodes, 3) of the plan's dtype, with any strides; they are never copied. One plan may be\n"
        "used by several threads; the interpreter's lock is released meanwhile.")
        .def(py::init([](const Lattice& lattice, const Material& material, const py::object& dtype, int threads,
                         const std::string& layout, const std::string& instruction_set, const std::string& accuracy,
                         const std::string& effort) {
                 return Plan(lattice, material, dtype,
                             plan_options(threads, layout, instruction_set, accuracy, effort));
             }),
             py::arg("lattice"), py::arg("material"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0, py::arg("layout") = "", py::arg("instruction_set") = "automatic",
             py::arg("accuracy") = "accurate", py::arg("effort") = "estimate")
        .def_property_readonly("node_count", &Plan::nodes)
        .def(
            "add_forces",
            [](const Plan& plan, const py::array& u, py::array& f) {
                plan.visit([&](const auto& made) { add_forces(made, u, f); });
            },
            py::arg("displacements"), py::arg("forces"), "Adds the internal forces (N) at the displacements (m).")
        .def(
            "forces",
            [](const Plan& plan, const py::array& u) {
                return plan.visit([&]<class T>(const ForcePlan<T>& made) -> py::array {
                    py::array f = zeros<T>(made.node_count());
                    add_forces(made, u, f);
                    return f;
                });
            },
            py::arg("displacements"), "The internal forces (N), as a new array.")
        .def(
            "energy",
            [](const Plan& plan, const py::array& u) {
                return plan.visit([&](const auto& made) { return energy(made, u); });
            },
            py::arg("displacements"), "(springs, volume), J.")
        .def(
            "add_hessian_product",
            [](const Plan& plan, const py::array& u, const py::array& p, py::array& q) {
                plan.visit([&](const auto& made) { add_product(made, u, p, q); });
            },
            py::arg("displacements"), py::arg("direction"), py::arg("product"),
            "Adds K p, the second derivatives of the energy (N/m) times a direction (m).")
        .def_property_readonly(
            "critical_time_step",
            [](const Plan& plan) { return plan.visit([](const auto& made) { return made.critical_time_step(); }); },
            "A lower bound of the largest stable explicit step, s.")
        .def("__str__",
             [](const Plan& plan) { return plan.visit([](const auto& made) { return to_string(made.describe()); }); });
}

} // namespace hybmss::python
