#include "plan/bodies/packed_network_body.hpp"

#include "plan/bodies/critical_time_step.hpp"
#include "plan/bodies/plan_description.hpp"

#include <algorithm>

namespace hybmss {
namespace {

std::ptrdiff_t signed_index(std::size_t i) {
    return static_cast<std::ptrdiff_t>(i);
}

/// visit(tile) for every tile, a stage a colour.
template <class Layout, class Visit>
std::vector<Stage> tile_stages(const Layout& layout, const Visit& visit) {
    std::vector<Stage> stages;
    for (std::size_t color = 0; color + 1 < layout.color_begin.size(); ++color) {
        const std::size_t first = layout.color_begin[color];
        stages.push_back({layout.color_begin[color + 1] - first,
                          [&layout, visit, first](std::size_t i, std::size_t) { visit(layout.tiles[first + i]); }});
    }
    return stages;
}

} // namespace

template <class T, class Layout>
PackedNetworkBody<T, Layout>::PackedNetworkBody(const Network& network, const PlanOptions& options)
    : Body<T>(Workers(std::min(useful_threads(options.threads, network.masses.size(), options.task_runner),
                               NetworkTiles<Layout>::kMostThreads),
                      options.task_runner)),
      choice_{&kernels::kernel_table<T>(resolve(options.instruction_set)), options.accuracy,
              network.cells.empty() ? kernels::Volume::none : kernel_volume(network.volume_energy)},
      layout_(NetworkTiles<Layout>::layout(network, *choice_.table, options.tile_nodes)), run_{0, 0,
                                                                                               layout_.node_count},
      frequencies_(network_frequencies(network)) {}

template <class T, class Layout>
State<T> PackedNetworkBody<T, Layout>::make_state(bool moving) const {
    State<T> state;
    state.displacement[0] = AlignedArray<T>(4 * layout_.size());
    if (moving) {
        state.velocity[0] = AlignedArray<T>(4 * layout_.size());
    }
    return state;
}

template <class T, class Layout>
kernels::PackedNodes<T> PackedNetworkBody<T, Layout>::packed_nodes(State<T>& state) const {
    return {state.displacement[0].data(), state.velocity[0].data(), state.force[0].data(), layout_.inverse_mass.data()};
}

template <class T, class Layout>
void PackedNetworkBody<T, Layout>::clear_forces(State<T>& state) const {
    if (state.force[0].size() == 0) {
        state.force[0] = AlignedArray<T>(4 * layout_.size());
    } else {
        std::fill_n(state.force[0].data(), state.force[0].size(), T(0));
    }
}

template <class T, class Layout>
std::vector<Stage> PackedNetworkBody<T, Layout>::accumulate(const kernels::PackedNodes<T>& nodes) const {
    return tile_stages(layout_, [=, this](const NetworkTile& tile) {
        NetworkTiles<Layout>::add_forces(layout_, choice_, tile, nodes);
    });
}

template <class T, class Layout>
std::vector<Stage> PackedNetworkBody<T, Layout>::force_stages(State<T>& state) const {
    this->allocate_like(state.displacement, state.force);
    std::vector<Stage> stages = accumulate(packed_nodes(state));
    stages.insert(stages.begin(), this->clear_stage(state.force));
    return stages;
}

template <class T, class Layout>
PotentialEnergy PackedNetworkBody<T, Layout>::energy(State<T>& state) const {
    const auto nodes = packed_nodes(state);
    std::vector<PotentialEnergy> energies(layout_.tiles.size());
    this->workers().run(layout_.tiles.size(), [&](std::size_t t, std::size_t) {
        energies[t] = NetworkTiles<Layout>::energy(layout_, choice_, layout_.tiles[t], nodes);
    });
    PotentialEnergy sum;
    for (const PotentialEnergy& e : energies) {
        sum.springs += e.springs;
        sum.volume += e.volume;
    }
    return sum;
}

template <class T, class Layout>
std::vector<Stage> PackedNetworkBody<T, Layout>::product_stages(State<T>& state, const PackedNetworkHessian<T>& kernels,
                                                                const SpringPass<T>& pass,
                                                                const NodeField<T>* direction,
                                                                NodeField<T>& product) const {
    const kernels::PackedHessian<T> nodes{state.displacement[0].data(), direction ? (*direction)[0].data() : nullptr,
                                          product[0].data(), pass.stiffening};
    return tile_stages(layout_, [=, this](const NetworkTile& tile) {
        NetworkTiles<Layout>::add_products(layout_, choice_, kernels, tile, nodes);
    });
}

template <class T, class Layout>
void PackedNetworkBody<T, Layout>::hessian_product(State<T>& state, const NodeField<T>& direction,
                                                   NodeField<T>& product) const {
    this->allocate_like(state.displacement, product);
    std::fill_n(product[0].data(), product[0].size(), T(0));
    this->workers().run(product_stages(state, PackedNetworkHessian<T>::elastic(*choice_.table),
                                       {kernels::SpringLaw::elastic}, &direction, product),
                        1);
}

template <class T, class Layout>
std::vector<Stage> PackedNetworkBody<T, Layout>::spring_stages(State<T>& state, const SpringPass<T>& pass,
                                                               const NodeField<T>* direction,
                                                               NodeField<T>& product) const {
    return product_stages(state, PackedNetworkHessian<T>::of(*choice_.table, pass.law), pass, direction, product);
}

template <class T, class Layout>
void PackedNetworkBody<T, Layout>::run_diagonal(State<T>& state, const PackedNetworkHessian<T>& kernels,
                                                const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const {
    this->clear_blocks(layout_.size(), blocks);
    kernels::DiagonalBlocks<T> sums{};
    for (std::size_t e = 0; e < 6; ++e) {
        sums.entry[e] = blocks[e].data();
    }
    sums.stiffening = pass.stiffening;
    const T* const displacement = state.displacement[0].data();
    const auto stages = tile_stages(layout_, [&](const NetworkTile& tile) {
        NetworkTiles<Layout>::add_diagonals(layout_, choice_, kernels, tile, displacement, sums);
    });
    this->workers().run(stages, 1);
}

template <class T, class Layout>
void PackedNetworkBody<T, Layout>::hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6]) const {
    run_diagonal(state, PackedNetworkHessian<T>::elastic(*choice_.table), {kernels::SpringLaw::elastic}, blocks);
}

