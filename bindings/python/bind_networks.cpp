// Cells of other shapes than cubes, and lattices that part along faces.

#include "bindings.hpp"

#include "hybmss/polyhedra.hpp"
#include "hybmss/separation.hpp"

#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hybmss::python {

namespace {

using Faces = std::vector<std::array<std::uint32_t, 2>>;
using Cells = std::vector<std::vector<std::int32_t>>;

py::array_t<double> rows_array(const std::vector<std::array<double, 3>>& rows) {
    py::array_t<double> array({static_cast<py::ssize_t>(rows.size()), py::ssize_t{3}});
    double* to = array.mutable_data();
    for (const std::array<double, 3>& row : rows) {
        to = std::copy(row.begin(), row.end(), to);
    }
    return array;
}

template <class T>
py::array_t<T> values_array(const std::vector<T>& values) {
    return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

Cells cell_lists(const std::vector<Network::Polyhedron>& cells) {
    Cells lists;
    for (const Network::Polyhedron& cell : cells) {
        lists.emplace_back(cell.nodes.begin(), cell.nodes.begin() + static_cast<std::ptrdiff_t>(cell.node_count()));
    }
    return lists;
}

CellMesh cell_mesh_of(const std::vector<std::array<double, 3>>& nodes, const Cells& cells) {
    CellMesh mesh{nodes, {}};
    for (std::size_t c = 0; c < cells.size(); ++c) {
        if (cells[c].size() < 4 || cells[c].size() > 6) {
            throw std::invalid_argument("cell " + std::to_string(c) + ": " + std::to_string(cells[c].size()) +
                                        " nodes are not allowed: 4 of a tetrahedron, 5 of a pyramid or 6 of a prism");
        }
        Network::Polyhedron cell{static_cast<CellShape>(cells[c].size()), {}, 0};
        std::copy(cells[c].begin(), cells[c].end(), cell.nodes.begin());
        mesh.cells.push_back(cell);
    }
    return mesh;
}

} // namespace

void bind_networks(py::module_& module) {
    py::class_<Network>(module, "Network", "Explicit springs and cells: what is made of cells that are no cubes.")
        .def_property_readonly("node_count", [](const Network& n) { return n.masses.size(); })
        .def_property_readonly("spring_count", [](const Network& n) { return n.springs.size(); })
        .def_property_readonly(
            "masses", [](const Network& n) { return values_array(n.masses); }, "A new array, kg.")
        .def(
            "rest_positions", [](const Network& n) { return rows_array(n.rest_positions); },
            "A new (nodes, 3) array, m.")
        .def(
            "cells", [](const Network& n) { return cell_lists(n.polyhedra); },
            "The nodes of its tetrahedra (4), pyramids (5) and prisms (6); its cubes are not among them.");

    py::class_<FittedCells>(module, "FittedCells", "A mesh with fitted springs, and how good they are, relative.")
        .def_readonly("network", &FittedCells::network)
        .def_readonly("misfit", &FittedCells::misfit, "Around nodes, root mean square by volume.")
        .def_readonly("anisotropy", &FittedCells::anisotropy, "Of the mean over the body.")
        .def_readonly("modulus_error", &FittedCells::modulus_error, "Of the mean of the shear modulus.")
        .def_readonly("without", &FittedCells::without, "Pairs of nodes that have no spring.");

    py::class_<SeparatedNetwork>(module, "SeparatedNetwork",
                                 "A lattice cut along faces, and where its nodes come from.")
        .def_readonly("network", &SeparatedNetwork::network)
        .def_property_readonly(
            "lattice_nodes", [](const SeparatedNetwork& s) { return values_array(s.lattice_nodes); },
            "Of each node its number in the lattice.")
        .def_property_readonly(
            "corners", [](const SeparatedNetwork& s) { return s.corners; }, "The eight nodes of each cell.");

    module.def(
        "tetrahedron_lattice",
        [](const std::array<int, 3>& cells, double edge, const Material& material, bool nodal_volumes) {
            Network made = tetrahedron_lattice(cells, edge, material);
            made.nodal_volumes = nodal_volumes;
            return made;
        },
        py::arg("cells"), py::arg("edge"), py::arg("material"), py::kw_only(), py::arg("nodal_volumes") = true,
        "A box of so many cubes with edges of `edge` m, filled by tetrahedra with isotropic springs; `nodal_volumes`: "
        "nodes resist the change of the volume around them.");
    module.def("pyramid_lattice", &pyramid_lattice, py::arg("cells"), py::arg("edge"), py::arg("material"),
               "Likewise of six pyramids a cube.");
    module.def("prism_lattice", &prism_lattice, py::arg("cells"), py::arg("edge"), py::arg("height"),
               py::arg("material"), "Likewise of two prisms in the place of each cube, on equilateral triangles.");
    module.def(
        "read_cells",
        [](const std::string& path) {
            const CellMesh mesh = read_cells(path);
            return py::make_tuple(rows_array(mesh.nodes), cell_lists(mesh.cells));
        },
        py::arg("path"),
        "Nodes (n, 3) and cells of a .msh (2.2, 4.1) or legacy .vtk file, as fit_springs() takes them.");
    module.def(
        "fit_springs",
        [](const std::vector<std::array<double, 3>>& nodes, const Cells& cells, const Material& material,
           double most_anisotropy) { return fit_springs(cell_mesh_of(nodes, cells), material, most_anisotropy); },
        py::arg("nodes"), py::arg("cells"), py::arg("material"), py::kw_only(), py::arg("most_anisotropy") = 0.1,
        "Springs as isotropic as those of this mesh can be. Cells have 4, 5 or 6 nodes. Raises ValueError where "
        "anisotropy or modulus_error are above the most.");
    module.def(
        "separate",
        [](const Lattice& lattice, const Material& material, const Faces& faces) {
            return separate(lattice, material, faces);
        },
        py::arg("lattice"), py::arg("material"), py::arg("faces"),
        "The network of a lattice whose cells have parted along faces, two neighbouring cells each. No mass is lost.");
    module.def(
        "torn_faces",
        [](const Lattice& lattice, const SeparatedNetwork& body, const py::array& displacements, double tear_strain) {
            const std::size_t nodes = body.network.rest_positions.size();
            return torn_faces(lattice, body, input<double>(displacements, nodes, "displacements"), tear_strain);
        },
        py::arg("lattice"), py::arg("body"), py::arg("displacements"), py::arg("tear_strain"),
        "The faces across which cells are stretched by more than the strain, as separate() takes them besides those "
        "that parted before.");
    module.def(
        "nodes_before",
        [](const SeparatedNetwork& before, const SeparatedNetwork& after) {
            return values_array(nodes_before(before, after));
        },
        py::arg("before"), py::arg("after"), "Of each node of `after` that of `before` whose state it goes on with.");
}

} // namespace hybmss::python
