#include "plan/bodies/lattice_body.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace hybmss {
namespace {

/// Where the entry of an axis pair lies among xx, yy, zz, xy, xz, yz.
constexpr std::size_t kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
constexpr std::size_t kEntryAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

/// The kernels of a sweep that makes three values a node, a product, or six, a diagonal.
template <class T, int components>
struct SweepKernels {
    void (*layer)(const kernels::LatticeHessianLayer<T, components>&);
    void (*top)(const kernels::LatticeHessianLayer<T, components>&); ///< null where nothing is to be added
    void (*join)(const kernels::LatticeHessianLayer<T, components>&);
};
template <int components, class T>
SweepKernels<T, components> sweep_kernels(const kernels::KernelTable<T>& table, bool means, bool face_diagonals,
                                          const kernels::LatticeSum& sum, Accuracy accuracy) {
    using kernels::SpringLaw;
    if constexpr (components == 3) {
        if (sum.law == SpringLaw::crush || sum.law == SpringLaw::crush_tangent) {
            return {(sum.law == SpringLaw::crush ? table.lattice_crush : table.lattice_crush_product)(), nullptr,
                    table.lattice_join_product()};
        }
        if (sum.law == SpringLaw::own_volume || sum.law == SpringLaw::own_volume_tangent) {
            return {(sum.law == SpringLaw::own_volume ? table.lattice_volume : table.lattice_volume_product)(), nullptr,
                    table.lattice_join_product()};
        }
        if (means) {
            return {table.mean_product(face_diagonals, sum, accuracy), nullptr, table.lattice_join_product()};
        }
        return {table.lattice_product(face_diagonals, sum, accuracy),
                table.lattice_top_product(face_diagonals, sum.law, accuracy), table.lattice_join_product()};
    } else {
        if (sum.law == SpringLaw::crush_tangent) {
            return {table.lattice_crush_diagonal(), nullptr, table.lattice_join_diagonal()};
        }
        if (sum.law == SpringLaw::own_volume_tangent) {
            return {table.lattice_volume_diagonal(), nullptr, table.lattice_join_diagonal()};
        }
        if (means) {
            return {table.mean_diagonal(face_diagonals, sum, accuracy), nullptr, table.lattice_join_diagonal()};
        }
        return {table.lattice_diagonal(face_diagonals, sum, accuracy),
                table.lattice_top_diagonal(face_diagonals, sum.law, accuracy), table.lattice_join_diagonal()};
    }
}

} // namespace

template <class T>
template <int components>
kernels::LatticeHessianLayer<T, components> LatticeBody<T>::hessian_layer(State<T>& state, std::size_t k,
                                                                          const SpringPass<T>& pass,
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
    layer.volume_ratio = forces.volume_ratio;
    layer.means = forces.means;
    layer.stiffening = pass.stiffening;
    if (pass.law == kernels::SpringLaw::crush || pass.law == kernels::SpringLaw::crush_tangent) {
        layer.volume_ratio = layout_.crush_ratio;
        layer.crush_bound = static_cast<T>(material_.crush.ratio - 1);
    }
    if (pass.law == kernels::SpringLaw::own_volume || pass.law == kernels::SpringLaw::own_volume_tangent) {
        layer.stiffness[6] = layout_.volume.data() + layout_.stiffness_begin[k];
        layer.least_quadratic =
            material_.volume_energy == VolumeEnergy::quadratic ? std::numeric_limits<T>::lowest() : 0;
        layer.all_mean_stretch = material_.volume_energy == VolumeEnergy::mean_stretch;
    }
    return layer;
}

