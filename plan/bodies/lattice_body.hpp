#pragma once

#include "kernels/kernel_table.hpp"
#include "layouts/lattice/lattice_arrays.hpp"
#include "plan/bodies/body.hpp"
#include "plan/threads/staged_run.hpp"

#include <array>
#include <string>
#include <type_traits>

namespace hybmss {

/// How a lattice's rows lie in memory: flat_rows() with these axes, or active_rows() with their own.
struct LatticeRows {
    bool active;
    LatticeAxes axes;
};

/// A lattice swept layer by layer.
///
/// The layers of cells are divided into slabs, by the body alone, so that results do not depend on the threads. Slabs
/// meet in a plane of nodes, where each leaves what it adds in a buffer of its own. Whoever of the two comes second
/// joins the sums, always in the same order, and finishes the plane.
template <class T>
class LatticeBody final : public Body<T> {
public:
    LatticeBody(const Lattice& lattice, const Material& material, const PlanOptions& options, const LatticeRows& rows);

    std::span<const double> masses() const override { return layout_.masses; }
    std::span<const NodeRun> runs() const override { return layout_.runs; }
    std::size_t index_of(std::size_t node) const override { return index_in(layout_.runs, node); }
    double length_unit() const override { return layout_.cell_size; }
    void take_over(const Lattice& cut, std::span<const CutNode> nodes, std::size_t removed) override;

    std::vector<Stage> spring_stages(State<T>& state, const SpringPass<T>& pass, const NodeField<T>* direction,
                                     NodeField<T>& product) const override;
    void spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const override;
    double stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const override;
    double cell_energy(State<T>& state, kernels::SpringLaw law) const override;
    State<T> state_abreast() const override { return state_of_bodies(true, this->abreast()); }
    bool steps_like(const Body<T>& other) const override;
    const AlignedArray<T>& inverse_masses() const override { return layout_.inverse_mass; }

private:
    using Body<T>::accuracy;
    using Body<T>::kernel_table;
    using Body<T>::volume;
    using Layer = kernels::LatticeLayer<T>;

    State<T> linear_state(bool moving) const override { return state_of_bodies(moving, 1); }
    State<T> state_of_bodies(bool moving, std::size_t bodies) const;
    std::size_t linear_abreast() const override;
    std::vector<Stage> linear_force_stages(State<T>& state) const override;
    PotentialEnergy linear_energy(State<T>& state) const override;
    void linear_product(State<T>& state, const SpringPass<T>& pass, const NodeField<T>& direction,
                        NodeField<T>& product) const override;
    std::vector<Stage> linear_step_stages(State<T>& state, const StepFactors& factors) const override;
    void describe_layout(PlanDescription& description) const override;

    /// The layer of cells above node plane k, without the arrays for forces.
    Layer layer_at(State<T>& state, std::size_t k) const;
    /// Leads a layer to plane k: what differs between layers, for small bodies whose layers take less time than a copy.
    void lead(Layer& layer, State<T>& state, std::size_t k) const;
    /// Springs whose first node, or whose cell's low corner, lies at `index`.
    std::size_t springs_from(std::size_t index) const;
    /// Of one with springs on means, where cells share none.
    std::size_t springs_of_cell() const { return face_diagonals_ ? 13 : 7; }
    std::size_t slabs() const { return slab_begin_.size() - 1; }
    /// Finishes the plane where slabs `join` and `join` + 1 meet.
    void join(State<T>& state, std::size_t join, kernels::Finish finish, const kernels::StepConstants<T>& step) const;
    /// The slabs, and what joins them. The state must outlive the stages.
    std::vector<Stage> sweep(State<T>& state, kernels::Finish finish, const kernels::StepConstants<T>& step) const;
    void sweep_slab(State<T>& state, std::size_t slab, std::size_t worker, kernels::Finish finish,
                    const kernels::StepConstants<T>& step, Meetings& meetings) const;

    /// Layer k without the arrays for sums; `direction`: null where none is needed.
    template <int components>
    kernels::LatticeHessianLayer<T, components> hessian_layer(State<T>& state, std::size_t k, const SpringPass<T>& pass,
                                                              const NodeField<T>* direction) const;
    /// `sums`: the arrays that the sweep sets. The state and the fields must outlive the stages.
    template <int components>
    std::vector<Stage> hessian_stages(State<T>& state, const SpringPass<T>& pass, const NodeField<T>* direction,
                                      const std::array<T*, components>& sums) const;

    LatticeArrays<T> layout_;
    Material material_;
    bool active_; ///< in active-rows
    bool means_;  ///< springs on means
    bool face_diagonals_;
    kernels::MeanConstants<T> mean_constants_;
    std::vector<std::size_t> slab_begin_; ///< the first layer of each slab; one more entry at the end
    std::size_t springs_, cells_;
};

extern template class LatticeBody<float>;
extern template class LatticeBody<double>;

} // namespace hybmss
