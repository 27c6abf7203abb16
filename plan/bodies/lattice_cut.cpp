#include "plan/bodies/lattice_body.hpp"

namespace hybmss {

template <class T>
std::size_t LatticeBody<T>::springs_from(std::size_t index) const {
    std::size_t springs = 0;
    for (std::size_t kind = 0; kind < 7; ++kind) {
        const AlignedArray<T>& stiffness = layout_.stiffness[kind];
        if (stiffness.size() > 0 && stiffness[index] > 0) {
            springs += kind < 3 ? 1u : kind < 6 ? 2u : 4u;
        }
    }
    return springs;
}

template <class T>
void LatticeBody<T>::take_over(const Lattice& cut, std::span<const CutNode> nodes, std::size_t removed) {
    layout_.separate_planes();
    const CellShares shares(cut, material_, layout_.axes);
    for (const CutNode& node : nodes) {
        const std::size_t index = index_of(node.node);
        const std::array<std::size_t, 3> along = {node.place[layout_.axes[0]], node.place[layout_.axes[1]],
                                                  node.place[layout_.axes[2]]};
        const CellShares::Node now = shares.at(along);
        springs_ -= springs_from(index);
        layout_.set_node(index, index, now, shares);
        springs_ += springs_from(index);
        layout_.masses[node.node] = shares.mass(now.cells);
    }
    cells_ -= removed;
}

template std::size_t LatticeBody<float>::springs_from(std::size_t) const;
template std::size_t LatticeBody<double>::springs_from(std::size_t) const;
template void LatticeBody<float>::take_over(const Lattice&, std::span<const CutNode>, std::size_t);
template void LatticeBody<double>::take_over(const Lattice&, std::span<const CutNode>, std::size_t);

} // namespace hybmss
