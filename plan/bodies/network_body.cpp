#include "plan/bodies/network_body.hpp"

#include "plan/bodies/critical_time_step.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// Items in a piece of work, and the same in blocks.
constexpr std::size_t kPieceBlocks = 128, kPiece = kPieceBlocks * kPadding;

/// visit(begin, end) on pieces of [begin, end), which do not depend on the threads.
template <class Visit>
Stage in_pieces(std::size_t begin, std::size_t end, Visit visit, std::size_t piece = kPiece) {
    return {(end - begin + piece - 1) / piece, [begin, end, visit, piece](std::size_t i, std::size_t) {
                const std::size_t from = begin + i * piece;
                visit(static_cast<std::ptrdiff_t>(from), static_cast<std::ptrdiff_t>(std::min(from + piece, end)));
            }};
}

/// visit(begin, end) on pieces of every colour, a stage a colour. The pieces outlive the stages.
template <class Items, class Visit>
void append_colors(const Items& items, const Visit& visit, std::vector<Stage>& stages) {
    auto piece = items.piece_begin.begin();
    for (auto color = items.color_begin.begin() + 1; color != items.color_begin.end(); ++color) {
        const auto end = std::lower_bound(piece, items.piece_begin.end(), *color);
        stages.push_back({static_cast<std::size_t>(end - piece), [visit, piece](std::size_t i, std::size_t) {
                              const auto at = piece + static_cast<std::ptrdiff_t>(i);
                              visit(static_cast<std::ptrdiff_t>(*at), static_cast<std::ptrdiff_t>(*(at + 1)));
                          }});
        piece = end;
    }
}

} // namespace

template <class T>
NetworkBody<T>::NetworkBody(const Network& network, const PlanOptions& options)
    : Body<T>(options, network.masses.size(), kernel_volume(network), network_frequencies(network), network.stiffening),
      layout_(network), means_(network),
      mean_constants_(mean_constants<T>(network.means.springs, network.means.patterns)),
      polyhedra_(network, kernel_table(), volume(), layout_.size(), [](std::size_t node) { return node; }),
      run_{0, 0, layout_.node_count} {}

template <class T>
State<T> NetworkBody<T>::linear_state(bool moving) const {
    State<T> state = this->state_of(3, layout_.size(), moving);
    polyhedra_.prepare(state);
    return state;
}

template <class T>
kernels::NetworkSprings<T> NetworkBody<T>::spring_arrays() const {
    const auto& s = layout_.springs;
    return {s.a.data(),
            s.b.data(),
            {s.rest[0].data(), s.rest[1].data(), s.rest[2].data()},
            s.stiffness.data(),
            s.inverse_length2.data(),
            s.in_row.data()};
}

template <class T>
kernels::NetworkCells<T> NetworkBody<T>::cell_arrays() const {
    const auto& c = layout_.cells;
    kernels::NetworkCells<T> cells{};
    for (std::size_t i = 0; i < 8; ++i) {
        cells.node[i] = c.node[i].data();
    }
    for (std::size_t i = 0; i < 9; ++i) {
        cells.rest_edge[i] = c.rest_edge[i].data();
    }
    cells.kappa = c.kappa.data();
    cells.inverse_volume = c.inverse_volume.data();
    cells.in_row = c.in_row.data();
    return cells;
}

template <class T>
kernels::MeanCells<T> NetworkBody<T>::mean_cells() const {
    return {mean_constants_, layout_.means.blocks.data(), nullptr, nullptr, nullptr};
}

template <class T>
kernels::NodeArrays<T> NetworkBody<T>::node_arrays(State<T>& state) const {
    kernels::NodeArrays<T> nodes{};
    for (std::size_t c = 0; c < 3; ++c) {
        nodes.displacement[c] = state.displacement[c].data();
        nodes.velocity[c] = state.velocity[c].data();
        nodes.force[c] = state.force[c].data();
    }
    nodes.inverse_mass = layout_.inverse_mass.data();
    return nodes;
}

template <class T>
template <class Visit>
double NetworkBody<T>::sum_over_pieces(std::size_t size, const Visit& visit, std::size_t piece) const {
    return this->sum_of((size + piece - 1) / piece, [&](std::size_t i) {
        return visit(static_cast<std::ptrdiff_t>(i * piece),
                     static_cast<std::ptrdiff_t>(std::min((i + 1) * piece, size)));
    });
}

template <class T>
template <class Means, class... Arguments>
void NetworkBody<T>::append_mean_stages(std::vector<Stage>& stages, Means on_means,
                                        const Arguments&... arguments) const {
    append_colors(
        layout_.means, [=, cells = mean_cells()](auto begin, auto end) { on_means(cells, arguments..., begin, end); },
        stages);
}

