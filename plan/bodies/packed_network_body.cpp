#include "plan/bodies/packed_network_body.hpp"

#include "plan/bodies/critical_time_step.hpp"

#include <algorithm>

namespace hybmss {
namespace {

std::ptrdiff_t at(std::size_t i) {
    return static_cast<std::ptrdiff_t>(i);
}

/// visit(first, last) of pieces of a range. A tile may be the whole body, and one long sum, even in double, loses more
/// digits than its terms do.
template <class Visit>
void for_pieces(std::size_t begin, std::size_t end, const Visit& visit) {
    constexpr std::size_t kPiece = 2048;
    for (std::size_t first = begin; first < end; first += kPiece) {
        visit(at(first), at(std::min(first + kPiece, end)));
    }
}
/// The sum of energy(first, last) over them.
template <class Energy>
double sum_over_pieces(std::size_t begin, std::size_t end, const Energy& energy) {
    double sum = 0;
    for_pieces(begin, end, [&](auto first, auto last) { sum += energy(first, last); });
    return sum;
}

/// Packed nodes as kernels of cells with springs on means take them.
template <class T>
kernels::HessianArrays<T> arrays(const kernels::PackedHessian<T>& nodes) {
    return {{nodes.displacement}, {nodes.direction}, {nodes.product}, nodes.stiffening};
}

} // namespace

template <class T>
PackedNetworkBody<T>::PackedNetworkBody(const Network& network, const PlanOptions& options)
    : Body<T>(options, network.masses.size(), kernel_volume(network), network_frequencies(network), network.stiffening),
      layout_(network, kernel_table().width, options.one_tile), means_(network),
      mean_constants_(mean_constants<T>(network.means.springs, network.means.patterns)),
      polyhedra_(network, kernel_table(), volume(), 4 * layout_.size(),
                 [this](std::size_t node) { return 4 * index_of(node); }),
      run_{0, 0, layout_.node_count} {}

template <class T>
State<T> PackedNetworkBody<T>::linear_state(bool moving) const {
    State<T> state = this->state_of(1, 4 * layout_.size(), moving);
    polyhedra_.prepare(state);
    return state;
}

template <class T>
kernels::PackedNodes<T> PackedNetworkBody<T>::packed_nodes(State<T>& state) const {
    return {state.displacement[0].data(), state.velocity[0].data(), state.force[0].data(), layout_.inverse_mass.data()};
}

template <class T>
kernels::SpringRuns<T> PackedNetworkBody<T>::spring_runs() const {
    return {layout_.spring_runs.data(), layout_.spring_run_shapes.data(), layout_.stiffnesses.data()};
}
template <class T>
kernels::CellRuns<T> PackedNetworkBody<T>::cell_runs() const {
    return {layout_.cell_runs.data(), layout_.cell_run_shapes.data(), layout_.kappas.data()};
}

template <class T>
kernels::MeanCells<T> PackedNetworkBody<T>::mean_cells(bool in_runs) const {
    const auto& m = layout_.means;
    return {mean_constants_, m.blocks.data(), in_runs ? m.runs.data() : nullptr, m.run_shapes.data(),
            m.stiffnesses.data()};
}

template <class T>
template <class Visit>
void PackedNetworkBody<T>::for_means(const NetworkTile& tile, const Visit& visit) const {
    for_pieces(tile.mean_run_begin, tile.mean_run_end,
               [&](auto begin, auto end) { visit(mean_cells(true), begin, end); });
    for_pieces(tile.mean_begin, tile.mean_end, [&](auto begin, auto end) { visit(mean_cells(false), begin, end); });
}

template <class T>
template <class SpringRuns, class CellRuns, class Springs, class Cells, class Means, class... Arguments>
std::vector<Stage> PackedNetworkBody<T>::tile_stages(SpringRuns on_spring_runs, CellRuns on_cell_runs,
                                                     Springs on_springs, Cells on_cells, Means on_means,
                                                     const typename NetworkPolyhedra<T>::Visit& on_polyhedra,
                                                     const Arguments&... arguments) const {
    std::vector<Stage> stages;
    for (std::size_t color = 0; color + 1 < layout_.color_begin.size(); ++color) {
        const std::size_t first = layout_.color_begin[color];
        stages.push_back(
            {layout_.color_begin[color + 1] - first, [=, this](std::size_t i, std::size_t) {
                 const NetworkTile& tile = layout_.tiles[first + i];
                 on_spring_runs(spring_runs(), arguments..., at(tile.spring_run_begin), at(tile.spring_run_end));
                 if (on_cell_runs) {
                     on_cell_runs(cell_runs(), arguments..., at(tile.cell_run_begin), at(tile.cell_run_end));
                 }
                 on_springs(layout_.springs.data(), arguments..., at(tile.spring_begin), at(tile.spring_end));
                 if (on_cells) {
                     on_cells(layout_.cells.data(), arguments..., at(tile.cell_begin), at(tile.cell_end));
                 }
                 for_means(tile, on_means);
                 if (on_polyhedra) {
                     for_polyhedra(tile, on_polyhedra);
                 }
             }});
    }
    return stages;
}

template <class T>
void PackedNetworkBody<T>::for_polyhedra(const NetworkTile& tile,
                                         const typename NetworkPolyhedra<T>::Visit& visit) const {
    for (std::size_t shape = 0; shape < 3; ++shape) {
        visit(shape, layout_.polyhedra[shape].data(), at(tile.polyhedron_begin[shape]), at(tile.polyhedron_end[shape]));
    }
}

template <class T>
std::vector<Stage> PackedNetworkBody<T>::polyhedron_stages(const typename NetworkPolyhedra<T>::Visit& visit) const {
    std::vector<Stage> stages;
    for (std::size_t color = 0; color + 1 < layout_.color_begin.size(); ++color) {
        const std::size_t first = layout_.color_begin[color];
        stages.push_back({layout_.color_begin[color + 1] - first, [this, first, visit](std::size_t i, std::size_t) {
                              for_polyhedra(layout_.tiles[first + i], visit);
                          }});
    }
    return stages;
}

template <class T>
std::vector<Stage> PackedNetworkBody<T>::nodal_stages(State<T>& state, const kernels::HessianArrays<T>& fields) const {
    return polyhedra_.before(state, fields, [this](const auto& visit) { return polyhedron_stages(visit); });
}

template <class T>
PotentialEnergy PackedNetworkBody<T>::energy(const NetworkTile& tile, const kernels::PackedNodes<T>& nodes) const {
    PotentialEnergy energy;
    energy.springs = sum_over_pieces(tile.spring_begin, tile.spring_end, [&](auto begin, auto end) {
        return kernel_table().packed_spring_energy()(layout_.springs.data(), nodes, begin, end);
    });
    energy.springs +=
        kernel_table().run_spring_energy()(spring_runs(), nodes, at(tile.spring_run_begin), at(tile.spring_run_end));
    if (const auto cells = kernel_table().packed_cell_energy(volume())) {
        energy.volume = sum_over_pieces(tile.cell_begin, tile.cell_end, [&](auto begin, auto end) {
            return cells(layout_.cells.data(), nodes, begin, end);
        });
    }
    if (const auto cells = kernel_table().run_cell_energy(volume())) {
        energy.volume += cells(cell_runs(), nodes, at(tile.cell_run_begin), at(tile.cell_run_end));
    }
    const auto of_means = kernel_table().network_mean_energy(means_.face_diagonals, volume());
    for_means(tile, [&](const auto& cells, kernels::Range begin, kernels::Range end) {
        const kernels::LayerEnergy part =
            of_means(cells, arrays<T>({nodes.displacement, nullptr, nullptr, {}}), begin, end);
        energy.springs += part.springs;
        energy.volume += 32 * part.volume;
    });
    if (polyhedra_.any()) {
        for_polyhedra(tile, [&](std::size_t shape, const auto* blocks, kernels::Range begin, kernels::Range end) {
            energy.volume += sum_over_pieces(
                static_cast<std::size_t>(begin), static_cast<std::size_t>(end), [&](auto first, auto last) {
                    return polyhedra_.energy(shape, blocks, arrays<T>({nodes.displacement, nullptr, nullptr, {}}),
                                             first, last);
                });
        });
    }
    return energy;
}

template <class T>
double PackedNetworkBody<T>::stiffening_energy(const NetworkTile& tile, const kernels::PackedHessian<T>& nodes) const {
    const double runs = sum_over_pieces(tile.spring_run_begin, tile.spring_run_end, [&](auto begin, auto end) {
        return kernel_table().run_stiffening_energy()(spring_runs(), nodes, begin, end);
    });
    double sum = runs + sum_over_pieces(tile.spring_begin, tile.spring_end, [&](auto begin, auto end) {
                     return kernel_table().packed_stiffening_energy()(layout_.springs.data(), nodes, begin, end);
                 });
    const auto of_means = kernel_table().network_mean_stiffening_energy(means_.face_diagonals);
    for_means(tile, [&](const auto& cells, kernels::Range begin, kernels::Range end) {
        sum += of_means(cells, arrays(nodes), begin, end);
    });
    return sum;
}

template <class T>
std::vector<Stage> PackedNetworkBody<T>::accumulate(State<T>& state) const {
    const kernels::PackedNodes<T> nodes = packed_nodes(state);
    const auto& table = kernel_table();
    const auto sums = arrays<T>({nodes.displacement, nullptr, nodes.force, {}});
    const auto on_means = [of_means = table.network_means(means_.face_diagonals, volume(), accuracy()),
                           sums](const auto& cells, kernels::Range begin, kernels::Range end) {
        of_means(cells, sums, begin, end);
    };
    std::vector<Stage> stages = nodal_stages(state, sums);
    append(tile_stages(table.run_springs(accuracy()), table.run_cells(volume()), table.packed_springs(accuracy()),
                       table.packed_cells(volume()), on_means,
                       polyhedra_.any() ? polyhedra_.forces(state, sums) : nullptr, nodes),
           stages);
    return stages;
}

template <class T>
std::vector<Stage> PackedNetworkBody<T>::linear_force_stages(State<T>& state) const {
    this->allocate_like(state.displacement, state.force);
    std::vector<Stage> stages = accumulate(state);
    stages.insert(stages.begin(), this->clear_stage(state.force));
    return stages;
}

template <class T>
PotentialEnergy PackedNetworkBody<T>::linear_energy(State<T>& state) const {
    const auto nodes = packed_nodes(state);
    std::vector<PotentialEnergy> energies(layout_.tiles.size());
    this->workers().run(layout_.tiles.size(),
                        [&](std::size_t t, std::size_t) { energies[t] = energy(layout_.tiles[t], nodes); });
    PotentialEnergy sum;
    for (const PotentialEnergy& e : energies) {
        sum.springs += e.springs;
        sum.volume += e.volume;
    }
    if (polyhedra_.of_nodes()) {
        this->workers().run(nodal_stages(state, arrays<T>({nodes.displacement, nullptr, nullptr, {}})), 1);
        sum.volume += polyhedra_.nodal_energy(state);
    }
    return sum;
}

template <class T>
std::vector<Stage> PackedNetworkBody<T>::spring_stages(State<T>& state, const SpringPass<T>& pass,
                                                       const NodeField<T>* direction, NodeField<T>& product) const {
    const kernels::PackedHessian<T> nodes{state.displacement[0].data(), direction ? (*direction)[0].data() : nullptr,
                                          product[0].data(), pass.stiffening};
    const auto& table = kernel_table();
    const kernels::Volume cells = pass.cells(volume());
    const auto on_means = [of_means = table.network_mean_product(means_.face_diagonals, {pass.law, cells}, accuracy()),
                           sums = arrays(nodes)](const auto& on, kernels::Range begin, kernels::Range end) {
        of_means(on, sums, begin, end);
    };
    const bool with_polyhedra = polyhedra_.any() && cells != kernels::Volume::none;
    std::vector<Stage> stages = with_polyhedra ? nodal_stages(state, arrays(nodes)) : std::vector<Stage>();
    append(tile_stages(table.run_spring_product(pass.law, accuracy()), table.run_cell_product(cells),
                       table.packed_spring_product(pass.law, accuracy()), table.packed_cell_product(cells), on_means,
                       with_polyhedra ? polyhedra_.product(state, arrays(nodes)) : nullptr, nodes),
           stages);
    return stages;
}

template <class T>
void PackedNetworkBody<T>::spring_diagonal(State<T>& state, const SpringPass<T>& pass,
                                           AlignedArray<T> (&blocks)[6]) const {
    const kernels::DiagonalBlocks<T> sums = this->cleared_blocks(layout_.size(), pass, blocks);
    const auto& table = kernel_table();
    const kernels::Volume cells = pass.cells(volume());
    const T* const displacement = state.displacement[0].data();
    const auto on_means = [of_means = table.network_mean_diagonal(means_.face_diagonals, {pass.law, cells}, accuracy()),
                           nodes = arrays<T>({displacement, nullptr, nullptr, {}}),
                           sums](const auto& on, kernels::Range begin, kernels::Range end) {
        of_means(on, nodes, sums, begin, end);
    };
    const bool with_polyhedra = polyhedra_.any() && cells != kernels::Volume::none;
    const auto fields = arrays<T>({displacement, nullptr, nullptr, {}});
    std::vector<Stage> stages = with_polyhedra ? nodal_stages(state, fields) : std::vector<Stage>();
    append(tile_stages(table.run_spring_diagonal(pass.law, accuracy()), table.run_cell_diagonal(cells),
                       table.packed_spring_diagonal(pass.law, accuracy()), table.packed_cell_diagonal(cells), on_means,
                       with_polyhedra ? polyhedra_.diagonal(fields, sums) : nullptr, displacement, sums),
           stages);
    this->workers().run(stages, 1);
    if (with_polyhedra) {
        polyhedra_.add_nodal_diagonal(state, sums);
    }
}

template <class T>
double PackedNetworkBody<T>::stiffening_energy(State<T>& state,
                                               const kernels::StiffeningConstants<T>& constants) const {
    const kernels::PackedHessian<T> nodes{state.displacement[0].data(), nullptr, nullptr, constants};
    return this->sum_of(layout_.tiles.size(),
                        [&](std::size_t t) { return stiffening_energy(layout_.tiles[t], nodes); });
}

template <class T>
std::vector<Stage> PackedNetworkBody<T>::linear_step_stages(State<T>& state, const StepFactors& factors) const {
    const kernels::StepConstants<T> constants = step_constants<T>(factors, length_unit());
    const auto integrate = kernel_table().packed_integrate(factors.driven);
    // The integrating kernel leaves the forces zero for the next step.
    this->clear_like(state.displacement, state.force);
    const auto nodes = packed_nodes(state);
    constexpr std::size_t kPiece = 2048;
    std::vector<Stage> stages = accumulate(state);
    stages.push_back(
        {(layout_.size() + kPiece - 1) / kPiece, [this, integrate, nodes, constants](std::size_t piece, std::size_t) {
             integrate(nodes, constants, at(piece * kPiece), at(std::min((piece + 1) * kPiece, layout_.size())));
         }});
    return stages;
}

template <class T>
void PackedNetworkBody<T>::describe_layout(PlanDescription& d) const {
    d.kernel = network_kernels("packed", means_, volume(), accuracy());
    d.springs = layout_.spring_count + means_.springs();
    d.cells = layout_.cell_count;
    d.kernel += polyhedra_.kernels(volume());
    d.bytes = layout_.bytes() + polyhedra_.bytes();
    d.tiles = layout_.tiles.size();
}

template class PackedNetworkBody<float>;
template class PackedNetworkBody<double>;

} // namespace hybmss
