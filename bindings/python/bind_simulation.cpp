#include "bindings.hpp"

#include "hybmss/record.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "hybmss/simulation/solve_to_accuracy.hpp"

#include <pybind11/stl.h>

#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hybmss::python {

namespace {

py::array_t<double> array_of(const std::vector<std::array<double, 3>>& vectors) {
    py::array_t<double> array({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}});
    for (std::size_t n = 0; n < vectors.size(); ++n) {
        std::copy(vectors[n].begin(), vectors[n].end(), array.mutable_data(static_cast<py::ssize_t>(n), 0));
    }
    return array;
}

py::dict dictionary(const Summary& summary) {
    py::dict probes;
    for (const ProbeReading& probe : summary.probes) {
        probes[py::str(probe.name)] = py::dict(py::arg("force") = probe.force, py::arg("torque") = probe.torque,
                                               py::arg("mean_displacement") = probe.mean_displacement,
                                               py::arg("max_displacement") = probe.max_displacement);
    }
    const bool buckling = summary.method == SolverMethod::buckling;
    py::list modes;
    for (const ModeReading& mode : summary.modes) {
        py::dict one(py::arg("residual") = mode.residual, py::arg("shape") = array_of(mode.shape));
        one[buckling ? "factor" : "frequency"] = mode.value;
        modes.append(one);
    }
    py::dict result(py::arg("converged") = summary.converged, py::arg("failure") = summary.failure,
                    py::arg("relative_volume_change") = summary.volume.relative_volume_change,
                    py::arg("steps") = summary.steps, py::arg("time") = summary.time,
                    py::arg("residual") = summary.settlement.residual, py::arg("wall_seconds") = summary.wall_seconds,
                    py::arg("warnings") = summary.warnings, py::arg("probes") = probes);
    if (!summary.modes.empty()) {
        result[buckling ? "buckling" : "modes"] = modes;
    }
    return result;
}

py::dict run(Simulation& simulation) {
    Summary summary;
    {
        const py::gil_scoped_release released;
        summary = simulation.run();
    }
    return dictionary(summary);
}

SimulationOptions options(const std::string& precision, int threads) {
    SimulationOptions options;
    options.precision = parse_precision(precision);
    options.plan.threads = threads;
    return options;
}

py::object report(const std::optional<AccuracyReport>& accuracy) {
    if (!accuracy) {
        return py::none();
    }
    const AccuracyReport& a = *accuracy;
    return py::dict(py::arg("wanted") = a.wanted, py::arg("error_estimate") = a.error_estimate,
                    py::arg("quantity") = a.quantity, py::arg("free_mesh") = a.free_mesh,
                    py::arg("precision") = std::string(name(a.precision)), py::arg("reached") = a.reached());
}

py::tuple accurate_solution(const std::string& scene, const std::optional<std::string>& precision, int threads) {
    AccuracyOptions wanted;
    wanted.simulation = options(precision.value_or("double"), threads);
    wanted.choose_precision = !precision;
    const Scene loaded = load_scene(scene);
    std::optional<AccurateSolution> solution;
    {
        const py::gil_scoped_release released;
        solution = solve_to_accuracy(loaded, wanted);
    }
    py::dict summary = dictionary(solution->summary);
    summary["accuracy"] = report(solution->summary.accuracy);
    return py::make_tuple(std::move(solution->simulation), summary);
}

double force_error(const Record& record, std::size_t state, const py::array& forces) {
    const std::size_t nodes = record.lattice.nodes().size();
    const RecordDifference difference =
        py::isinstance<py::array_t<float>>(forces)
            ? compare_forces<float>(record, state, input<float>(forces, nodes, "forces"))
            : compare_forces<double>(record, state, input<double>(forces, nodes, "forces"));
    if (!difference.within()) {
        char figures[96];
        std::snprintf(figures, sizeof figures, "%.3g, tolerance %.3g", difference.error, difference.tolerance);
        throw py::value_error("state " + std::to_string(state) + ": forces on node " + std::to_string(difference.node) +
                              " differ from the recorded ones: relative error " + figures);
    }
    return difference.error;
}

} // namespace

void bind_simulation(py::module_& module) {
    py::register_exception<SceneError>(module, "SceneError", PyExc_ValueError);
    py::register_exception<RecordError>(module, "RecordError", PyExc_ValueError);

    py::class_<Simulation>(module, "Simulation", "A scene in the course of time, or at rest.")
        .def(py::init([](const std::string& scene, const std::string& precision, int threads) {
                 return Simulation(load_scene(scene), options(precision, threads));
             }),
             py::arg("scene"), py::kw_only(), py::arg("precision") = "double", py::arg("threads") = 0,
             "Reads a scene file (TOML). Raises SceneError, which names file, line and what is allowed.")
        .def("run", &run,
             "Runs to the end; returns what came of it. With the methods \"modes\" and \"buckling\" that has a list of "
             "the "
             "name: frequency (Hz) or factor, residual, and the shape, one row a node.")
        .def(
            "step",
            [](Simulation& simulation, long count) {
                const py::gil_scoped_release released;
                simulation.step(count);
            },
            py::arg("count") = 1)
        .def_property_readonly("time", &Simulation::time, "s")
        .def_property_readonly("lattice", &Simulation::lattice)
        .def_property_readonly("displacements", [](const Simulation& s) { return array_of(s.displacements()); })
        .def_property_readonly("velocities", [](const Simulation& s) { return array_of(s.velocities()); })
        .def(
            "cell_stresses", [](const Simulation& s) { return stress_arrays(s.cell_stresses()); },
            "Of the cells that are left, as StressMeter.read() gives them.");

    module.def("solve_to_accuracy", &accurate_solution, py::arg("scene"), py::kw_only(),
               py::arg("precision") = py::none(), py::arg("threads") = 0,
               "Solves a static scene with solver.accuracy, on a mesh of its choice where the scene leaves it free.\n\n"
               "Returns the simulation at its equilibrium and what run() returns, with an \"accuracy\" (None where no "
               "error\ncan be told). Without a precision float where it is enough, double else.");

    py::class_<Record>(module, "Record",
                       "States and forces to check other programs against: a file of `hybmss record`.")
        .def(py::init([](const std::string& path) { return load_record(path); }), py::arg("path"),
             "Raises RecordError for a file that is damaged, foreign or not there.")
        .def("__len__", [](const Record& record) { return record.states.size(); })
        .def_property_readonly("lattice", [](const Record& record) { return record.lattice; })
        .def_property_readonly("material", [](const Record& record) { return record.material; })
        .def(
            "displacements",
            [](const Record& record, std::size_t state) {
                if (state >= record.states.size()) {
                    throw py::index_error("the record has " + std::to_string(record.states.size()) + " states");
                }
                return array_of(record.states[state].displacements);
            },
            py::arg("state"), "(nodes, 3), m.")
        .def("check_forces", &force_error, py::arg("state"), py::arg("forces"),
             "The relative error of the forces; raises ValueError where it is above the record's tolerance.");
}

} // namespace hybmss::python
