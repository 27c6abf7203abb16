#include "plan/bodies/lattice_body.hpp"

#include <algorithm>
#include <array>

namespace hybmss {
namespace {

/// Where the entry of an axis pair lies among xx, yy, zz, xy, xz, yz.
constexpr std::size_t kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
constexpr std::size_t kEntryAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

} // namespace

template <class T>
template <int components>
kernels::LatticeHessianLayer<T, components> LatticeBody<T>::hessian_layer(State<T>& state, std::size_t k,
                                                                          const NodeField<T>* direction) const {
    const std::size_t offset = layout_.begin[k];
    const Layer forces = this->layer_at(state, k);
    kernels::LatticeHessianLayer<T, components> layer{};
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
        layer.stiffness[kind] = forces.stiffness[kind];
    }
    layer.volume_ratio = layout_.volume_ratio;
    return layer;
}

/// As LatticeBody::sweep with Finish::store: slabs side by side, and the planes where they meet.
template <class T>
template <int components>
std::vector<Stage> LatticeBody<T>::hessian_stages(State<T>& state,
                                                  const kernels::LatticeHessianSweep<T, components>& kernels,
                                                  const HessianSweep& sweep, const NodeField<T>* direction,
                                                  const std::type_identity_t<std::array<T*, components>>& sums) const {
    const auto layer_at = [this, &state, sweep, direction, sums](std::size_t k) {
        kernels::LatticeHessianLayer<T, components> layer = hessian_layer<components>(state, k, direction);
        for (std::size_t c = 0; c < components; ++c) {
            layer.partial[c] = sums[c] + layout_.begin[k];
            layer.above[c] = sums[c] + layout_.begin[k + 1];
        }
        layer.stiffening = sweep.stiffening;
        return layer;
    };
    // A slab leaves what it adds to the plane above it in the state, six arrays a join.
    const auto use_join_buffer = [&state](auto& layer, std::size_t join) {
        for (std::size_t c = 0; c < components; ++c) {
            layer.above[c] = state.buffers[6 * join + c].data();
        }
    };
    const auto layer_kernel =
        kernels.layer[face_diagonals_][static_cast<int>(sweep.volume)][kernels::tangent_index(accuracy_)];
    const auto top_kernel = kernels.top[face_diagonals_][kernels::tangent_index(accuracy_)];

    const auto join = [=, this, join_kernel = kernels.join](std::size_t j) {
        auto layer = layer_at(slab_begin_[j + 1]);
        use_join_buffer(layer, j);
        join_kernel(layer);
    };
    const auto meetings = std::make_shared<Meetings>(slabs() - 1);
    const auto sweep_slab = [=, this](std::size_t slab, std::size_t) {
        const std::size_t first = slab_begin_[slab], end = slab_begin_[slab + 1];
        for (T* sum : sums) {
            std::fill_n(sum + layout_.begin[first], layout_.begin[first + 1] - layout_.begin[first], T(0));
        }
        for (std::size_t k = first; k < end; ++k) {
            auto layer = layer_at(k);
            if (k + 1 == end && slab + 1 < slabs()) {
                use_join_buffer(layer, slab);
            }
            layer_kernel(layer);
            if (k == first && slab > 0 && meetings->second_at(slab - 1)) {
                join(slab - 1);
            }
        }
        if (slab + 1 == slabs()) {
            top_kernel(layer_at(end));
        } else if (meetings->second_at(slab)) {
            join(slab);
        }
    };
    return {{slabs(), sweep_slab}};
}

template <class T>
auto LatticeBody<T>::sweep_of(const SpringPass<T>& pass) const -> HessianSweep {
    return {&table_->lattice_effects->law[kernels::effect_index(pass.law)], kernels::Volume::none, pass.stiffening};
}

template <class T>
void LatticeBody<T>::hessian_product(State<T>& state, const NodeField<T>& direction, NodeField<T>& product) const {
    this->allocate_like(state.displacement, product);
    const std::array<T*, 3> sums = {product[layout_.axes[0]].data(), product[layout_.axes[1]].data(),
                                    product[layout_.axes[2]].data()};
    this->workers().run(hessian_stages(state, elastic().kernels->product, elastic(), &direction, sums), 1);
}

