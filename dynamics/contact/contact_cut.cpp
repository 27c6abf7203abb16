// How contact follows a body that is cut while it moves.
#include "dynamics/contact/contact.hpp"

namespace hybmss {

// New nodes come last, in the order in which the cells around them were removed, those without mass too: a body that is
// cut again in another number of bites has the same blocks and the same memory.
template <class T>
void Contact<T>::surface_was_cut(const Body<T>& body, std::span<const SurfaceNode> around) {
    if (numbers_.empty()) {
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            numbers_[nodes_[n].index] = n;
        }
    }
    for (const SurfaceNode& node : around) {
        const std::size_t index = body.index_of(node.node);
        const auto [entry, is_new] = numbers_.try_emplace(index, nodes_.size());
        if (is_new) {
            nodes_.push_back({node.rest_position, index, 0});
        }
        nodes_[entry->second].mass = body.masses()[node.node];
        for (std::size_t o = 0; is_new && o < obstacles_.size(); ++o) {
            grips_[o].resize(has_grips(o) ? nodes_.size() : 0);
            watches_[o].resize(block_count());
            watches_[o].back().near = 0;
        }
    }
    elapsed_.resize(piece_count(), elapsed());
}

template void Contact<float>::surface_was_cut(const Body<float>&, std::span<const SurfaceNode>);
template void Contact<double>::surface_was_cut(const Body<double>&, std::span<const SurfaceNode>);

} // namespace hybmss
