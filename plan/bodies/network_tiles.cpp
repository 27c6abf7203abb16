#include "plan/bodies/network_tiles.hpp"

#include <algorithm>

namespace hybmss {
namespace {

std::ptrdiff_t at(std::size_t i) {
    return static_cast<std::ptrdiff_t>(i);
}

/// The springs and cells of a tile that both layouts have: in blocks or one by one.
template <class Layout, class Choice, class Nodes>
void add_own_forces(const Layout& layout, const Choice& choice, const NetworkTile& tile, const Nodes& nodes) {
    const auto& kernels = NetworkTiles<Layout>::kernels(*choice.table);
    kernels.springs[static_cast<int>(choice.accuracy)](layout.springs.data(), nodes, at(tile.spring_begin),
                                                       at(tile.spring_end));
    if (const auto cells = kernels.cells[static_cast<int>(choice.volume)]) {
        cells(layout.cells.data(), nodes, at(tile.cell_begin), at(tile.cell_end));
    }
}

/// The sum of energy(first, last) over pieces of a range. A tile may be the whole body, and one long sum, even in
/// double, loses more digits than its terms do.
template <class Energy>
double sum_over_pieces(std::size_t begin, std::size_t end, const Energy& energy) {
    constexpr std::size_t kPiece = 2048;
    double sum = 0;
    for (std::size_t first = begin; first < end; first += kPiece) {
        sum += energy(at(first), at(std::min(first + kPiece, end)));
    }
    return sum;
}

template <class Layout, class Choice, class Nodes>
PotentialEnergy own_energy(const Layout& layout, const Choice& choice, const NetworkTile& tile, const Nodes& nodes) {
    const auto& kernels = NetworkTiles<Layout>::kernels(*choice.table);
    PotentialEnergy energy;
    energy.springs = sum_over_pieces(tile.spring_begin, tile.spring_end, [&](auto begin, auto end) {
        return kernels.spring_energy(layout.springs.data(), nodes, begin, end);
    });
    if (const auto cells = kernels.cell_energy[static_cast<int>(choice.volume)]) {
        energy.volume = sum_over_pieces(tile.cell_begin, tile.cell_end, [&](auto begin, auto end) {
            return cells(layout.cells.data(), nodes, begin, end);
        });
    }
    return energy;
}

template <class Layout, class Choice, class Hessian, class Nodes>
void add_own_products(const Layout& layout, const Choice& choice, const Hessian& hessian, const NetworkTile& tile,
                      const Nodes& nodes) {
    const auto& kernels = NetworkTiles<Layout>::own(hessian);
    kernels.spring_product[kernels::tangent_index(choice.accuracy)](layout.springs.data(), nodes, at(tile.spring_begin),
                                                                    at(tile.spring_end));
    if (const auto cells = kernels.cell_product[static_cast<int>(choice.volume)]) {
        cells(layout.cells.data(), nodes, at(tile.cell_begin), at(tile.cell_end));
    }
}

template <class Layout, class Choice, class Hessian, class T, class Sums>
void add_own_diagonals(const Layout& layout, const Choice& choice, const Hessian& hessian, const NetworkTile& tile,
                       const T* displacement, const Sums& sums) {
    const auto& kernels = NetworkTiles<Layout>::own(hessian);
    kernels.spring_diagonal[kernels::tangent_index(choice.accuracy)](layout.springs.data(), displacement, sums,
                                                                     at(tile.spring_begin), at(tile.spring_end));
    if (const auto cells = kernels.cell_diagonal[static_cast<int>(choice.volume)]) {
        cells(layout.cells.data(), displacement, sums, at(tile.cell_begin), at(tile.cell_end));
    }
}

} // namespace

template <class T>
void NetworkTiles<PackedXyzw<T>>::add_forces(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                             const NetworkTile& tile, const kernels::PackedNodes<T>& nodes) {
    const kernels::RunKernels<T>& runs = *choice.table->runs;
    runs.springs[static_cast<int>(choice.accuracy)](spring_runs(layout), nodes, at(tile.spring_run_begin),
                                                    at(tile.spring_run_end));
    if (const auto cells = runs.cells[static_cast<int>(choice.volume)]) {
        cells(cell_runs(layout), nodes, at(tile.cell_run_begin), at(tile.cell_run_end));
    }
    add_own_forces(layout, choice, tile, nodes);
}

template <class T>
PotentialEnergy NetworkTiles<PackedXyzw<T>>::energy(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                                    const NetworkTile& tile, const kernels::PackedNodes<T>& nodes) {
    const kernels::RunKernels<T>& runs = *choice.table->runs;
    PotentialEnergy energy = own_energy(layout, choice, tile, nodes);
    energy.springs +=
        runs.spring_energy(spring_runs(layout), nodes, at(tile.spring_run_begin), at(tile.spring_run_end));
    if (const auto cells = runs.cell_energy[static_cast<int>(choice.volume)]) {
        energy.volume += cells(cell_runs(layout), nodes, at(tile.cell_run_begin), at(tile.cell_run_end));
    }
    return energy;
}

template <class T>
void NetworkTiles<PackedXyzw<T>>::add_products(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                               const PackedNetworkHessian<T>& kernels, const NetworkTile& tile,
                                               const kernels::PackedHessian<T>& nodes) {
    const kernels::RunHessianKernels<T>& runs = *kernels.runs;
    const auto springs = spring_runs(layout);
    const auto cells = cell_runs(layout);
    runs.spring_product[kernels::tangent_index(choice.accuracy)](&springs, nodes, at(tile.spring_run_begin),
                                                                 at(tile.spring_run_end));
    if (const auto product = runs.cell_product[static_cast<int>(choice.volume)]) {
        product(&cells, nodes, at(tile.cell_run_begin), at(tile.cell_run_end));
    }
    add_own_products(layout, choice, kernels, tile, nodes);
}

template <class T>
void NetworkTiles<PackedXyzw<T>>::add_diagonals(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                                const PackedNetworkHessian<T>& kernels, const NetworkTile& tile,
                                                const T* displacement, const kernels::DiagonalBlocks<T>& sums) {
    const kernels::RunHessianKernels<T>& runs = *kernels.runs;
    const auto springs = spring_runs(layout);
    const auto cells = cell_runs(layout);
    runs.spring_diagonal[kernels::tangent_index(choice.accuracy)](&springs, displacement, sums,
                                                                  at(tile.spring_run_begin), at(tile.spring_run_end));
    if (const auto diagonal = runs.cell_diagonal[static_cast<int>(choice.volume)]) {
        diagonal(&cells, displacement, sums, at(tile.cell_run_begin), at(tile.cell_run_end));
    }
    add_own_diagonals(layout, choice, kernels, tile, displacement, sums);
}

template <class T>
double NetworkTiles<PackedXyzw<T>>::stiffening_energy(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                                      const NetworkTile& tile, const kernels::PackedHessian<T>& nodes) {
    const kernels::NetworkEffectKernels<T>& effects = *choice.table->network_effects;
    const auto springs = spring_runs(layout);
    const double runs = sum_over_pieces(tile.spring_run_begin, tile.spring_run_end, [&](auto begin, auto end) {
        return effects.runs_energy(&springs, nodes, begin, end);
    });
    return runs + sum_over_pieces(tile.spring_begin, tile.spring_end, [&](auto begin, auto end) {
               return effects.packed_energy(layout.springs.data(), nodes, begin, end);
           });
}

template struct NetworkTiles<PackedXyzw<float>>;
template struct NetworkTiles<PackedXyzw<double>>;

} // namespace hybmss