template <class T, class Layout>
void PackedNetworkBody<T, Layout>::spring_diagonal(State<T>& state, const SpringPass<T>& pass,
                                                   AlignedArray<T> (&blocks)[6]) const {
    run_diagonal(state, PackedNetworkHessian<T>::of(*choice_.table, pass.law), pass, blocks);
}

template <class T, class Layout>
double PackedNetworkBody<T, Layout>::stiffening_energy(State<T>& state,
                                                       const kernels::StiffeningConstants<T>& constants) const {
    const kernels::PackedHessian<T> nodes{state.displacement[0].data(), nullptr, nullptr, constants};
    std::vector<double> energies(layout_.tiles.size());
    this->workers().run(layout_.tiles.size(), [&](std::size_t t, std::size_t) {
        energies[t] = NetworkTiles<Layout>::stiffening_energy(layout_, choice_, layout_.tiles[t], nodes);
    });
    double sum = 0;
    for (double energy : energies) {
        sum += energy;
    }
    return sum;
}

template <class T, class Layout>
std::vector<Stage> PackedNetworkBody<T, Layout>::step_stages(State<T>& state, const StepParameters& parameters) const {
    const kernels::StepConstants<T> constants = step_constants<T>(parameters, length_unit());
    const auto integrate = NetworkTiles<Layout>::kernels(*choice_.table).integrate[is_driven(parameters)];
    // The integrating kernel leaves the forces zero for the next step.
    clear_forces(state);
    const auto nodes = packed_nodes(state);
    constexpr std::size_t kPiece = 2048;
    std::vector<Stage> stages = accumulate(nodes);
    stages.push_back(
        {(layout_.size() + kPiece - 1) / kPiece, [this, integrate, nodes, constants](std::size_t piece, std::size_t) {
             integrate(nodes, constants, signed_index(piece * kPiece),
                       signed_index(std::min((piece + 1) * kPiece, layout_.size())));
         }});
    return stages;
}

template <class T, class Layout>
PlanDescription PackedNetworkBody<T, Layout>::describe() const {
    PlanDescription d;
    const std::string prefix = NetworkTiles<Layout>::kKernels;
    d.instruction_set = choice_.table->instruction_set;
    d.layout = NetworkTiles<Layout>::kLayout;
    d.kernel = prefix + "_springs<" + std::string(name(choice_.accuracy)) + ">";
    if (choice_.volume != kernels::Volume::none) {
        d.kernel += " + " + prefix + "_cells<" +
                    (choice_.volume == kernels::Volume::quadratic ? "quadratic" : "mean_stretch") + ">";
    }
    d.precision = precision_name<T>();
    d.threads = this->workers().threads();
    d.nodes = layout_.node_count;
    d.springs = layout_.spring_count;
    d.cells = layout_.cell_count;
    d.bytes = layout_.bytes();
    d.tiles = layout_.tiles.size();
    return d;
}

template class PackedNetworkBody<float, PackedXyzw<float>>;
template class PackedNetworkBody<double, PackedXyzw<double>>;

} // namespace hybmss
