#include "bindings.hpp"

#include "hybmss/equilibrium.hpp"

#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

namespace hybmss::python {

namespace {

using Vector3 = std::array<double, 3>;
using Support = std::tuple<std::vector<std::uint32_t>, std::string, Vector3>;

/// A solver of either precision.
class Solver {
public:
    /// Of a lattice, a material and options, or a network and options.
    template <class... Of>
    explicit Solver(const py::object& dtype, const Of&... of) {
        if (is_double(dtype)) {
            solver_ = std::make_unique<EquilibriumSolver<double>>(of...);
        } else {
            solver_ = std::make_unique<EquilibriumSolver<float>>(of...);
        }
    }
    template <class Visit>
    auto visit(const Visit& visit) const {
        return std::visit([&](const auto& solver) { return visit(*solver); }, solver_);
    }

private:
    std::variant<std::unique_ptr<EquilibriumSolver<float>>, std::unique_ptr<EquilibriumSolver<double>>> solver_;
};

/// What holds and loads the body, as Python gives it.
struct Given {
    std::vector<Support> supports;
    std::vector<Vector3> forces;
    Vector3 acceleration;
    std::vector<double> pressures;
    std::vector<RestStretch> stretches;

    Loading loading() const {
        Loading loading{{}, forces, acceleration, pressures, {}, stretches};
        for (const auto& [nodes, axes, displacement] : supports) {
            const std::uint8_t bits = axes_of(axes);
            for (const std::uint32_t node : nodes) {
                loading.supports.push_back({node, bits, displacement, {0, 0, 0}});
            }
        }
        return loading;
    }
};

py::dict result_of(const EquilibriumResult& found) {
    return py::dict(
        py::arg("status") = std::string(name(found.status)), py::arg("message") = found.message,
        py::arg("residual") = found.residual, py::arg("potential") = found.potential,
        py::arg("load_fraction") = found.load_fraction, py::arg("load_steps") = found.load_steps,
        py::arg("newton_iterations") = found.newton_iterations, py::arg("cg_iterations") = found.cg_iterations,
        py::arg("volume_ratios") = py::make_tuple(found.min_cell_volume_ratio, found.max_cell_volume_ratio));
}

EquilibriumOptions options_of(double tolerance, const std::string& preconditioner, bool leave_saddles) {
    EquilibriumOptions options;
    options.tolerance = tolerance;
    options.preconditioner = parse_preconditioner(preconditioner);
    options.leave_saddles = leave_saddles;
    options.progress = [](const EquilibriumProgress&) { // so that Ctrl-C ends a long solve
        const py::gil_scoped_acquire held;
        return PyErr_CheckSignals() == 0;
    };
    return options;
}

template <class Solve>
py::dict solved(const Solve& solve) {
    EquilibriumResult found;
    {
        const py::gil_scoped_release released;
        found = solve();
    }
    if (PyErr_Occurred()) {
        throw py::error_already_set();
    }
    return result_of(found);
}

} // namespace

void bind_equilibria(py::module_& module) {
    const auto none = [](const auto& given) {
        using Values = std::decay_t<decltype(*given)>;
        return given ? *given : Values{};
    };
    py::class_<Solver>(
        module, "EquilibriumSolver",
        "Finds where a body comes to rest, by Newton's method; takes implicit steps.\n\n"
        "Supports are (nodes, axes, displacement in m) each, axes made of x, y and z. Arrays are (nodes, "
        "3) of\nthe solver's dtype, read and written.")
        .def(py::init([](const Lattice& lattice, const Material& material, const py::object& dtype, int threads) {
                 PlanOptions options;
                 options.threads = threads;
                 return Solver(dtype, lattice, material, options);
             }),
             py::arg("lattice"), py::arg("material"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0)
        .def(of_network<Solver>(), py::arg("network"), py::arg("dtype") = "float64", py::kw_only(),
             py::arg("threads") = 0)
        .def_property_readonly("node_count",
                               [](const Solver& s) { return s.visit([](auto& made) { return made.node_count(); }); })
        .def(
            "press",
            [](const Solver& solver, const Lattice& lattice, const std::vector<std::array<std::uint32_t, 4>>& faces) {
                std::vector<SurfaceFace> pressed;
                for (const auto& nodes : faces) {
                    pressed.push_back({nodes, {}});
                }
                set_rest_positions(lattice, pressed);
                solver.visit([&](auto& made) { made.press(pressed); });
            },
            py::arg("lattice"), py::arg("faces"), "The faces that `pressures` press, and no others.")
        .def(
            "set_obstacles",
            [](const Solver& solver, const Lattice& lattice, const std::vector<Obstacle>& obstacles) {
                solver.visit([&](auto& made) { made.set_obstacles(surface_nodes(lattice), obstacles); });
            },
            py::arg("lattice"), py::arg("obstacles"),
            "Replaces the obstacles, without friction, that the surface of `lattice`, the body's own, touches.")
        .def(
            "actuate",
            [](const Solver& solver, const std::vector<std::uint32_t>& cells) {
                solver.visit([&](auto& made) { made.actuate(cells); });
            },
            py::arg("cells"), "The cells that `stretches` gives another size at rest, and no others.")
        .def(
            "solve",
            [none](const Solver& solver, py::array& displacements, const std::vector<Support>& supports,
                   const std::optional<std::vector<Vector3>>& forces, const Vector3& acceleration,
                   const std::optional<std::vector<double>>& pressures,
                   const std::optional<std::vector<RestStretch>>& stretches, double tolerance,
                   const std::string& preconditioner, bool leave_saddles) {
                const Loading loading =
                    Given{supports, none(forces), acceleration, none(pressures), none(stretches)}.loading();
                const EquilibriumOptions options = options_of(tolerance, preconditioner, leave_saddles);
                return solver.visit([&]<class T>(EquilibriumSolver<T>& made) {
                    const auto u = output<T>(displacements, made.node_count(), "displacements");
                    return solved([&] { return made.solve(loading, u, options); });
                });
            },
            py::arg("displacements"), py::arg("supports"), py::kw_only(), py::arg("forces") = py::none(),
            py::arg("acceleration") = Vector3{0, 0, 0}, py::arg("pressures") = py::none(),
            py::arg("stretches") = py::none(), py::arg("tolerance") = 1e-8, py::arg("preconditioner") = "automatic",
            py::arg("leave_saddles") = false,
            "From the displacements (m) to equilibrium. forces: N, one a node; acceleration: m/s^2; pressures: Pa, one "
            "a\nface; stretches: three a cell. Returns a dict; its \"status\" is \"converged\" where all went well.")
        .def(
            "step",
            [none](const Solver& solver, py::array& displacements, py::array& velocities, double time_step,
                   const std::vector<Support>& supports, const std::optional<std::vector<Vector3>>& forces,
                   const Vector3& acceleration, const std::optional<std::vector<double>>& pressures,
                   const std::optional<std::vector<RestStretch>>& stretches, double mass_damping, double tolerance) {
                const Loading loading =
                    Given{supports, none(forces), acceleration, none(pressures), none(stretches)}.loading();
                const EquilibriumOptions options = options_of(tolerance, "automatic", false);
                return solver.visit([&]<class T>(EquilibriumSolver<T>& made) {
                    const auto u = output<T>(displacements, made.node_count(), "displacements");
                    const auto v = output<T>(velocities, made.node_count(), "velocities");
                    return solved([&] { return made.step(loading, time_step, mass_damping, u, v, options); });
                });
            },
            py::arg("displacements"), py::arg("velocities"), py::arg("time_step"), py::arg("supports"), py::kw_only(),
            py::arg("forces") = py::none(), py::arg("acceleration") = Vector3{0, 0, 0},
            py::arg("pressures") = py::none(), py::arg("stretches") = py::none(), py::arg("mass_damping") = 0.0,
            py::arg("tolerance") = 1e-8, "One step of backward Euler, stable for any time_step (s).");
}

} // namespace hybmss::python
