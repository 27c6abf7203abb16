#pragma once

#include "layouts/network/packed_xyzw.hpp"
#include "plan/bodies/body.hpp"
#include "plan/bodies/network_polyhedra.hpp"
#include "plan/bodies/plan_description.hpp"

namespace hybmss {

/// A network with packed nodes (PackedXyzw).
///
/// The colours of its tiles run one after the other, the tiles of a colour in parallel. Tiles of a colour share no
/// node, so each node gets its contributions in the order of the colours, whatever the threads do.
template <class T>
class PackedNetworkBody final : public Body<T> {
public:
    PackedNetworkBody(const Network& network, const PlanOptions& options);

    std::span<const double> masses() const override { return layout_.masses; }
    std::span<const NodeRun> runs() const override { return {&run_, 1}; }
    std::span<const std::uint32_t> order() const override { return layout_.order; }
    std::size_t index_of(std::size_t node) const override { return layout_.place.empty() ? node : layout_.place[node]; }
    double length_unit() const override { return 1; }
    std::vector<Stage> spring_stages(State<T>& state, const SpringPass<T>& pass, const NodeField<T>* direction,
                                     NodeField<T>& product) const override;
    void spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const override;
    double stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const override;
    const AlignedArray<T>& inverse_masses() const override { return layout_.inverse_mass; }

private:
    using Body<T>::accuracy;
    using Body<T>::kernel_table;
    using Body<T>::volume;

    State<T> linear_state(bool moving) const override;
    std::vector<Stage> linear_force_stages(State<T>& state) const override;
    PotentialEnergy linear_energy(State<T>& state) const override;
    std::vector<Stage> linear_step_stages(State<T>& state, const StepFactors& factors) const override;
    void describe_layout(PlanDescription& description) const override;

    kernels::SpringRuns<T> spring_runs() const;
    kernels::CellRuns<T> cell_runs() const;
    kernels::MeanCells<T> mean_cells(bool in_runs) const;
    PotentialEnergy energy(const NetworkTile& tile, const kernels::PackedNodes<T>& nodes) const;
    double stiffening_energy(const NetworkTile& tile, const kernels::PackedHessian<T>& nodes) const;
    /// visit(cells, begin, end) of the tile's cells with springs on means: those in runs, those in blocks.
    template <class Visit>
    void for_means(const NetworkTile& tile, const Visit& visit) const;
    /// Kernels of springs and, unless null, of cells, each in runs and in blocks, on_means() of for_means(), and what
    /// polyhedra are visited by, unless it is empty, on every tile: a stage a colour.
    template <class SpringRuns, class CellRuns, class Springs, class Cells, class Means, class... Arguments>
    std::vector<Stage> tile_stages(SpringRuns on_spring_runs, CellRuns on_cell_runs, Springs on_springs, Cells on_cells,
                                   Means on_means, const typename NetworkPolyhedra<T>::Visit& on_polyhedra,
                                   const Arguments&... arguments) const;
    /// The same of a visit to polyhedra: on a tile, and a stage a colour.
    void for_polyhedra(const NetworkTile& tile, const typename NetworkPolyhedra<T>::Visit& visit) const;
    std::vector<Stage> polyhedron_stages(const typename NetworkPolyhedra<T>::Visit& visit) const;
    /// Those and, before them, what volumes of nodes are: nothing without.
    std::vector<Stage> nodal_stages(State<T>& state, const kernels::HessianArrays<T>& fields) const;
    kernels::PackedNodes<T> packed_nodes(State<T>& state) const;
    /// What adds all forces to nodes whose forces are zero, a stage a colour.
    std::vector<Stage> accumulate(State<T>& state) const;

    PackedXyzw<T> layout_;
    NetworkMeans means_;
    kernels::MeanConstants<T> mean_constants_;
    NetworkPolyhedra<T> polyhedra_;
    NodeRun run_; ///< all nodes, where the layout keeps the caller's order
};

extern template class PackedNetworkBody<float>;
extern template class PackedNetworkBody<double>;

} // namespace hybmss
