#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace hybmss {

RestShape rest_shape(const Network& network, const Network::Cell& cell) {
    RestShape shape{};
    auto& e = shape.edges;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const auto& x = network.rest_positions[static_cast<std::size_t>(cell.nodes[corner])];
        for (std::size_t edge = 0; edge < 3; ++edge) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                e[3 * edge + axis] += (corner >> edge & 1 ? 0.25 : -0.25) * x[axis];
            }
        }
    }
    shape.volume =
        e[0] * (e[4] * e[8] - e[5] * e[7]) + e[1] * (e[5] * e[6] - e[3] * e[8]) + e[2] * (e[3] * e[7] - e[4] * e[6]);
    return shape;
}

PolyhedronVectors polyhedron_vectors(const Network& network, const Network::Polyhedron& polyhedron) {
    std::array<std::array<double, 3>, 6> corners{};
    for (std::size_t c = 0; c < polyhedron.node_count(); ++c) {
        corners[c] = network.rest_positions[static_cast<std::size_t>(polyhedron.nodes[c])];
    }
    return polyhedron_vectors(polyhedron.shape, corners);
}

PolyhedronVectors polyhedron_vectors(CellShape shape, const std::array<std::array<double, 3>, 6>& corners) {
    PolyhedronVectors made{};
    const auto at = [&](std::size_t node, std::size_t axis) { return corners[node][axis]; };
    auto& v = made.vectors;
    for (std::size_t c = 0; c < 3; ++c) {
        switch (shape) {
        case CellShape::tetrahedron:
            for (std::size_t e = 0; e < 3; ++e) {
                v[e][c] = at(e + 1, c) - at(0, c);
            }
            break;
        case CellShape::pyramid:
            v[0][c] = at(4, c) - (at(0, c) + at(1, c) + at(2, c) + at(3, c)) / 4;
            v[1][c] = at(2, c) - at(0, c);
            v[2][c] = at(3, c) - at(1, c);
            break;
        case CellShape::prism:
            v[0][c] = (at(3, c) - at(0, c) + at(4, c) - at(1, c) + at(5, c) - at(2, c)) / 3;
            for (std::size_t e = 1; e < 3; ++e) {
                const double low = at(e, c) - at(0, c), high = at(e + 3, c) - at(3, c);
                v[e][c] = (low + high) / 2;
                v[e + 2][c] = high - low;
            }
            break;
        }
    }
    const auto triple = [&](std::size_t b, std::size_t e) {
        return v[0][0] * (v[b][1] * v[e][2] - v[b][2] * v[e][1]) + v[0][1] * (v[b][2] * v[e][0] - v[b][0] * v[e][2]) +
               v[0][2] * (v[b][0] * v[e][1] - v[b][1] * v[e][0]);
    };
    made.volume = shape == CellShape::prism ? triple(1, 2) / 2 + triple(3, 4) / 24 : triple(1, 2) / 6;
    return made;
}

std::array<std::array<double, 3>, 6> volume_gradient(CellShape shape,
                                                     const std::array<std::array<double, 3>, 6>& corners) {
    const auto& v = polyhedron_vectors(shape, corners).vectors;
    const auto cross = [&](std::size_t a, std::size_t b) {
        return std::array<double, 3>{v[a][1] * v[b][2] - v[a][2] * v[b][1], v[a][2] * v[b][0] - v[a][0] * v[b][2],
                                     v[a][0] * v[b][1] - v[a][1] * v[b][0]};
    };
    std::array<std::array<double, 3>, 6> gradient{};
    const auto add = [&](std::size_t corner, double factor, const std::array<double, 3>& by) {
        for (std::size_t c = 0; c < 3; ++c) {
            gradient[corner][c] += factor * by[c];
        }
    };
    const double all = shape == CellShape::prism ? 0.5 : 1.0 / 6;
    const std::array<double, 3> bc = cross(1, 2), ca = cross(2, 0), ab = cross(0, 1);
    switch (shape) {
    case CellShape::tetrahedron:
        for (std::size_t e = 0; e < 3; ++e) {
            const auto& by = e == 0 ? bc : e == 1 ? ca : ab;
            add(e + 1, all, by);
            add(0, -all, by);
        }
        break;
    case CellShape::pyramid:
        add(4, all, bc);
        for (std::size_t corner = 0; corner < 4; ++corner) {
            add(corner, -all / 4, bc);
        }
        add(2, all, ca);
        add(0, -all, ca);
        add(3, all, ab);
        add(1, -all, ab);
        break;
    case CellShape::prism: {
        const std::array<double, 3> de = cross(3, 4), ea = cross(4, 0), ad = cross(0, 3);
        for (std::size_t corner = 0; corner < 6; ++corner) {
            const double side = corner < 3 ? -all / 3 : all / 3;
            add(corner, side, bc);
            add(corner, side / 12, de);
        }
        for (const std::size_t high : {std::size_t{0}, std::size_t{3}}) {
            const double twist = high == 0 ? -all / 12 : all / 12;
            add(high + 1, all / 2, ca);
            add(high, -all / 2, ca);
            add(high + 2, all / 2, ab);
            add(high, -all / 2, ab);
            add(high + 1, twist, ea);
            add(high, -twist, ea);
            add(high + 2, twist, ad);
            add(high, -twist, ad);
        }
        break;
    }
    }
    return gradient;
}

