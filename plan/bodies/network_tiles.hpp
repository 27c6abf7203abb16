#pragma once

#include "kernels/kernel_table.hpp"
#include "layouts/network/packed_xyzw.hpp"
#include "plan/bodies/body.hpp"

#include <limits>

// What the layouts with packed nodes call themselves, and which kernels go over one of their tiles.

namespace hybmss {

/// The kernels of a product or a diagonal: of the second derivatives, or of a law of the springs alone.
template <class T>
struct PackedNetworkHessian {
    const kernels::PackedHessianKernels<T>* packed;
    const kernels::RunHessianKernels<T>* runs;

    static PackedNetworkHessian elastic(const kernels::KernelTable<T>& table) {
        return {table.packed_hessian, table.runs_hessian};
    }
    static PackedNetworkHessian of(const kernels::KernelTable<T>& table, kernels::SpringLaw law) {
        const kernels::NetworkEffectKernels<T>& effects = *table.network_effects;
        const int l = kernels::effect_index(law);
        return {&effects.packed[l], &effects.runs[l]};
    }
};

/// The kernels' choices that a body makes once.
template <class T>
struct NetworkKernelChoice {
    const kernels::KernelTable<T>* table;
    Accuracy accuracy;
    kernels::Volume volume;
};

template <class Layout>
struct NetworkTiles;

template <class T>
struct NetworkTiles<PackedXyzw<T>> {
    static constexpr const char *kLayout = "packed-xyzw", *kKernels = "packed";
    static constexpr int kMostThreads = std::numeric_limits<int>::max();
    static const auto& kernels(const kernels::KernelTable<T>& table) { return *table.packed; }
    static const auto& own(const PackedNetworkHessian<T>& kernels) { return *kernels.packed; }

    static PackedXyzw<T> layout(const Network& network, const kernels::KernelTable<T>& table, std::size_t tile_nodes) {
        return PackedXyzw<T>(network, table.runs->vector_lanes, tile_nodes);
    }
    static kernels::SpringRuns<T> spring_runs(const PackedXyzw<T>& layout) {
        return {layout.spring_runs.data(), layout.spring_run_shapes.data(), layout.stiffnesses.data()};
    }
    static kernels::CellRuns<T> cell_runs(const PackedXyzw<T>& layout) {
        return {layout.cell_runs.data(), layout.cell_run_shapes.data(), layout.kappas.data()};
    }

    static void add_forces(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice, const NetworkTile& tile,
                           const kernels::PackedNodes<T>& nodes);
    static PotentialEnergy energy(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                  const NetworkTile& tile, const kernels::PackedNodes<T>& nodes);
    static void add_products(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                             const PackedNetworkHessian<T>& kernels, const NetworkTile& tile,
                             const kernels::PackedHessian<T>& nodes);
    static void add_diagonals(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                              const PackedNetworkHessian<T>& kernels, const NetworkTile& tile, const T* displacement,
                              const kernels::DiagonalBlocks<T>& sums);
    static double stiffening_energy(const PackedXyzw<T>& layout, const NetworkKernelChoice<T>& choice,
                                    const NetworkTile& tile, const kernels::PackedHessian<T>& nodes);
};

extern template struct NetworkTiles<PackedXyzw<float>>;
extern template struct NetworkTiles<PackedXyzw<double>>;

} // namespace hybmss
