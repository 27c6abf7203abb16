#include "plan/lattice_body.hpp"

#include <algorithm>
#include <array>

namespace hybmss {
namespace {

/// Where the entry of an axis pair lies among xx, yy, zz, xy, xz, yz.
constexpr std::size_t kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
constexpr std::size_t kEntryAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

} // namespace

/// As LatticeBody::sweep with Finish::store: slabs side by side, then the planes where they meet.
template <class T>
template <int components>
void LatticeBody<T>::sweep_hessian(State<T>& state, const kernels::LatticeHessianSweep<T, components>& kernels,
                                   const NodeField<T>* direction, T* const (&sums)[components]) const {
    using HessianLayer = kernels::LatticeHessianLayer<T, components>;
    const auto layer_at = [&](std::size_t k) {
        const std::size_t offset = layout_.begin[k];
        const Layer forces = this->layer_at(state, k);
        HessianLayer layer{};
        layer.row = forces.row;
        layer.lanes = forces.lanes;
        layer.plane = forces.plane;
        layer.neighbors = forces.neighbors;
        layer.upper_lanes = forces.upper_lanes;
        for (std::size_t c = 0; c < 3; ++c) {
            layer.displacement[c] = state.displacement[layout_.axes[c]].data() + offset;
            layer.direction[c] = direction ? (*direction)[layout_.axes[c]].data() + offset : nullptr;
        }
        for (std::size_t kind = 0; kind < 7; ++kind) {
            layer.stiffness[kind] = layout_.stiffness[kind].data() + offset;
        }
        for (std::size_t c = 0; c < components; ++c) {
            layer.partial[c] = sums[c] + offset;
            layer.above[c] = sums[c] + layout_.begin[k + 1];
        }
        layer.volume_ratio = layout_.volume_ratio;
        return layer;
    };
    // A slab leaves what it adds to the plane above it in the state, six arrays a join.
    const auto use_join_buffer = [&](HessianLayer& layer, std::size_t join) {
        for (std::size_t c = 0; c < components; ++c) {
            layer.above[c] = state.buffers[6 * join + c].data();
        }
    };
    const auto layer_kernel = kernels.layer[face_diagonals_][static_cast<int>(volume_)][static_cast<int>(accuracy_)];
    const auto top_kernel = kernels.top[face_diagonals_][static_cast<int>(accuracy_)];

    const auto sweep_slab = [&](std::size_t slab, std::size_t) {
        const std::size_t first = slab_begin_[slab], end = slab_begin_[slab + 1];
        for (T* sum : sums) {
            std::fill_n(sum + layout_.begin[first], layout_.begin[first + 1] - layout_.begin[first], T(0));
        }
        for (std::size_t k = first; k < end; ++k) {
            HessianLayer layer = layer_at(k);
            if (k + 1 == end && slab + 1 < slabs()) {
                use_join_buffer(layer, slab);
            }
            layer_kernel(layer);
        }
        if (slab + 1 == slabs()) {
            top_kernel(layer_at(end));
        }
    };
    const auto join = [&](std::size_t j, std::size_t) {
        HessianLayer layer = layer_at(slab_begin_[j + 1]);
        use_join_buffer(layer, j);
        kernels.join(layer);
    };
    this->workers().run(std::vector<Stage>{{slabs(), sweep_slab}, {slabs() - 1, join}}, 1);
}

template <class T>
void LatticeBody<T>::hessian_product(State<T>& state, const NodeField<T>& direction, NodeField<T>& product) const {
    this->allocate_like(state.displacement, product);
    T* const sums[3] = {product[layout_.axes[0]].data(), product[layout_.axes[1]].data(),
                        product[layout_.axes[2]].data()};
    sweep_hessian(state, table_->lattice_hessian->product, &direction, sums);
}

template <class T>
void LatticeBody<T>::hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6]) const {
    T* sums[6];
    for (std::size_t e = 0; e < 6; ++e) {
        AlignedArray<T>& entry = blocks[kEntry[layout_.axes[kEntryAxes[e][0]]][layout_.axes[kEntryAxes[e][1]]]];
        if (entry.size() != layout_.size()) {
            entry = AlignedArray<T>(layout_.size());
        }
        sums[e] = entry.data();
    }
    sweep_hessian<6>(state, table_->lattice_hessian->diagonal, nullptr, sums);
}

template void LatticeBody<float>::hessian_product(State<float>&, const NodeField<float>&, NodeField<float>&) const;
template void LatticeBody<double>::hessian_product(State<double>&, const NodeField<double>&, NodeField<double>&) const;
template void LatticeBody<float>::hessian_diagonal(State<float>&, AlignedArray<float> (&)[6]) const;
template void LatticeBody<double>::hessian_diagonal(State<double>&, AlignedArray<double> (&)[6]) const;

} // namespace hybmss
