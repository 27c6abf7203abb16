// import hybmss: the module, and the bodies in it.

#include "bindings.hpp"

#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/moduli.hpp"
#include "hybmss/version.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace hybmss::python {

namespace {

/// scales[i, j, k], as in the voxel files of scenes. In Fortran's order, which pybind11 makes of any other, x is the
/// fastest, as it is here.
Lattice from_scales(const py::array_t<float, py::array::f_style | py::array::forcecast>& scales, double cell_size) {
    if (scales.ndim() != 3) {
        throw std::invalid_argument("scales: " + std::to_string(scales.ndim()) +
                                    " dimensions are not allowed: there must be three, [x, y, z]");
    }
    return Lattice::from_cells(static_cast<int>(scales.shape(0)), static_cast<int>(scales.shape(1)),
                               static_cast<int>(scales.shape(2)), cell_size,
                               std::vector<float>(scales.data(), scales.data() + scales.size()));
}

/// labels[i, j, k], likewise.
Lattice from_materials(const py::array_t<std::uint8_t, py::array::f_style | py::array::forcecast>& labels,
                       double cell_size, const std::vector<Material>& materials) {
    if (labels.ndim() != 3) {
        throw std::invalid_argument("labels: " + std::to_string(labels.ndim()) +
                                    " dimensions are not allowed: there must be three, [x, y, z]");
    }
    return Lattice::from_materials(static_cast<int>(labels.shape(0)), static_cast<int>(labels.shape(1)),
                                   static_cast<int>(labels.shape(2)), cell_size,
                                   std::span(labels.data(), static_cast<std::size_t>(labels.size())), materials);
}

py::array_t<double> rest_positions(const Lattice& lattice) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    py::array_t<double> positions({static_cast<py::ssize_t>(nodes.size()), py::ssize_t{3}});
    double* to = positions.mutable_data();
    for (const std::uint32_t node : nodes) {
        for (const double x : lattice.rest_position(node)) {
            *to++ = x;
        }
    }
    return positions;
}

} // namespace

