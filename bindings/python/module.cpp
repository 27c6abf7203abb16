// import hybmss

#include "bindings.hpp"

#include "hybmss/version.hpp"

PYBIND11_MODULE(hybmss, module) {
    module.doc() =
        "Elastic bodies as hybrid mass-spring systems: forces and energies over NumPy arrays, motion, scenes.";
    module.attr("__version__") = hybmss::kVersion;
    hybmss::python::bind_bodies(module);
    hybmss::python::bind_plans(module);
    hybmss::python::bind_dynamics(module);
    hybmss::python::bind_simulation(module);
}
