#include "solvers/newton/body_geometry.hpp"

#include "layouts/network/network_geometry.hpp"
#include "layouts/node_numbers.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss {

BodyScales BodyScales::of(const Lattice& lattice, const Material& material) {
    const SpringConstants k = spring_constants(material, lattice.cell_size());
    const auto scales = lattice.cell_scales();
    const double stiffest = std::max({k.edge, std::sqrt(2.0) * k.face_diagonal, std::sqrt(3.0) * k.cube_diagonal});
    double square = 0;
    for (const int n : lattice.cells()) {
        square += static_cast<double>(n) * n;
    }
    return {static_cast<double>(*std::max_element(scales.begin(), scales.end())) * stiffest * lattice.cell_size(),
            lattice.cell_size(), std::sqrt(square) * lattice.cell_size()};
}

BodyScales BodyScales::of(const Network& network) {
    BodyScales scales;
    double sum = 0, springs = 0, square = 0;
    for_each_spring(network, [&](std::int32_t, std::int32_t, double stiffness, double length) {
        sum += length;
        ++springs;
        scales.spring_force = std::max(scales.spring_force, stiffness * length);
    });
    if (springs > 0) {
        scales.spring_length = sum / springs;
    }
    for (std::size_t c = 0; c < 3; ++c) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (const auto& x : network.rest_positions) {
            low = std::min(low, x[c]);
            high = std::max(high, x[c]);
        }
        square += high > low ? (high - low) * (high - low) : 0;
    }
    scales.extent = std::max(std::sqrt(square), scales.spring_length);
    return scales;
}

SolidCells SolidCells::of(const Lattice& lattice) {
    const double h = lattice.cell_size();
    const std::vector<std::array<std::uint32_t, 8>> corners = cell_corners(lattice);
    SolidCells solid;
    solid.cells.reserve(corners.size());
    for (const auto& nodes : corners) {
        solid.cells.push_back({nodes, {h, 0, 0, 0, h, 0, 0, 0, h}});
    }
    return solid;
}

SolidCells SolidCells::of(const Network& network) {
    SolidCells solid;
    std::vector<Network::Cell> all = network.cells;
    for (const Network::Polyhedron& polyhedron : network.polyhedra) {
        all.push_back(as_hexahedron(polyhedron));
    }
    for (const Network::Cell& given : all) {
        Cell& cell = solid.cells.emplace_back();
        cell.rest_edges = rest_shape(network, given).edges;
        std::transform(given.nodes.begin(), given.nodes.end(), cell.nodes.begin(),
                       [](std::int32_t node) { return static_cast<std::uint32_t>(node); });
    }
    return solid;
}

template <class T>
CellVolumes<T>::CellVolumes(const Body<T>& body, const SolidCells& solid) {
    std::vector<std::uint32_t> places(solid.cells.empty() ? 0 : body.node_count());
    for (std::size_t n = 0; n < places.size(); ++n) {
        places[n] = static_cast<std::uint32_t>(body.index_of(n));
    }
    cells_.reserve(solid.cells.size());
    for (const SolidCells::Cell& given : solid.cells) {
        Cell& cell = cells_.emplace_back();
        std::transform(given.nodes.begin(), given.nodes.end(), cell.places.begin(),
                       [&](std::uint32_t node) { return places[node]; });
        if (cells_.size() == 1 || given.rest_edges != (&given - 1)->rest_edges) {
            const Eigen::Matrix3d edges = Eigen::Map<const Eigen::Matrix3d>(given.rest_edges.data());
            const Eigen::Matrix3d inverse = body.length_unit() * edges.inverse();
            Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(inverse_edges_.emplace_back().data()) = inverse;
        }
        cell.shape = static_cast<std::uint32_t>(inverse_edges_.size() - 1);
    }
}

// J = det(I + H),  H = [da db dc] [a0 b0 c0]^-1
template <class T>
VolumeRatios CellVolumes<T>::ratios(const State<T>& state) const {
    if (cells_.empty()) {
        return {};
    }
    VolumeRatios ratios = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    const Component<const T> u[3] = {component(state.displacement, 0), component(state.displacement, 1),
                                     component(state.displacement, 2)};
    for (const Cell& cell : cells_) {
        double change[3][3] = {}; // component, edge
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t c = 0; c < 3; ++c) {
                const auto at = static_cast<std::ptrdiff_t>(cell.places[corner]) * u[c].stride;
                const double quarter = static_cast<double>(u[c].first[at]) / 4;
                for (std::size_t e = 0; e < 3; ++e) {
                    change[c][e] += corner >> e & 1 ? quarter : -quarter;
                }
            }
        }
        const std::array<double, 9>& inverse_edges = inverse_edges_[cell.shape];
        double f[3][3];
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                f[i][j] = i == j;
                for (std::size_t e = 0; e < 3; ++e) {
                    f[i][j] += change[i][e] * inverse_edges[3 * e + j];
                }
            }
        }
        const double ratio = f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) -
                             f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0]) +
                             f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
        ratios.min = std::min(ratios.min, ratio);
        ratios.max = std::max(ratios.max, ratio);
    }
    return ratios;
}

template class CellVolumes<float>;
template class CellVolumes<double>;

} // namespace hybmss
