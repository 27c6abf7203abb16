#include "layouts/node_numbers.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace hybmss {

NodeNumbers::NodeNumbers(const Lattice& lattice, std::size_t body_nodes) {
    if (body_nodes == lattice.grid_node_count()) {
        return;
    }
    nodes_ = lattice.nodes();
    if (nodes_.size() != body_nodes) {
        throw std::invalid_argument("the lattice has " + std::to_string(nodes_.size()) +
                                    " nodes, the body made from it " + std::to_string(body_nodes));
    }
}

std::uint32_t NodeNumbers::of(std::size_t grid_node) const {
    if (nodes_.empty()) {
        return static_cast<std::uint32_t>(grid_node);
    }
    return static_cast<std::uint32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), grid_node) - nodes_.begin());
}

namespace {

/// number(grid index)
template <class Number>
std::vector<std::array<std::uint32_t, 8>> numbered_corners(const Lattice& lattice, const Number& number) {
    const auto [nx, ny, nz] = lattice.cells();
    std::vector<std::array<std::uint32_t, 8>> cells;
    cells.reserve(lattice.cell_count());
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                if (!(lattice.cell_scale(i, j, k) > 0)) {
                    continue;
                }
                std::array<std::uint32_t, 8>& cell = cells.emplace_back();
                for (int corner = 0; corner < 8; ++corner) {
                    cell[static_cast<std::size_t>(corner)] =
                        number(lattice.grid_node_index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)));
                }
            }
        }
    }
    return cells;
}

} // namespace

std::vector<std::array<std::uint32_t, 8>> cell_corners(const Lattice& lattice) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    std::vector<std::uint32_t> number(lattice.grid_node_count(), 0);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        number[nodes[n]] = static_cast<std::uint32_t>(n);
    }
    return numbered_corners(lattice, [&](std::size_t grid_node) { return number[grid_node]; });
}

std::vector<std::array<std::uint32_t, 8>> cell_corners(const Lattice& lattice, const NodeNumbers& numbers) {
    return numbered_corners(lattice, [&](std::size_t grid_node) { return numbers.of(grid_node); });
}

std::vector<std::array<std::size_t, 4>> boundary_faces(const Lattice& lattice) {
    const std::array<int, 3> count = lattice.cells();
    const auto present = [&](const std::array<int, 3>& c) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (c[a] < 0 || c[a] >= count[a]) {
                return false;
            }
        }
        return lattice.cell_scale(c[0], c[1], c[2]) > 0;
    };
    std::vector<std::array<std::size_t, 4>> faces;
    for (int k = 0; k < count[2]; ++k) {
        for (int j = 0; j < count[1]; ++j) {
            for (int i = 0; i < count[0]; ++i) {
                const std::array<int, 3> cell = {i, j, k};
                if (!present(cell)) {
                    continue;
                }
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    for (const int side : {0, 1}) {
                        std::array<int, 3> beside = cell;
                        beside[axis] += 2 * side - 1;
                        if (present(beside)) {
                            continue;
                        }
                        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
                        std::array<std::size_t, 4> face{};
                        for (std::size_t corner = 0; corner < 4; ++corner) { // about +axis: (0,0) (1,0) (1,1) (0,1)
                            std::array<int, 3> at = cell;
                            at[axis] += side;
                            at[u] += corner == 1 || corner == 2;
                            at[v] += corner >= 2;
                            face[side == 1 ? corner : 3 - corner] = lattice.grid_node_index(at[0], at[1], at[2]);
                        }
                        faces.push_back(face);
                    }
                }
            }
        }
    }
    return faces;
}

void append_node(std::vector<NodeRun>& runs, std::size_t index) {
    if (runs.empty()) {
        runs.push_back({0, index, 1});
        return;
    }
    NodeRun& last = runs.back();
    if (last.length == 1 && index > last.index) {
        last.stride = index - last.index;
    }
    if (last.index + last.length * last.stride == index) {
        ++last.length;
    } else {
        runs.push_back({last.node + last.length, index, 1});
    }
}

std::size_t index_in(const std::vector<NodeRun>& runs, std::size_t node) {
    const auto after =
        std::upper_bound(runs.begin(), runs.end(), node, [](std::size_t n, const NodeRun& r) { return n < r.node; });
    const NodeRun& run = *(after - 1);
    return run.index + (node - run.node) * run.stride;
}

} // namespace hybmss
