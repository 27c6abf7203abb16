#include "layouts/lattice/lattice_arrays.hpp"

#include <algorithm>
#include <utility>

namespace hybmss {

std::string word_of(const LatticeAxes& axes) {
    return {"xyz"[axes[0]], "xyz"[axes[1]], "xyz"[axes[2]]};
}

CellShares::CellShares(const Lattice& lattice, const Material& material, const LatticeAxes& axes)
    : lattice_(lattice), axes_(axes) {
    const double h = lattice.cell_size();
    const SpringConstants constants = spring_constants(material, h);
    edge_ = constants.edge / 4 * h;
    face_ = constants.face_diagonal / 2 * h;
    cube_ = constants.cube_diagonal * h;
    cell_mass_ = material.density * h * h * h / 8;
    volume_ratio_ = volume_modulus(material) * h * h / (32 * cube_);
    crush_ratio_ = crush_modulus(material) * h * h / (32 * cube_);
    for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
        const Material own = material_of(lattice, tissue, material);
        const bool none = resolved_volume_energy(own) == VolumeEnergy::none;
        own_.push_back({none ? 0 : volume_modulus(own) * h * h / 32, own.density / material.density});
    }
}

CellShares::Cell CellShares::cell_at(const std::array<int, 3>& place) const {
    std::array<int, 3> cell{};
    for (std::size_t c = 0; c < 3; ++c) {
        if (place[c] < 0 || place[c] >= lattice_.cells()[axes_[c]]) {
            return {0, 0, 0};
        }
        cell[axes_[c]] = place[c];
    }
    const std::size_t index = lattice_.cell_index(cell[0], cell[1], cell[2]);
    return {static_cast<double>(lattice_.cell_scales()[index]), lattice_.cell_tissue(index),
            static_cast<double>(lattice_.cell_fill(index))};
}

CellShares::Node CellShares::at(const std::array<std::size_t, 3>& place) const {
    const int i = static_cast<int>(place[0]), j = static_cast<int>(place[1]), k = static_cast<int>(place[2]);
    Node node{{}, 0, 0};
    // s[bits]: the cells around the node, bit set = on its low side.
    double s[8];
    for (int bits = 0; bits < 8; ++bits) {
        const Cell cell = cell_at({i - (bits & 1), j - (bits >> 1 & 1), k - (bits >> 2)});
        s[bits] = cell.scale;
        node.cells += s[bits] > 0 ? own_[cell.tissue].density * cell.fill : 0;
        node.volume += bits == 0 ? s[0] * own_[cell.tissue].volume : 0;
    }
    node.stiffness = {edge_ * (s[0] + s[2] + s[4] + s[6]), // along a row: cells that differ across it
                      edge_ * (s[0] + s[1] + s[4] + s[5]),
                      edge_ * (s[0] + s[1] + s[2] + s[3]),
                      face_ * (s[0] + s[4]), // in a plane: cells below and above
                      face_ * (s[0] + s[2]),
                      face_ * (s[0] + s[1]),
                      cube_ * s[0]};
    return node;
}

template <class T>
std::size_t LatticeArrays<T>::bytes() const {
    std::size_t stiffnesses = volume.size();
    for (const AlignedArray<T>& kind : stiffness) {
        stiffnesses += kind.size();
    }
    return (size() + stiffnesses) * sizeof(T) +
           (begin.size() + lanes.size() + stiffness_begin.size()) * sizeof(std::size_t) +
           neighbors.size() * sizeof(VectorNeighbors) + masses.size() * sizeof(double) + runs.size() * sizeof(NodeRun);
}

template <class T>
void LatticeArrays<T>::allocate(std::size_t elements, std::size_t stiffness_elements, const Material& material,
                                bool own_volumes) {
    const bool face_diagonals = material.face_diagonal_ratio > 0, on_means = material.springs == SpringForm::means;
    for (std::size_t kind = 0; kind < 7; ++kind) {
        if (kind == 6 || (!on_means && (face_diagonals || kind < 3))) {
            stiffness[kind] = AlignedArray<T>(padded(stiffness_elements));
        }
    }
    if (own_volumes) {
        volume = AlignedArray<T>(padded(stiffness_elements));
    }
    inverse_mass = AlignedArray<T>(padded(elements));
}

template <class T>
void LatticeArrays<T>::separate_planes() {
    if (stiffness[6].size() == size()) {
        return;
    }
    std::vector<std::size_t> places = own_stiffness();
    AlignedArray<T> own[8];
    for (std::size_t kind = 0; kind < 8; ++kind) {
        const AlignedArray<T>& shared = kind < 7 ? stiffness[kind] : volume;
        if (shared.size() == 0) {
            continue;
        }
        own[kind] = AlignedArray<T>(size());
        for (std::size_t k = 0; k < planes; ++k) {
            std::copy_n(shared.data() + stiffness_begin[k], begin[k + 1] - begin[k], own[kind].data() + places[k]);
        }
    }
    std::move(own, own + 7, stiffness);
    volume = std::move(own[7]);
    stiffness_begin.swap(places);
}

template <class T>
void LatticeArrays<T>::set_node(std::size_t n, std::size_t place, const CellShares::Node& node,
                                const CellShares& shares) {
    for (std::size_t kind = 0; kind < 7; ++kind) {
        if (stiffness[kind].size() > 0) {
            stiffness[kind][place] = static_cast<T>(node.stiffness[kind]);
        }
    }
    if (volume.size() > 0) {
        volume[place] = static_cast<T>(node.volume);
    }
    inverse_mass[n] = node.cells > 0 ? static_cast<T>(shares.inverse_mass(node.cells)) : T(0);
}

template struct LatticeArrays<float>;
template struct LatticeArrays<double>;

} // namespace hybmss
