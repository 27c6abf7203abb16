#include "layouts/lattice/lattice_arrays.hpp"

#include <algorithm>
#include <array>

namespace hybmss {
namespace {

std::size_t lanes_of(const Lattice& lattice, const LatticeAxes& axes) {
    return padded(static_cast<std::size_t>(lattice.cells()[axes[0]] + 1) *
                  static_cast<std::size_t>(lattice.cells()[axes[1]] + 1));
}

/// Planes normal to y where that sweeps fewer lanes and leaves layers enough to share among threads.
LatticeAxes choose_axes(const Lattice& lattice) {
    constexpr LatticeAxes kNormalToZ = {0, 1, 2}, kNormalToY = {0, 2, 1};
    const auto cost = [&](const LatticeAxes& axes) {
        return lanes_of(lattice, axes) * static_cast<std::size_t>(lattice.cells()[axes[2]]);
    };
    constexpr std::size_t kSmall = 4096;
    const bool layers_enough = lattice.cells()[1] >= 8 || lattice.grid_node_count() < kSmall;
    return layers_enough && 32 * cost(kNormalToY) < 31 * cost(kNormalToZ) ? kNormalToY : kNormalToZ;
}

/// Whether each layer of cells is like the one below it; the lowest is not.
std::vector<bool> layers_alike(const Lattice& lattice, const LatticeAxes& axes) {
    const auto count = [&](std::size_t axis) { return lattice.cells()[axes[axis]]; };
    const auto row = [&](int j, int k) { // rows lie along x
        std::array<int, 3> cell{};
        cell[axes[1]] = j, cell[axes[2]] = k;
        return lattice.cell_scales().begin() +
               static_cast<std::ptrdiff_t>(lattice.cell_index(cell[0], cell[1], cell[2]));
    };
    std::vector<bool> alike(static_cast<std::size_t>(count(2)), false);
    for (int k = 1; k < count(2); ++k) {
        int j = 0;
        while (j < count(1) && std::equal(row(j, k), row(j, k) + count(0), row(j, k - 1))) {
            ++j;
        }
        alike[static_cast<std::size_t>(k)] = j == count(1);
    }
    return alike;
}

/// Where the stiffness of each plane of nodes begins, `plane` elements long, where planes between layers alike share
/// it.
std::vector<std::size_t> shared_stiffness(const Lattice& lattice, const LatticeAxes& axes, std::size_t plane) {
    const std::vector<bool> alike = layers_alike(lattice, axes);
    std::vector<std::size_t> begin = {0};
    for (std::size_t k = 1; k <= alike.size(); ++k) {
        const bool shared = k < alike.size() && alike[k] && alike[k - 1];
        begin.push_back(begin.back() + (shared ? 0 : plane));
    }
    return begin;
}

} // namespace

template <class T>
LatticeArrays<T> flat_rows(const Lattice& lattice, const Material& material) {
    LatticeArrays<T> a;
    a.axes = choose_axes(lattice);
    a.cell_size = lattice.cell_size();
    const auto count = [&](std::size_t axis) { return static_cast<std::size_t>(lattice.cells()[a.axes[axis]]) + 1; };
    const std::size_t rows = count(1), lanes = lanes_of(lattice, a.axes);
    a.row = count(0);
    a.cell_lanes = padded(a.row * (rows - 1));
    a.planes = count(2);
    a.plane = padded(lanes + a.row + 1);
    for (std::size_t k = 0; k <= a.planes; ++k) {
        a.begin.push_back(k * a.plane);
    }
    a.lanes.assign(a.planes, lanes);
    a.stiffness_begin = shared_stiffness(lattice, a.axes, a.plane);
    a.allocate(a.begin.back(), a.stiffness_begin.back() + a.plane, material);

    const CellShares shares(lattice, material, a.axes);
    a.volume_ratio = static_cast<T>(shares.volume_ratio());
    a.crush_ratio = static_cast<T>(shares.crush_ratio());
    // Cells that touch each node, by its place in the layout: nonzero makes it a node of the body.
    std::vector<unsigned char> touching(a.size(), 0);
    for (std::size_t k = 0; k < a.planes; ++k) {
        if (k > 0 && a.stiffness_begin[k] == a.stiffness_begin[k - 1]) {
            std::copy_n(a.inverse_mass.data() + a.begin[k - 1], a.plane, a.inverse_mass.data() + a.begin[k]);
            std::copy_n(touching.data() + a.begin[k - 1], a.plane, touching.data() + a.begin[k]);
            continue;
        }
        for (std::size_t j = 0; j < rows; ++j) {
            for (std::size_t i = 0; i < a.row; ++i) {
                const std::size_t in_plane = j * a.row + i, n = a.begin[k] + in_plane;
                const CellShares::Node node = shares.at({i, j, k});
                a.set_node(n, a.stiffness_begin[k] + in_plane, node, shares);
                touching[n] = static_cast<unsigned char>(node.cells);
            }
        }
    }

    // The body's nodes in its own order: x fastest, then y, then z.
    const auto [nx, ny, nz] = lattice.cells();
    const std::size_t y_stride = a.axes[1] == 1 ? a.row : a.plane, z_stride = a.axes[1] == 1 ? a.plane : a.row;
    for (std::size_t z = 0; z <= static_cast<std::size_t>(nz); ++z) {
        for (std::size_t y = 0; y <= static_cast<std::size_t>(ny); ++y) {
            for (std::size_t x = 0; x <= static_cast<std::size_t>(nx); ++x) {
                const std::size_t n = x + y * y_stride + z * z_stride;
                if (touching[n] > 0) {
                    a.masses.push_back(shares.mass(touching[n]));
                    append_node(a.runs, n);
                }
            }
        }
    }
    return a;
}

template LatticeArrays<float> flat_rows(const Lattice&, const Material&);
template LatticeArrays<double> flat_rows(const Lattice&, const Material&);

} // namespace hybmss
