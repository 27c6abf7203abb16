#include "layouts/flat_rows.hpp"

#include <algorithm>

namespace hybmss {
namespace {

using Axes = std::array<std::size_t, 3>;

std::size_t lanes_of(const Lattice& lattice, const Axes& axes) {
    return padded(static_cast<std::size_t>(lattice.cells()[axes[0]] + 1) *
                  static_cast<std::size_t>(lattice.cells()[axes[1]] + 1));
}

/// Planes normal to y where that sweeps fewer lanes and leaves layers enough to share among threads.
Axes choose_axes(const Lattice& lattice) {
    constexpr Axes kNormalToZ = {0, 1, 2}, kNormalToY = {0, 2, 1};
    const auto cost = [&](const Axes& axes) {
        return lanes_of(lattice, axes) * static_cast<std::size_t>(lattice.cells()[axes[2]]);
    };
    constexpr std::size_t kSmall = 4096;
    const bool layers_enough = lattice.cells()[1] >= 8 || lattice.grid_node_count() < kSmall;
    return layers_enough && 32 * cost(kNormalToY) < 31 * cost(kNormalToZ) ? kNormalToY : kNormalToZ;
}

/// The stiffness scale of a cell, by its place along the layout's axes; zero outside.
double scale_at(const Lattice& lattice, const Axes& axes, const std::array<int, 3>& place) {
    std::array<int, 3> cell{};
    for (std::size_t c = 0; c < 3; ++c) {
        if (place[c] < 0 || place[c] >= lattice.cells()[axes[c]]) {
            return 0;
        }
        cell[axes[c]] = place[c];
    }
    return static_cast<double>(lattice.cell_scale(cell[0], cell[1], cell[2]));
}

} // namespace

template <class T>
FlatRows<T>::FlatRows(const Lattice& lattice, const Material& material)
    : axes(choose_axes(lattice)), cell_size(lattice.cell_size()) {
    const int layers = lattice.cells()[axes[2]], rows = lattice.cells()[axes[1]] + 1;
    row = static_cast<std::size_t>(lattice.cells()[axes[0]]) + 1;
    planes = static_cast<std::size_t>(layers) + 1;
    lanes = lanes_of(lattice, axes);
    plane = padded(lanes + row + 1);
    for (auto& array : stiffness) {
        array = AlignedArray<T>(size());
    }
    inverse_mass = AlignedArray<T>(size());

    const SpringConstants constants = spring_constants(material, cell_size);
    const double edge = constants.edge / 4 * cell_size;
    const double face = constants.face_diagonal / 2 * cell_size;
    const double cube = constants.cube_diagonal * cell_size;
    volume_ratio = static_cast<T>(volume_modulus(material) * cell_size * cell_size / (32 * cube));
    const double cell_mass = material.density * cell_size * cell_size * cell_size / 8;

    // Cells that touch each node, by its index: nonzero makes it a node of the body.
    std::vector<unsigned char> touching(size(), 0);
    for (int k = 0; k <= layers; ++k) {
        for (int j = 0; j < rows; ++j) {
            for (int i = 0; i < static_cast<int>(row); ++i) {
                const std::size_t n = static_cast<std::size_t>(k) * plane + static_cast<std::size_t>(j) * row +
                                      static_cast<std::size_t>(i);
                // s[bits]: the cells around the node, bit set = on its low side.
                double s[8];
                for (int bits = 0; bits < 8; ++bits) {
                    s[bits] = scale_at(lattice, axes, {i - (bits & 1), j - (bits >> 1 & 1), k - (bits >> 2)});
                    touching[n] = static_cast<unsigned char>(touching[n] + (s[bits] > 0));
                }
                const double k7[7] = {edge * (s[0] + s[2] + s[4] + s[6]), // along a row: cells that differ across it
                                      edge * (s[0] + s[1] + s[4] + s[5]),
                                      edge * (s[0] + s[1] + s[2] + s[3]),
                                      face * (s[0] + s[4]), // in a plane: cells below and above
                                      face * (s[0] + s[2]),
                                      face * (s[0] + s[1]),
                                      cube * s[0]};
                for (std::size_t kind = 0; kind < 7; ++kind) {
                    stiffness[kind][n] = static_cast<T>(k7[kind]);
                }
                if (touching[n] > 0) {
                    inverse_mass[n] = static_cast<T>(1 / (cell_mass * touching[n] * cell_size));
                }
            }
        }
    }

    // The body's nodes in its own order: x fastest, then y, then z.
    const auto [nx, ny, nz] = lattice.cells();
    const std::size_t y_stride = axes[1] == 1 ? row : plane, z_stride = axes[1] == 1 ? plane : row;
    for (std::size_t z = 0; z <= static_cast<std::size_t>(nz); ++z) {
        for (std::size_t y = 0; y <= static_cast<std::size_t>(ny); ++y) {
            for (std::size_t x = 0; x <= static_cast<std::size_t>(nx); ++x) {
                const std::size_t n = x + y * y_stride + z * z_stride;
                if (touching[n] == 0) {
                    continue;
                }
                masses.push_back(cell_mass * touching[n]);
                const bool goes_on = !runs.empty() && runs.back().index + runs.back().length == n &&
                                     runs.back().index / plane == n / plane;
                if (!goes_on) {
                    runs.push_back({node_count, n, 0});
                }
                ++runs.back().length;
                ++node_count;
            }
        }
    }
}

template <class T>
std::size_t FlatRows<T>::bytes() const {
    return 8 * size() * sizeof(T) + masses.size() * sizeof(double) + runs.size() * sizeof(NodeRun);
}

template <class T>
std::size_t FlatRows<T>::index_of(std::size_t node) const {
    const auto after =
        std::upper_bound(runs.begin(), runs.end(), node, [](std::size_t n, const NodeRun& r) { return n < r.node; });
    const NodeRun& run = *(after - 1);
    return run.index + (node - run.node);
}

template struct FlatRows<float>;
template struct FlatRows<double>;

} // namespace hybmss