template <class T>
std::vector<Stage> LatticeBody<T>::spring_stages(State<T>& state, const SpringPass<T>& pass,
                                                 const NodeField<T>* direction, NodeField<T>& product) const {
    const HessianSweep sweep = sweep_of(pass);
    const std::array<T*, 3> sums = {product[layout_.axes[0]].data(), product[layout_.axes[1]].data(),
                                    product[layout_.axes[2]].data()};
    return hessian_stages(state, sweep.kernels->product, sweep, direction, sums);
}

template <class T>
void LatticeBody<T>::run_diagonal(State<T>& state, const HessianSweep& sweep, AlignedArray<T> (&blocks)[6]) const {
    std::array<T*, 6> sums{};
    for (std::size_t e = 0; e < 6; ++e) {
        AlignedArray<T>& entry = blocks[kEntry[layout_.axes[kEntryAxes[e][0]]][layout_.axes[kEntryAxes[e][1]]]];
        if (entry.size() != layout_.size()) {
            entry = AlignedArray<T>(layout_.size());
        }
        sums[e] = entry.data();
    }
    this->workers().run(hessian_stages(state, sweep.kernels->diagonal, sweep, nullptr, sums), 1);
}

template <class T>
void LatticeBody<T>::hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6]) const {
    run_diagonal(state, elastic(), blocks);
}

template <class T>
void LatticeBody<T>::spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const {
    run_diagonal(state, sweep_of(pass), blocks);
}

template <class T>
double LatticeBody<T>::stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const {
    std::vector<double> layers(layout_.planes);
    this->workers().run(layout_.planes, [&](std::size_t k, std::size_t) {
        kernels::LatticeHessianLayer<T, 3> layer = hessian_layer<3>(state, k, nullptr);
        layer.stiffening = constants;
        layers[k] = table_->lattice_effects->stiffening_energy[face_diagonals_][k + 1 == layout_.planes](layer);
    });
    double sum = 0;
    for (double layer : layers) {
        sum += layer;
    }
    return sum * layout_.cell_size;
}

template void LatticeBody<float>::hessian_product(State<float>&, const NodeField<float>&, NodeField<float>&) const;
template void LatticeBody<double>::hessian_product(State<double>&, const NodeField<double>&, NodeField<double>&) const;
template void LatticeBody<float>::hessian_diagonal(State<float>&, AlignedArray<float> (&)[6]) const;
template void LatticeBody<double>::hessian_diagonal(State<double>&, AlignedArray<double> (&)[6]) const;
template std::vector<Stage> LatticeBody<float>::spring_stages(State<float>&, const SpringPass<float>&,
                                                              const NodeField<float>*, NodeField<float>&) const;
template std::vector<Stage> LatticeBody<double>::spring_stages(State<double>&, const SpringPass<double>&,
                                                               const NodeField<double>*, NodeField<double>&) const;
template void LatticeBody<float>::spring_diagonal(State<float>&, const SpringPass<float>&,
                                                  AlignedArray<float> (&)[6]) const;
template void LatticeBody<double>::spring_diagonal(State<double>&, const SpringPass<double>&,
                                                   AlignedArray<double> (&)[6]) const;
template double LatticeBody<float>::stiffening_energy(State<float>&, const kernels::StiffeningConstants<float>&) const;
template double LatticeBody<double>::stiffening_energy(State<double>&,
                                                       const kernels::StiffeningConstants<double>&) const;
template void LatticeBody<float>::run_diagonal(State<float>&, const HessianSweep&, AlignedArray<float> (&)[6]) const;
template auto LatticeBody<float>::sweep_of(const SpringPass<float>&) const -> HessianSweep;
template void LatticeBody<double>::run_diagonal(State<double>&, const HessianSweep&, AlignedArray<double> (&)[6]) const;
template auto LatticeBody<double>::sweep_of(const SpringPass<double>&) const -> HessianSweep;

} // namespace hybmss
