#pragma once

/// \file
/// The parts of the module, and NumPy arrays as the library's fields: views of the same memory, never copies.

#include "hybmss/network.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/stress.hpp"
#include "hybmss/vector_field.hpp"

#include <pybind11/numpy.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace hybmss::python {

namespace py = pybind11;

void bind_bodies(py::module_& module);
void bind_networks(py::module_& module);
void bind_plans(py::module_& module);
void bind_dynamics(py::module_& module);
void bind_equilibria(py::module_& module);
void bind_simulation(py::module_& module);

/// A set of axes by their letters: bit 0 is x. Throws std::invalid_argument.
std::uint8_t axes_of(const std::string& axes);

/// The options of plans and dynamics by their names in Python.
PlanOptions plan_options(int threads, const std::string& layout, const std::string& instruction_set,
                         const std::string& accuracy, const std::string& effort);

/// Refuses (ValueError) what is no array of T with the shape (nodes, 3), or has strides that are no whole components.
template <class T>
inline void check(const py::array& array, std::size_t nodes, const char* name) {
    const auto refuse = [name](const std::string& reason) {
        throw std::invalid_argument(std::string(name) + ": " + reason);
    };
    if (!py::isinstance<py::array_t<T>>(array)) {
        refuse("dtype " + py::cast<std::string>(py::str(array.dtype())) + " is not allowed: here it must be " +
               py::cast<std::string>(py::str(py::dtype::of<T>())));
    }
    if (array.ndim() != 2 || static_cast<std::size_t>(array.shape(0)) != nodes || array.shape(1) != 3) {
        refuse("shape " + py::cast<std::string>(py::str(array.attr("shape"))) + " is not allowed: it must be (" +
               std::to_string(nodes) + ", 3)");
    }
    constexpr auto kSize = static_cast<py::ssize_t>(sizeof(T));
    if (array.strides(0) % kSize != 0 || array.strides(1) % kSize != 0) {
        refuse("its strides are no multiples of the size of its numbers");
    }
}

/// Rows may be anywhere: C or Fortran order, every other row, fields of a structured array.
template <class T>
VectorField<const T> input(const py::array& array, std::size_t nodes, const char* name) {
    check<T>(array, nodes, name);
    const auto* first = static_cast<const T*>(array.data());
    const std::ptrdiff_t component = array.strides(1) / static_cast<std::ptrdiff_t>(sizeof(T));
    return {first, first + component, first + 2 * component, array.strides(0) / static_cast<std::ptrdiff_t>(sizeof(T)),
            nodes};
}
template <class T>
VectorField<T> output(py::array& array, std::size_t nodes, const char* name) {
    check<T>(array, nodes, name);
    if (!array.writeable() || (nodes > 1 && array.strides(0) == 0) || array.strides(1) == 0) {
        throw std::invalid_argument(std::string(name) + ": it cannot be written to");
    }
    auto* first = static_cast<T*>(array.mutable_data());
    const std::ptrdiff_t component = array.strides(1) / static_cast<std::ptrdiff_t>(sizeof(T));
    return {first, first + component, first + 2 * component, array.strides(0) / static_cast<std::ptrdiff_t>(sizeof(T)),
            nodes};
}

/// A new array of zeros, (nodes, 3).
template <class T>
py::array_t<T> zeros(std::size_t nodes) {
    py::array_t<T> array({static_cast<py::ssize_t>(nodes), py::ssize_t{3}});
    std::fill_n(array.mutable_data(), 3 * nodes, T(0));
    return array;
}

/// Arrays by name, a row a cell: tensors (cells, 6) in the order of CellStress, first_piola (cells, 3, 3).
inline py::dict stress_arrays(std::span<const CellStress> stresses) {
    const auto cells = static_cast<py::ssize_t>(stresses.size());
    py::array_t<double> piola({cells, py::ssize_t{3}, py::ssize_t{3}}), cauchy({cells, py::ssize_t{6}}),
        strain({cells, py::ssize_t{6}}), ratio(cells), density(cells), von_mises(cells), pressure(cells);
    for (std::size_t n = 0; n < stresses.size(); ++n) {
        const CellStress& stress = stresses[n];
        std::copy_n(stress.first_piola.data(), 9, piola.mutable_data() + 9 * n);
        std::copy_n(stress.cauchy.data(), 6, cauchy.mutable_data() + 6 * n);
        std::copy_n(stress.green_strain.data(), 6, strain.mutable_data() + 6 * n);
        ratio.mutable_data()[n] = stress.volume_ratio;
        density.mutable_data()[n] = stress.energy_density;
        von_mises.mutable_data()[n] = stress.von_mises();
        pressure.mutable_data()[n] = stress.pressure();
    }
    return py::dict(py::arg("first_piola") = piola, py::arg("cauchy") = cauchy, py::arg("green_strain") = strain,
                    py::arg("volume_ratio") = ratio, py::arg("energy_density") = density,
                    py::arg("von_mises") = von_mises, py::arg("pressure") = pressure);
}

/// The __init__ of a Network, beside that of a lattice and a material: (network, dtype, threads).
template <class Made>
auto of_network() {
    return py::init([](const Network& network, const py::object& dtype, int threads) {
        PlanOptions options;
        options.threads = threads;
        return Made(dtype, network, options);
    });
}

/// "float32" or "float64", or what NumPy takes for them. True for the latter.
inline bool is_double(const py::object& dtype) {
    const py::dtype wanted = py::dtype::from_args(dtype);
    if (wanted.is(py::dtype::of<double>()) || wanted.equal(py::dtype::of<double>())) {
        return true;
    }
    if (wanted.equal(py::dtype::of<float>())) {
        return false;
    }
    throw std::invalid_argument("dtype " + py::cast<std::string>(py::str(static_cast<const py::object&>(wanted))) +
                                " is not allowed: it must be float32 or float64");
}

} // namespace hybmss::python
