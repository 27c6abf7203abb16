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

} // namespace hybmss