/// As LatticeBody::sweep with Finish::store: slabs side by side, and the planes where they meet.
template <class T>
template <int components>
std::vector<Stage> LatticeBody<T>::hessian_stages(State<T>& state, const SpringPass<T>& pass,
                                                  const NodeField<T>* direction,
                                                  const std::array<T*, components>& sums) const {
    const auto layer_at = [this, &state, pass, direction, sums](std::size_t k) {
        kernels::LatticeHessianLayer<T, components> layer = hessian_layer<components>(state, k, pass, direction);
        for (std::size_t c = 0; c < components; ++c) {
            layer.partial[c] = sums[c] + layout_.begin[k];
            layer.above[c] = sums[c] + layout_.begin[k + 1];
        }
        return layer;
    };
    // A slab leaves what it adds to the plane above it in the state, six arrays a join.
    const auto use_join_buffer = [&state](auto& layer, std::size_t join) {
        for (std::size_t c = 0; c < components; ++c) {
            layer.above[c] = state.buffers[6 * join + c].data();
        }
    };
    const auto kernels = sweep_kernels<components>(kernel_table(), means_, face_diagonals_,
                                                   {pass.law, pass.cells(volume())}, accuracy());
    const auto join = [=, this](std::size_t j) {
        auto layer = layer_at(slab_begin_[j + 1]);
        use_join_buffer(layer, j);
        kernels.join(layer);
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
            kernels.layer(layer);
            if (k == first && slab > 0 && meetings->second_at(slab - 1)) {
                join(slab - 1);
            }
        }
        if (slab + 1 == slabs()) {
            if (kernels.top) {
                kernels.top(layer_at(end));
            }
        } else if (meetings->second_at(slab)) {
            join(slab);
        }
    };
    return {{slabs(), sweep_slab}};
}

template <class T>
void LatticeBody<T>::linear_product(State<T>& state, const SpringPass<T>& pass, const NodeField<T>& direction,
                                    NodeField<T>& product) const {
    this->allocate_like(state.displacement, product);
    this->workers().run(spring_stages(state, pass, &direction, product), 1);
}

template <class T>
std::vector<Stage> LatticeBody<T>::spring_stages(State<T>& state, const SpringPass<T>& pass,
                                                 const NodeField<T>* direction, NodeField<T>& product) const {
    return hessian_stages<3>(
        state, pass, direction,
        {product[layout_.axes[0]].data(), product[layout_.axes[1]].data(), product[layout_.axes[2]].data()});
}

template <class T>
void LatticeBody<T>::spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const {
    std::array<T*, 6> sums{};
    for (std::size_t e = 0; e < 6; ++e) {
        AlignedArray<T>& entry = blocks[kEntry[layout_.axes[kEntryAxes[e][0]]][layout_.axes[kEntryAxes[e][1]]]];
        if (entry.size() != layout_.size()) {
            entry = AlignedArray<T>(layout_.size());
        }
        sums[e] = entry.data();
    }
    this->workers().run(hessian_stages<6>(state, pass, nullptr, sums), 1);
}

template <class T>
double LatticeBody<T>::stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const {
    const auto& table = kernel_table();
    const auto energy = (means_ ? table.mean_stiffening_energy : table.lattice_stiffening_energy)(face_diagonals_);
    const auto top = means_ ? nullptr : table.lattice_top_stiffening_energy(face_diagonals_);
    return layout_.cell_size * this->sum_of(layout_.planes, [&](std::size_t k) {
        const auto sum = k + 1 == layout_.planes ? top : energy;
        return sum ? sum(hessian_layer<3>(state, k, {kernels::SpringLaw::stiffening, constants}, nullptr)) : 0.0;
    });
}

template <class T>
double LatticeBody<T>::cell_energy(State<T>& state, kernels::SpringLaw law) const {
    const auto& table = kernel_table();
    const auto energy = (law == kernels::SpringLaw::crush ? table.lattice_crush_energy : table.lattice_volume_energy)();
    return 32 * layout_.cell_size * this->sum_of(layout_.planes - 1, [&](std::size_t k) {
        return energy(hessian_layer<3>(state, k, {law}, nullptr));
    });
}

#define HYBMSS_INSTANTIATE(T)                                                                                          \
    template void LatticeBody<T>::linear_product(State<T>&, const SpringPass<T>&, const NodeField<T>&, NodeField<T>&)  \
        const;                                                                                                         \
    template std::vector<Stage> LatticeBody<T>::spring_stages(State<T>&, const SpringPass<T>&, const NodeField<T>*,    \
                                                              NodeField<T>&) const;                                    \
    template void LatticeBody<T>::spring_diagonal(State<T>&, const SpringPass<T>&, AlignedArray<T>(&)[6]) const;       \
    template double LatticeBody<T>::stiffening_energy(State<T>&, const kernels::StiffeningConstants<T>&) const;        \
    template double LatticeBody<T>::cell_energy(State<T>&, kernels::SpringLaw) const;

HYBMSS_INSTANTIATE(float)
HYBMSS_INSTANTIATE(double)

} // namespace hybmss
