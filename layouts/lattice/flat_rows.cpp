#include "layouts/lattice/lattice_arrays.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace hybmss {
namespace {

// The cost of a sweep, by that of a lane with cells: of a layer, of a lane with the last row's nodes alone, and of the
// topmost plane's.
constexpr double kLayer = 4, kLast = 0.35, kTop = 0.35;
constexpr std::size_t kSmall = 4096; // nodes
/// Rows along x are what callers' memory is like, and what bodies had before.
constexpr double kWorthIt = 0.97;
/// Layers that leave a second thread half idle, and what that costs.
constexpr std::size_t kFewLayers = 8;
constexpr double kIdle = 1.25;

std::size_t count_of(const Lattice& lattice, const LatticeAxes& axes, std::size_t axis) {
    return static_cast<std::size_t>(lattice.cells()[axes[axis]]);
}

std::size_t lanes_of(const Lattice& lattice, const LatticeAxes& axes) {
    return padded((count_of(lattice, axes, 0) + 1) * (count_of(lattice, axes, 1) + 1));
}

/// Of a plane's lanes, those that hold all cells.
std::size_t cell_lanes_of(const Lattice& lattice, const LatticeAxes& axes) {
    return padded((count_of(lattice, axes, 0) + 1) * count_of(lattice, axes, 1));
}

/// What a sweep costs, by a lane with cells.
double sweep_cost(const Lattice& lattice, const LatticeAxes& axes) {
    const auto cells = static_cast<double>(cell_lanes_of(lattice, axes)),
               lanes = static_cast<double>(lanes_of(lattice, axes)),
               layers = static_cast<double>(count_of(lattice, axes, 2));
    return layers * (kLayer + cells + kLast * (lanes - cells)) + kTop * lanes;
}

/// To share among threads.
bool layers_enough(const Lattice& lattice, const LatticeAxes& axes) {
    return count_of(lattice, axes, 2) >= 8 || lattice.grid_node_count() < kSmall;
}

/// Whether each layer of cells is like the one below it; the lowest is not.
std::vector<bool> layers_alike(const Lattice& lattice, const LatticeAxes& axes) {
    const std::size_t by_axis[3] = {1, static_cast<std::size_t>(lattice.cells()[0]),
                                    static_cast<std::size_t>(lattice.cells()[0]) *
                                        static_cast<std::size_t>(lattice.cells()[1])};
    const std::size_t nx = count_of(lattice, axes, 0), ny = count_of(lattice, axes, 1), nz = count_of(lattice, axes, 2);
    const std::span<const float> scales = lattice.cell_scales();
    const auto row_is_alike = [&](std::size_t j, std::size_t k) {
        std::size_t cell = j * by_axis[axes[1]] + k * by_axis[axes[2]];
        const std::size_t step = by_axis[axes[0]], below = by_axis[axes[2]];
        for (std::size_t i = 0; i < nx; ++i, cell += step) {
            if (scales[cell] != scales[cell - below] ||
                lattice.cell_tissue(cell) != lattice.cell_tissue(cell - below) ||
                lattice.cell_fill(cell) != lattice.cell_fill(cell - below)) {
                return false;
            }
        }
        return true;
    };
    std::vector<bool> alike(nz, false);
    for (std::size_t k = 1; k < nz; ++k) {
        std::size_t j = 0;
        while (j < ny && row_is_alike(j, k)) {
            ++j;
        }
        alike[k] = j == ny;
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

LatticeAxes plain_axes(const Lattice& lattice) {
    constexpr LatticeAxes kNormalToZ = {0, 1, 2}, kNormalToY = {0, 2, 1};
    const auto cost = [&](const LatticeAxes& axes) { return lanes_of(lattice, axes) * count_of(lattice, axes, 2); };
    return layers_enough(lattice, kNormalToY) && 32 * cost(kNormalToY) < 31 * cost(kNormalToZ) ? kNormalToY
                                                                                               : kNormalToZ;
}

std::vector<LatticeAxes> axes_by_cost(const Lattice& lattice, bool shared) {
    std::vector<LatticeAxes> orders = {plain_axes(lattice)};
    LatticeAxes axes = {0, 1, 2};
    do {
        if (axes != orders.front() && (!shared || layers_enough(lattice, axes))) {
            orders.push_back(axes);
        }
    } while (std::next_permutation(axes.begin(), axes.end()));
    const auto cost = [&](const LatticeAxes& order) {
        const bool idle = shared && count_of(lattice, order, 2) <= kFewLayers && lattice.grid_node_count() >= kSmall;
        return (order == orders.front() ? kWorthIt : 1) * (idle ? kIdle : 1) * sweep_cost(lattice, order);
    };
    std::vector<std::pair<double, LatticeAxes>> ranked(orders.size());
    std::transform(orders.begin(), orders.end(), ranked.begin(),
                   [&](const LatticeAxes& order) { return std::pair(cost(order), order); });
    std::stable_sort(ranked.begin(), ranked.end(), [](const auto& p, const auto& q) { return p.first < q.first; });
    std::transform(ranked.begin(), ranked.end(), orders.begin(), [](const auto& p) { return p.second; });
    return orders;
}

template <class T>
LatticeArrays<T> flat_rows(const Lattice& lattice, const Material& material, const LatticeAxes& axes) {
    LatticeArrays<T> a;
    a.axes = axes;
    a.cell_size = lattice.cell_size();
    const std::size_t lanes = lanes_of(lattice, axes);
    a.row = count_of(lattice, axes, 0) + 1;
    a.rows = count_of(lattice, axes, 1) + 1;
    a.cell_lanes = cell_lanes_of(lattice, axes);
    a.planes = count_of(lattice, axes, 2) + 1;
    a.plane = padded(lanes + a.row + 1);
    for (std::size_t k = 0; k <= a.planes; ++k) {
        a.begin.push_back(k * a.plane);
    }
    a.lanes.assign(a.planes, lanes);
    a.stiffness_begin = shared_stiffness(lattice, a.axes, a.plane);
    a.allocate(a.begin.back(), a.stiffness_begin.back() + a.plane, material, has_own_volumes(lattice, material));

    const CellShares shares(lattice, material, a.axes);
    a.volume_ratio = static_cast<T>(shares.volume_ratio());
    a.crush_ratio = static_cast<T>(shares.crush_ratio());
    // Cells that touch each node, by its place in the layout: nonzero makes it a node of the body.
    std::vector<double> touching(a.size(), 0);
    for (std::size_t k = 0; k < a.planes; ++k) {
        if (k > 0 && a.stiffness_begin[k] == a.stiffness_begin[k - 1]) {
            std::copy_n(a.inverse_mass.data() + a.begin[k - 1], a.plane, a.inverse_mass.data() + a.begin[k]);
            std::copy_n(touching.data() + a.begin[k - 1], a.plane, touching.data() + a.begin[k]);
            continue;
        }
        for (std::size_t j = 0; j < a.rows; ++j) {
            for (std::size_t i = 0; i < a.row; ++i) {
                const std::size_t in_plane = j * a.row + i, n = a.begin[k] + in_plane;
                const CellShares::Node node = shares.at({i, j, k});
                a.set_node(n, a.stiffness_begin[k] + in_plane, node, shares);
                touching[n] = node.cells;
            }
        }
    }

    // The body's nodes in its own order: x fastest, then y, then z.
    const auto [nx, ny, nz] = lattice.cells();
    std::size_t stride[3];
    stride[axes[0]] = 1, stride[axes[1]] = a.row, stride[axes[2]] = a.plane;
    for (std::size_t z = 0; z <= static_cast<std::size_t>(nz); ++z) {
        for (std::size_t y = 0; y <= static_cast<std::size_t>(ny); ++y) {
            for (std::size_t x = 0; x <= static_cast<std::size_t>(nx); ++x) {
                const std::size_t n = x * stride[0] + y * stride[1] + z * stride[2];
                if (touching[n] > 0) {
                    a.masses.push_back(shares.mass(touching[n]));
                    append_node(a.runs, n);
                }
            }
        }
    }
    return a;
}

template LatticeArrays<float> flat_rows(const Lattice&, const Material&, const LatticeAxes&);
template LatticeArrays<double> flat_rows(const Lattice&, const Material&, const LatticeAxes&);

} // namespace hybmss
