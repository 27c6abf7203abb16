#pragma once

#include <pybind11/pybind11.h>

namespace hybmss::python {

namespace py = pybind11;

void bind_bodies(py::module_& module);
void bind_plans(py::module_& module);
void bind_dynamics(py::module_& module);
void bind_simulation(py::module_& module);

} // namespace hybmss::python