template <class T>
template <class Springs, class Cells, class... Arguments>
std::vector<Stage> NetworkBody<T>::color_stages(Springs on_springs, Cells on_cells,
                                                const Arguments&... arguments) const {
    std::vector<Stage> stages;
    append_colors(
        layout_.springs,
        [=, springs = spring_arrays()](auto begin, auto end) { on_springs(springs, arguments..., begin, end); },
        stages);
    if (on_cells) {
        append_colors(
            layout_.cells,
            [=, cells = cell_arrays()](auto begin, auto end) { on_cells(cells, arguments..., begin, end); }, stages);
    }
    return stages;
}

template <class T>
std::vector<Stage> NetworkBody<T>::polyhedron_stages(const typename NetworkPolyhedra<T>::Visit& visit) const {
    std::vector<Stage> stages;
    for (std::size_t shape = 0; polyhedra_.any() && shape < 3; ++shape) {
        append_colors(
            layout_.polyhedra[shape],
            [visit, shape, blocks = layout_.polyhedra[shape].blocks.data()](auto begin, auto end) {
                visit(shape, blocks, begin, end);
            },
            stages);
    }
    return stages;
}

template <class T>
std::vector<Stage> NetworkBody<T>::accumulate(State<T>& state) const {
    const kernels::NodeArrays<T> nodes = node_arrays(state);
    auto stages = color_stages(kernel_table().soa_springs(accuracy()), kernel_table().soa_cells(volume()), nodes);
    kernels::HessianArrays<T> sums{};
    std::copy_n(nodes.displacement, 3, sums.displacement);
    std::copy_n(nodes.force, 3, sums.product);
    append_mean_stages(stages, kernel_table().network_means(means_.face_diagonals, volume(), accuracy()), sums);
    if (polyhedra_.any()) {
        const auto over = [this](const auto& visit) { return polyhedron_stages(visit); };
        append(polyhedra_.before(state, sums, over), stages);
        append(polyhedron_stages(polyhedra_.forces(state, sums)), stages);
    }
    return stages;
}

template <class T>
std::vector<Stage> NetworkBody<T>::linear_force_stages(State<T>& state) const {
    this->allocate_like(state.displacement, state.force);
    std::vector<Stage> stages = accumulate(state);
    stages.insert(stages.begin(), this->clear_stage(state.force));
    return stages;
}

template <class T>
PotentialEnergy NetworkBody<T>::linear_energy(State<T>& state) const {
    const auto nodes = node_arrays(state);
    const auto springs = spring_arrays();
    PotentialEnergy energy;
    energy.springs = sum_over_pieces(layout_.springs.color_begin.back(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        return kernel_table().soa_spring_energy()(springs, nodes, begin, end);
    });
    if (volume() != kernels::Volume::none) {
        const auto cells = cell_arrays();
        energy.volume =
            sum_over_pieces(layout_.cells.color_begin.back(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                return kernel_table().soa_cell_energy(volume())(cells, nodes, begin, end);
            });
    }
    const auto at = hessian_arrays(state);
    const auto means = kernel_table().network_mean_energy(means_.face_diagonals, volume());
    const std::size_t blocks = layout_.means.color_begin.back(), pieces = (blocks + kPieceBlocks - 1) / kPieceBlocks;
    std::vector<kernels::LayerEnergy> parts(pieces);
    this->workers().run(pieces, [&](std::size_t i, std::size_t) {
        parts[i] = means(mean_cells(), at, static_cast<std::ptrdiff_t>(i * kPieceBlocks),
                         static_cast<std::ptrdiff_t>(std::min((i + 1) * kPieceBlocks, blocks)));
    });
    for (const kernels::LayerEnergy& part : parts) {
        energy.springs += part.springs;
        energy.volume += 32 * part.volume;
    }
    for (std::size_t shape = 0; polyhedra_.any() && shape < 3; ++shape) {
        const auto& all = layout_.polyhedra[shape];
        energy.volume += sum_over_pieces(
            all.color_begin.back(),
            [&](auto begin, auto end) { return polyhedra_.energy(shape, all.blocks.data(), at, begin, end); },
            kPieceBlocks);
    }
    if (polyhedra_.of_nodes()) {
        this->workers().run(
            polyhedra_.before(state, at, [this](const auto& visit) { return polyhedron_stages(visit); }), 1);
        energy.volume += polyhedra_.nodal_energy(state);
    }
    return energy;
}

