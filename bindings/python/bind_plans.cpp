#include "bindings.hpp"

#include "hybmss/force_plan.hpp"
#include "hybmss/skin.hpp"
#include "hybmss/stress.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace hybmss::python {

namespace {

/// A plan of either precision.
class Plan {
public:
    /// Of a lattice, a material and options, or a network and options.
    template <class... Of>
    explicit Plan(const py::object& dtype, const Of&... of) {
        if (is_double(dtype)) {
            const py::gil_scoped_release released;
            plan_ = std::make_unique<ForcePlan<double>>(of...);
        } else {
            const py::gil_scoped_release released;
            plan_ = std::make_unique<ForcePlan<float>>(of...);
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

template <class T>
std::vector<CellStress> stresses(const StressMeter& meter, const py::array& displacements) {
    const auto u = input<T>(displacements, meter.node_count(), "displacements");
    std::vector<CellStress> read(meter.cell_count());
    const py::gil_scoped_release released;
    meter.read(u, read);
    return read;
}

/// Rows of three.
template <class T>
std::vector<std::array<T, 3>> rows(const py::array_t<T, py::array::c_style | py::array::forcecast>& array,
                                   const char* name) {
    if (array.ndim() != 2 || array.shape(1) != 3) {
        throw std::invalid_argument(std::string(name) + ": shape " +
                                    py::cast<std::string>(py::str(array.attr("shape"))) +
                                    " is not allowed: it must be (any, 3)");
    }
    std::vector<std::array<T, 3>> made(static_cast<std::size_t>(array.shape(0)));
    for (std::size_t n = 0; n < made.size(); ++n) {
        std::copy_n(array.data() + 3 * n, 3, made[n].begin());
    }
    return made;
}
template <class T>
py::array_t<T> array_of(const std::vector<std::array<T, 3>>& rows) {
    py::array_t<T> array({static_cast<py::ssize_t>(rows.size()), py::ssize_t{3}});
    for (std::size_t n = 0; n < rows.size(); ++n) {
        std::copy(rows[n].begin(), rows[n].end(), array.mutable_data() + 3 * n);
    }
    return array;
}

using Vertices = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Triangles = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

/// A skin of either precision.
class AnySkin {
public:
    AnySkin(const Lattice& lattice, const Vertices& vertices, const Triangles& triangles, const py::object& dtype,
            int threads) {
        const TriangleMesh mesh = {rows<double>(vertices, "vertices"), rows<std::uint32_t>(triangles, "triangles")};
        PlanOptions options;
        options.threads = threads;
        if (is_double(dtype)) {
            skin_ = std::make_unique<Skin<double>>(lattice, mesh, options);
        } else {
            skin_ = std::make_unique<Skin<float>>(lattice, mesh, options);
        }
    }
    template <class Visit>
    auto visit(const Visit& visit) const {
        return std::visit([&](const auto& skin) { return visit(*skin); }, skin_);
    }

private:
    std::variant<std::unique_ptr<Skin<float>>, std::unique_ptr<Skin<double>>> skin_;
};

template <class T>
void update_skin(const Skin<T>& skin, const py::array& displacements, py::array& positions,
                 std::optional<py::array>& normals) {
    const auto u = input<T>(displacements, skin.node_count(), "displacements");
    const auto x = output<T>(positions, skin.vertex_count(), "positions");
    const auto n = normals ? output<T>(*normals, skin.vertex_count(), "normals") : VectorField<T>{};
    const py::gil_scoped_release released;
    skin.update(u, x, n);
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
                 return Plan(dtype, lattice, material,
                             plan_options(threads, layout, instruction_set, accuracy, effort));
             }),
             py::arg("lattice"), py::arg("material"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0, py::arg("layout") = "", py::arg("instruction_set") = "automatic",
             py::arg("accuracy") = "accurate", py::arg("effort") = "estimate")
        .def(of_network<Plan>(), py::arg("network"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0)
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

    module.def(
        "boundary_mesh",
        [](const Lattice& lattice, bool smooth) {
            const TriangleMesh mesh = smooth ? smooth_boundary_mesh(lattice) : boundary_mesh(lattice);
            return py::make_tuple(array_of(mesh.vertices), array_of(mesh.triangles));
        },
        py::arg("lattice"), py::arg("smooth") = false,
        "(vertices, triangles): the faces of cells that no other cell shares, two triangles each; `smooth`: on the "
        "surface that the cells' fills are of, or without terraces.");

    py::class_<AnySkin>(module, "Skin", "Triangles that move with a lattice.")
        .def(py::init<const Lattice&, const Vertices&, const Triangles&, const py::object&, int>(), py::arg("lattice"),
             py::arg("vertices"), py::arg("triangles"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0,
             "Vertices (n, 3) at rest, m from the grid's low corner; triangles (m, 3) of their numbers.")
        .def_property_readonly(
            "vertex_count",
            [](const AnySkin& skin) { return skin.visit([](const auto& made) { return made.vertex_count(); }); })
        .def(
            "update",
            [](const AnySkin& skin, const py::array& u, py::array& x, std::optional<py::array> n) {
                skin.visit([&](const auto& made) { update_skin(made, u, x, n); });
            },
            py::arg("displacements"), py::arg("positions"), py::arg("normals") = py::none(),
            "Sets positions (m) and unit normals, arrays of the skin's dtype, at the displacements (m).")
        .def(
            "triangles_left",
            [](const AnySkin& skin, const Lattice& cut) {
                return array_of(skin.visit([&](const auto& made) { return made.triangles_left(cut); }));
            },
            py::arg("cut"), "The triangles less those in cells that the lattice `cut` has lost.");

    py::class_<StressMeter>(module, "StressMeter", "Reads stress, strain and energy of a lattice's cells.")
        .def(py::init([](const Lattice& lattice, const Material& material, int threads) {
                 PlanOptions options;
                 options.threads = threads;
                 return StressMeter(lattice, material, options);
             }),
             py::arg("lattice"), py::arg("material"), py::kw_only(), py::arg("threads") = 0)
        .def_property_readonly("node_count", &StressMeter::node_count)
        .def_property_readonly("cell_count", &StressMeter::cell_count)
        .def(
            "read",
            [](const StressMeter& meter, const py::array& displacements) {
                return stress_arrays(py::isinstance<py::array_t<float>>(displacements)
                                         ? stresses<float>(meter, displacements)
                                         : stresses<double>(meter, displacements));
            },
            py::arg("displacements"),
            "New arrays at the displacements (m), a row a cell: \"cauchy\" (Pa) and \"green_strain\" with xx, yy, zz, "
            "xy, yz, xz,\n\"first_piola\" (Pa, 3 x 3), \"von_mises\", \"pressure\" (Pa), \"energy_density\" (J/m^3 "
            "at rest), \"volume_ratio\".");
}

} // namespace hybmss::python
