#include "layouts/flat_rows.hpp"

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

} // namespace

template <class T>
LatticeArrays<T> flat_rows(const Lattice& lattice, const Material& material, Ghosts ghosts) {
    LatticeArrays<T> a;
    a.axes = choose_axes(lattice);
    a.cell_size = lattice.cell_size();
    const auto count = [&](std::size_t axis) { return static_cast<std::size_t>(lattice.cells()[a.axes[axis]]) + 1; };
    const std::size_t rows = count(1), lanes = lanes_of(lattice, a.axes);
    a.row = count(0);
    a.planes = count(2);
    a.plane = padded(lanes + a.row + 1);
    const std::size_t first = ghosts == Ghosts::planes ? padded(a.row + 1) + a.plane : 0;
    for (std::size_t k = 0; k <= a.planes; ++k) {
        a.begin.push_back(first + k * a.plane);
    }
    a.lanes.assign(a.planes, lanes);
    a.allocate(a.begin.back() + (ghosts == Ghosts::planes ? a.plane : 0), material.face_diagonal_ratio > 0);

    const CellShares shares(lattice, material, a.axes);
    a.volume_ratio = static_cast<T>(shares.volume_ratio());
    // Cells that touch each node, by its place in the layout: nonzero makes it a node of the body.
    std::vector<unsigned char> touching(a.size(), 0);
    for (std::size_t k = 0; k < a.planes; ++k) {
        for (std::size_t j = 0; j < rows; ++j) {
            for (std::size_t i = 0; i < a.row; ++i) {
                const std::size_t n = a.begin[k] + j * a.row + i;
                const CellShares::Node node = shares.at({i, j, k});
                a.set_node(n, node, shares);
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
                const std::size_t n = first + x + y * y_stride + z * z_stride;
                if (touching[n] > 0) {
                    a.masses.push_back(shares.mass(touching[n]));
                    append_node(a.runs, n);
                }
            }
        }
    }
    return a;
}

template LatticeArrays<float> flat_rows(const Lattice&, const Material&, Ghosts);
template LatticeArrays<double> flat_rows(const Lattice&, const Material&, Ghosts);

} // namespace hybmss