void bind_bodies(py::module_& module) {
    py::enum_<VolumeEnergy>(module, "VolumeEnergy", "Which function of the cell volume ratio the volume energy uses.")
        .value("automatic", VolumeEnergy::automatic)
        .value("quadratic", VolumeEnergy::quadratic)
        .value("mean_stretch", VolumeEnergy::mean_stretch)
        .value("none", VolumeEnergy::none);
    py::enum_<SpringForm>(module, "SpringForm", "Where springs act.")
        .value("nodes", SpringForm::nodes, "between nodes")
        .value("means", SpringForm::means, "on the means of each cell (HybMSS-M)");

    py::class_<Material>(module, "Material", "An isotropic elastic material, SI units.")
        .def(py::init([](double young_modulus, double poisson_ratio, double density, double face_diagonal_ratio,
                         VolumeEnergy volume_energy, double stiffening_quadratic, double stiffening_cubic,
                         SpringForm springs, double crush_resistance, double crush_ratio) {
                 const Material material = {young_modulus, poisson_ratio,
                                            density,       face_diagonal_ratio,
                                            volume_energy, {stiffening_quadratic, stiffening_cubic},
                                            springs,       {crush_resistance, crush_ratio}};
                 validate(material);
                 return material;
             }),
             py::kw_only(), py::arg("young_modulus") = 1e4, py::arg("poisson_ratio") = 0.25,
             py::arg("density") = 1000.0, py::arg("face_diagonal_ratio") = 1.0,
             py::arg("volume_energy") = VolumeEnergy::automatic, py::arg("stiffening_quadratic") = 0.0,
             py::arg("stiffening_cubic") = 0.0, py::arg("springs") = SpringForm::nodes,
             py::arg("crush_resistance") = 0.0, py::arg("crush_ratio") = 0.7,
             "Springs of strain e bear k l (e + stiffening_quadratic e^2 + stiffening_cubic e^3). Cells below the "
             "volume ratio J0 = crush_ratio store G V0 crush_resistance (J0 - J)^3 / (3 J0^2). Raises ValueError for a "
             "value that is not allowed.")
        .def_static(
            "young_and_poisson",
            [](std::optional<double> young_modulus, std::optional<double> poisson_ratio,
               std::optional<double> shear_modulus, std::optional<double> bulk_modulus,
               std::optional<double> lame_modulus) {
                const YoungAndPoisson found = hybmss::young_and_poisson(
                    {young_modulus, poisson_ratio, shear_modulus, bulk_modulus, lame_modulus});
                return py::dict(py::arg("young_modulus") = found.young_modulus,
                                py::arg("poisson_ratio") = found.poisson_ratio);
            },
            py::kw_only(), py::arg("young_modulus") = py::none(), py::arg("poisson_ratio") = py::none(),
            py::arg("shear_modulus") = py::none(), py::arg("bulk_modulus") = py::none(),
            py::arg("lame_modulus") = py::none(),
            "E and nu by any two of the moduli, as arguments: Material(**Material.young_and_poisson(shear_modulus=1e3, "
            "bulk_modulus=1e5), density=1000). Raises ValueError where they make no material.")
        .def_readonly("young_modulus", &Material::young_modulus, "E, Pa")
        .def_readonly("poisson_ratio", &Material::poisson_ratio, "nu, in (-1, 1/2)")
        .def_readonly("density", &Material::density, "kg/m^3")
        .def_readonly("face_diagonal_ratio", &Material::face_diagonal_ratio, "A = k_f / k_c")
        .def_readonly("volume_energy", &Material::volume_energy)
        .def_readonly("springs", &Material::springs)
        .def_property_readonly("stiffening_quadratic", [](const Material& m) { return m.stiffening.quadratic; })
        .def_property_readonly("stiffening_cubic", [](const Material& m) { return m.stiffening.cubic; })
        .def_property_readonly("crush_resistance", [](const Material& m) { return m.crush.stiffness; })
        .def_property_readonly("crush_ratio", [](const Material& m) { return m.crush.ratio; });

    py::class_<Lattice>(module, "Lattice", "Cubic cells of one grid; nodes x fastest, then y, then z.")
        .def_static("box", &Lattice::box, py::arg("nx"), py::arg("ny"), py::arg("nz"), py::arg("cell_size"),
                    "A full box of nx * ny * nz cells, cell_size in m.")
        .def_static(
            "from_scales", &from_scales, py::arg("scales"), py::arg("cell_size"),
            "Cells with stiffness scales[x, y, z], the indices of a scene's voxel file, in any order of memory; "
            "0: no cell there.")
        .def_static("from_materials", &from_materials, py::arg("labels"), py::arg("cell_size"), py::arg("materials"),
                    "Cells of several materials, labels[x, y, z] as for from_scales: 0: no cell there, n: "
                    "materials[n - 1]. The first is the body's; the others may differ from it in young_modulus, "
                    "poisson_ratio and density.")
        .def_property_readonly("cells", &Lattice::cells, "Cells of the grid along x, y and z.")
        .def_property_readonly("cell_size", &Lattice::cell_size, "m")
        .def_property_readonly("cell_count", &Lattice::cell_count, "Cells that are there.")
        .def_property_readonly("node_count", [](const Lattice& l) { return l.nodes().size(); })
        .def("rest_positions", &rest_positions, "A new (nodes, 3) array, m.");
}

} // namespace hybmss::python

PYBIND11_MODULE(_hybmss, module) {
    module.doc() =
        "Elastic bodies as hybrid mass-spring systems: forces and energies over NumPy arrays, motion, scenes.";
    module.attr("__version__") = hybmss::kVersion;
    hybmss::python::bind_bodies(module);
    hybmss::python::bind_networks(module);
    hybmss::python::bind_plans(module);
    hybmss::python::bind_dynamics(module);
    hybmss::python::bind_equilibria(module);
    hybmss::python::bind_simulation(module);
}