std::vector<std::uint32_t> polyhedra_of(const Network& network, CellShape shape) {
    std::vector<std::uint32_t> numbers;
    for (std::size_t p = 0; network.volume_energy != VolumeEnergy::none && p < network.polyhedra.size(); ++p) {
        if (network.polyhedra[p].shape == shape) {
            numbers.push_back(static_cast<std::uint32_t>(p));
        }
    }
    return numbers;
}

NodalVolumes nodal_volumes(const Network& network) {
    NodalVolumes nodal{std::vector<double>(network.masses.size(), 0.0),
                       std::vector<double>(network.masses.size(), 0.0)};
    for (const Network::Polyhedron& polyhedron : network.polyhedra) {
        const double part =
            polyhedron_vectors(network, polyhedron).volume / static_cast<double>(polyhedron.node_count());
        for (std::size_t c = 0; c < polyhedron.node_count(); ++c) {
            const auto node = static_cast<std::size_t>(polyhedron.nodes[c]);
            nodal.volumes[node] += part;
            nodal.kappas[node] += part * polyhedron.kappa;
        }
    }
    for (std::size_t n = 0; n < nodal.volumes.size(); ++n) {
        nodal.kappas[n] = nodal.volumes[n] > 0 ? nodal.kappas[n] / nodal.volumes[n] : 0;
    }
    return nodal;
}

Network::Cell as_hexahedron(const Network::Polyhedron& polyhedron) {
    const auto& n = polyhedron.nodes;
    switch (polyhedron.shape) {
    case CellShape::pyramid: // around its base the nodes 0 1 2 3, by bits 0 1 3 2
        return {{n[0], n[1], n[3], n[2], n[4], n[4], n[4], n[4]}, polyhedron.kappa, 0};
    case CellShape::prism:
        return {{n[0], n[1], n[2], n[2], n[3], n[4], n[5], n[5]}, polyhedron.kappa, 0};
    case CellShape::tetrahedron:
        break;
    }
    return {{n[0], n[1], n[2], n[2], n[3], n[3], n[3], n[3]}, polyhedron.kappa, 0};
}

double rest_length2(const Network::Spring& spring) {
    const auto& r = spring.rest_vector;
    return r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
}

MeanCell mean_cell(const Network& network, const Network::Cell& cell) {
    const double h = rest_shape(network, cell).edges[0], k = cell.scale * network.means.springs.cube_diagonal;
    return {k * h, 1 / h, cell.kappa * h / (32 * k)};
}

std::vector<const Network::Cell*> cells_of(const Network& network, bool on_means) {
    std::vector<const Network::Cell*> cells;
    for (const Network::Cell& cell : network.cells) {
        if ((cell.scale > 0) == on_means) {
            cells.push_back(&cell);
        }
    }
    return cells;
}

std::vector<std::uint32_t> row_order(std::span<const std::array<double, 3>> points, double spacing) {
    std::vector<std::uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    if (points.empty()) {
        return order;
    }
    std::array<double, 3> low = points[0], high = points[0];
    for (const auto& x : points) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], x[c]);
            high[c] = std::max(high[c], x[c]);
        }
    }
    std::array<std::size_t, 3> axes = {0, 1, 2}; // fastest first
    const auto counts = [&](std::size_t c) { return std::round((high[c] - low[c]) / spacing); };
    std::stable_sort(axes.begin(), axes.end(), [&](std::size_t a, std::size_t b) { return counts(a) < counts(b); });
    struct Key {
        double plane, row, along;
        bool operator<(const Key& other) const {
            return std::tie(plane, row, along) < std::tie(other.plane, other.row, other.along);
        }
    };
    std::vector<Key> key;
    key.reserve(points.size());
    for (const auto& x : points) {
        const auto count = [&](std::size_t c) { return std::round((x[c] - low[c]) / spacing); };
        key.push_back({count(axes[2]), count(axes[1]), x[axes[0]]});
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key[a] < key[b]; });
    return order;
}

} // namespace hybmss
