#pragma once

/// \file
/// A lattice's cells as hexahedral finite elements.

#include "hybmss/lattice.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace hybmss::calculix {

enum class ElementType {
    c3d8i, ///< 8 nodes, trilinear with incompatible bending modes
    c3d20  ///< 20 nodes, quadratic
};

/// "C3D8I" or "C3D20", as CalculiX and Abaqus call them.
std::string_view name(ElementType type);

/// One element a cell. The first nodes are the lattice's, in its order; those in the middle of edges follow.
struct BrickMesh {
    ElementType type = ElementType::c3d8i;
    std::vector<std::array<double, 3>> rest; ///< m
    std::size_t lattice_nodes = 0;
    /// nodes_per_element() a cell, numbered from 0, in the order of Abaqus: the corners of the low z face and of the
    /// high one, counterclockwise seen from above; then the middles of the edges below, above and upright.
    std::vector<std::uint32_t> elements;
    std::vector<float> scales; ///< one an element: of the stiffness
    double cell_size = 1;      ///< m

    std::size_t nodes_per_element() const { return type == ElementType::c3d8i ? 8 : 20; }
    std::size_t element_count() const { return scales.size(); }
    /// The part of an element's weight that its nodes carry under uniform acceleration: the integral of their shape
    /// functions, 1/8 or, of the quadratic element, -1/8 at corners and 1/6 at edges.
    double weight_share(std::size_t node_of_element) const;
};

/// `origin` in m: where the grid's low corner lies.
BrickMesh brick_mesh(const Lattice& lattice, ElementType type, const std::array<double, 3>& origin = {0, 0, 0});

} // namespace hybmss::calculix
