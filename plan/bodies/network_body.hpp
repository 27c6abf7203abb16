#pragma once

#include "kernels/kernel_table.hpp"
#include "layouts/network/colored_soa.hpp"
#include "plan/bodies/body.hpp"
#include "plan/bodies/network_polyhedra.hpp"
#include "plan/bodies/plan_description.hpp"

namespace hybmss {

/// A network as structures of arrays (ColoredSoa): colours run one after the other, the blocks of a colour in parallel.
///
/// Within a colour every node is written once at most, so neither the order of blocks nor the threads change a bit.
template <class T>
class NetworkBody final : public Body<T> {
public:
    NetworkBody(const Network& network, const PlanOptions& options);

    std::span<const double> masses() const override { return layout_.masses; }
    std::span<const NodeRun> runs() const override { return {&run_, 1}; }
    std::size_t index_of(std::size_t node) const override { return node; }
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

    kernels::NetworkSprings<T> spring_arrays() const;
    kernels::NetworkCells<T> cell_arrays() const;
    kernels::NodeArrays<T> node_arrays(State<T>& state) const;
    /// Without direction and product.
    kernels::HessianArrays<T> hessian_arrays(const State<T>& state) const;
    /// Kernels of springs and, unless null, of cells, on the blocks of every colour, a stage a colour.
    template <class Springs, class Cells, class... Arguments>
    std::vector<Stage> color_stages(Springs on_springs, Cells on_cells, const Arguments&... arguments) const;
    kernels::MeanCells<T> mean_cells() const;
    /// The same of a kernel of cells with springs on means.
    template <class Means, class... Arguments>
    void append_mean_stages(std::vector<Stage>& stages, Means on_means, const Arguments&... arguments) const;
    /// What adds all forces to arrays that are zero, a stage a colour.
    std::vector<Stage> accumulate(State<T>& state) const;
    /// A stage a colour of a visit to polyhedra.
    std::vector<Stage> polyhedron_stages(const typename NetworkPolyhedra<T>::Visit& visit) const;
    template <class Visit>
    double sum_over_pieces(std::size_t size, const Visit& visit, std::size_t piece = 128 * kPadding) const;

    ColoredSoa<T> layout_;
    NetworkMeans means_;
    kernels::MeanConstants<T> mean_constants_;
    NetworkPolyhedra<T> polyhedra_;
    NodeRun run_;
};

extern template class NetworkBody<float>;
extern template class NetworkBody<double>;

} // namespace hybmss