template <class T>
kernels::HessianArrays<T> NetworkBody<T>::hessian_arrays(const State<T>& state) const {
    kernels::HessianArrays<T> nodes{};
    for (std::size_t c = 0; c < 3; ++c) {
        nodes.displacement[c] = state.displacement[c].data();
    }
    return nodes;
}

template <class T>
std::vector<Stage> NetworkBody<T>::spring_stages(State<T>& state, const SpringPass<T>& pass,
                                                 const NodeField<T>* direction, NodeField<T>& product) const {
    auto nodes = hessian_arrays(state);
    for (std::size_t c = 0; c < 3; ++c) {
        nodes.direction[c] = direction ? (*direction)[c].data() : nullptr;
        nodes.product[c] = product[c].data();
    }
    nodes.stiffening = pass.stiffening;
    const kernels::Volume cells = pass.cells(volume());
    const auto& table = kernel_table();
    auto stages = color_stages(table.soa_spring_product(pass.law, accuracy()), table.soa_cell_product(cells), nodes);
    append_mean_stages(stages, table.network_mean_product(means_.face_diagonals, {pass.law, cells}, accuracy()), nodes);
    if (polyhedra_.any() && cells != kernels::Volume::none) {
        append(polyhedra_.before(state, nodes, [this](const auto& visit) { return polyhedron_stages(visit); }), stages);
        append(polyhedron_stages(polyhedra_.product(state, nodes)), stages);
    }
    return stages;
}

template <class T>
void NetworkBody<T>::spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const {
    const auto nodes = hessian_arrays(state);
    const kernels::DiagonalBlocks<T> sums = this->cleared_blocks(layout_.size(), pass, blocks);
    const kernels::Volume cells = pass.cells(volume());
    const auto& table = kernel_table();
    auto stages =
        color_stages(table.soa_spring_diagonal(pass.law, accuracy()), table.soa_cell_diagonal(cells), nodes, sums);
    append_mean_stages(stages, table.network_mean_diagonal(means_.face_diagonals, {pass.law, cells}, accuracy()), nodes,
                       sums);
    const bool with_polyhedra = polyhedra_.any() && cells != kernels::Volume::none;
    if (with_polyhedra) {
        append(polyhedra_.before(state, nodes, [this](const auto& visit) { return polyhedron_stages(visit); }), stages);
        append(polyhedron_stages(polyhedra_.diagonal(nodes, sums)), stages);
    }
    this->workers().run(stages, 1);
    if (with_polyhedra) {
        polyhedra_.add_nodal_diagonal(state, sums);
    }
}

template <class T>
double NetworkBody<T>::stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const {
    auto nodes = hessian_arrays(state);
    nodes.stiffening = constants;
    const auto springs = spring_arrays();
    const auto of_springs = kernel_table().soa_stiffening_energy();
    const auto of_means = kernel_table().network_mean_stiffening_energy(means_.face_diagonals);
    return sum_over_pieces(layout_.springs.color_begin.back(),
                           [&](auto begin, auto end) { return of_springs(springs, nodes, begin, end); }) +
           sum_over_pieces(
               layout_.means.color_begin.back(),
               [&](auto begin, auto end) { return of_means(mean_cells(), nodes, begin, end); }, kPieceBlocks);
}

template <class T>
std::vector<Stage> NetworkBody<T>::linear_step_stages(State<T>& state, const StepFactors& factors) const {
    const kernels::StepConstants<T> constants = step_constants<T>(factors, length_unit());
    const bool driven = factors.driven;
    // The integrating kernel leaves the forces zero for the next step.
    this->clear_like(state.displacement, state.force);
    const auto nodes = node_arrays(state);
    std::vector<Stage> stages = accumulate(state);
    stages.push_back(in_pieces(0, layout_.size(),
                               [integrate = kernel_table().soa_integrate(driven), constants,
                                nodes](auto begin, auto end) { integrate(nodes, constants, begin, end); }));
    return stages;
}

template <class T>
void NetworkBody<T>::describe_layout(PlanDescription& d) const {
    d.kernel = network_kernels("network", means_, volume(), accuracy());
    d.springs = layout_.spring_count + means_.springs();
    d.cells = layout_.cell_count;
    d.kernel += polyhedra_.kernels(volume());
    d.bytes = layout_.bytes() + polyhedra_.bytes();
    d.tiles =
        layout_.springs.color_begin.size() + layout_.cells.color_begin.size() + layout_.means.color_begin.size() - 3;
}

template class NetworkBody<float>;
template class NetworkBody<double>;

} // namespace hybmss
