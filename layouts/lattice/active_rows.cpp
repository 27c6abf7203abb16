#include "layouts/lattice/lattice_arrays.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// The grid nodes, cut into vectors along one axis: by plane, then row, then place in the row.
class VectorGrid {
public:
    VectorGrid(const Lattice& lattice, const LatticeAxes& axes, std::size_t width) : axes_(axes), width_(width) {
        const auto nodes = [&](std::size_t axis) { return static_cast<std::size_t>(lattice.cells()[axis]) + 1; };
        columns_ = (nodes(axes[0]) + width - 1) / width;
        rows_ = nodes(axes[1]);
        planes_ = nodes(axes[2]);
    }

    std::size_t columns() const { return columns_; }
    std::size_t rows() const { return rows_; }
    std::size_t planes() const { return planes_; }
    std::size_t size() const { return columns_ * rows_ * planes_; }

    std::size_t at(std::size_t column, std::size_t row, std::size_t plane) const {
        return column + columns_ * (row + rows_ * plane);
    }
    /// The vector that holds a node, and the lane.
    std::size_t vector_of(const std::array<std::size_t, 3>& node) const {
        return at(node[axes_[0]] / width_, node[axes_[1]], node[axes_[2]]);
    }
    std::size_t lane_of(const std::array<std::size_t, 3>& node) const { return node[axes_[0]] % width_; }

private:
    LatticeAxes axes_;
    std::size_t width_, columns_, rows_, planes_;
};

/// Calls visit(node's place x y z) for all nodes of the body in their order.
template <class Visit>
void for_each_node(const Lattice& lattice, const Visit& visit) {
    const auto nx = static_cast<std::size_t>(lattice.cells()[0]) + 1,
               ny = static_cast<std::size_t>(lattice.cells()[1]) + 1;
    for (const std::uint32_t node : lattice.nodes()) {
        visit(std::array<std::size_t, 3>{node % nx, node / nx % ny, node / nx / ny});
    }
}

} // namespace

ActiveLanes count_active_lanes(const Lattice& lattice, std::size_t width) {
    // Rows along x, y or z; planes normal to the longer of the others, so that they are small and many.
    LatticeAxes axes[3];
    std::vector<VectorGrid> grids;
    std::vector<bool> held[3];
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t low = a == 0 ? 1 : 0, high = a == 2 ? 1 : 2;
        const bool low_is_longer = lattice.cells()[low] > lattice.cells()[high];
        axes[a] = low_is_longer ? LatticeAxes{a, high, low} : LatticeAxes{a, low, high};
        grids.emplace_back(lattice, axes[a], width);
        held[a].assign(grids[a].size(), false);
    }
    for_each_node(lattice, [&](const std::array<std::size_t, 3>& node) {
        for (std::size_t a = 0; a < 3; ++a) {
            held[a][grids[a].vector_of(node)] = true;
        }
    });
    ActiveLanes best{axes[0], 0};
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t lanes =
            width * (static_cast<std::size_t>(std::count(held[a].begin(), held[a].end(), true)) + grids[a].planes());
        const bool pays = best.axes[0] != 0 ? lanes < best.lanes : 5 * lanes < 4 * best.lanes;
        if (a == 0 || pays) {
            best = {axes[a], lanes};
        }
    }
    return best;
}

double active_share(const Lattice& lattice) {
    return static_cast<double>(count_active_lanes(lattice, 16).lanes) / static_cast<double>(lattice.grid_node_count());
}

template <class T>
LatticeArrays<T> active_rows(const Lattice& lattice, const Material& material, int width, int axes_width) {
    LatticeArrays<T> a;
    a.width = static_cast<std::size_t>(width);
    a.axes = count_active_lanes(lattice, static_cast<std::size_t>(axes_width > 0 ? axes_width : width)).axes;
    a.cell_size = lattice.cell_size();
    const VectorGrid grid(lattice, a.axes, a.width);
    a.planes = grid.planes();

    // Where each vector of the grid lies in its plane, in elements; 0, the void one's place, where it is not stored.
    std::vector<std::int32_t> place(grid.size(), 0);
    for_each_node(lattice, [&](const std::array<std::size_t, 3>& node) { place[grid.vector_of(node)] = 1; });
    a.begin.push_back(0);
    for (std::size_t k = 0; k < a.planes; ++k) {
        std::size_t lanes = a.width;
        for (std::size_t v = grid.at(0, 0, k); v < grid.at(0, 0, k + 1); ++v) {
            if (place[v] != 0) {
                place[v] = static_cast<std::int32_t>(lanes);
                lanes += a.width;
            }
        }
        a.lanes.push_back(lanes);
        a.begin.push_back(a.begin.back() + lanes);
        a.plane = std::max(a.plane, lanes);
    }
    a.stiffness_begin = a.own_stiffness();
    const std::size_t elements = a.begin.back() + a.width; // a vector more, for the element after the last
    a.allocate(elements, elements, material, has_own_volumes(lattice, material));

    a.neighbors.reserve(a.begin.back() / a.width - a.planes);
    const CellShares shares(lattice, material, a.axes);
    a.volume_ratio = static_cast<T>(shares.volume_ratio());
    a.crush_ratio = static_cast<T>(shares.crush_ratio());
    for (std::size_t k = 0; k < a.planes; ++k) {
        for (std::size_t j = 0; j < grid.rows(); ++j) {
            for (std::size_t column = 0; column < grid.columns(); ++column) {
                const std::int32_t own = place[grid.at(column, j, k)];
                if (own == 0) {
                    continue;
                }
                const auto neighbor = [&](std::size_t row, std::size_t plane) {
                    return row < grid.rows() && plane < a.planes ? place[grid.at(column, row, plane)] : 0;
                };
                a.neighbors.push_back({neighbor(j + 1, k), neighbor(j, k + 1), neighbor(j + 1, k + 1)});
                for (std::size_t lane = 0; lane < a.width; ++lane) {
                    const std::size_t n = a.begin[k] + static_cast<std::size_t>(own) + lane;
                    a.set_node(n, n, shares.at({column * a.width + lane, j, k}), shares);
                }
            }
        }
    }

    for_each_node(lattice, [&](const std::array<std::size_t, 3>& node) {
        const std::array<std::size_t, 3> along = {node[a.axes[0]], node[a.axes[1]], node[a.axes[2]]};
        append_node(a.runs,
                    a.begin[along[2]] + static_cast<std::size_t>(place[grid.vector_of(node)]) + grid.lane_of(node));
        a.masses.push_back(shares.mass(shares.at(along).cells));
    });
    return a;
}

template LatticeArrays<float> active_rows(const Lattice&, const Material&, int, int);
template LatticeArrays<double> active_rows(const Lattice&, const Material&, int, int);

} // namespace hybmss
