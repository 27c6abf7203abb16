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
