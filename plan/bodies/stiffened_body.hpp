#pragma once

#include "plan/bodies/body.hpp"

namespace hybmss {

/// A body whose springs stiffen: another body and its workers, and beside each of its own passes one over the springs
/// for what their energy has beyond 1/2 k (|d| - l)^2. In a step that force kicks the velocities before the body's own
/// sweep, as a StepEffect does. Bodies whose springs do not stiffen are never wrapped in one.
template <class T>
class StiffenedBody final : public Body<T> {
public:
    /// `stiffening`: valid.
    StiffenedBody(std::unique_ptr<Body<T>> inner, const SpringStiffening& stiffening);

    std::span<const double> masses() const override { return inner_->masses(); }
    std::span<const NodeRun> runs() const override { return inner_->runs(); }
    std::span<const std::uint32_t> order() const override { return inner_->order(); }
    std::size_t index_of(std::size_t node) const override { return inner_->index_of(node); }
    double length_unit() const override { return inner_->length_unit(); }
    const FrequencyBounds& frequencies() const override { return inner_->frequencies(); }
    PlanDescription describe() const override;

    void take_over(const Lattice& cut, std::span<const CutNode> nodes, std::size_t removed) override {
        inner_->take_over(cut, nodes, removed);
    }

    State<T> make_state(bool moving) const override;
    std::vector<Stage> force_stages(State<T>& state) const override;
    PotentialEnergy energy(State<T>& state) const override;
    void hessian_product(State<T>& state, const NodeField<T>& direction, NodeField<T>& product) const override;
    void hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6]) const override;
    std::vector<Stage> spring_stages(State<T>& state, const SpringPass<T>& pass, const NodeField<T>* direction,
                                     NodeField<T>& product) const override {
        return inner_->spring_stages(state, pass, direction, product);
    }
    void spring_diagonal(State<T>& state, const SpringPass<T>& pass, AlignedArray<T> (&blocks)[6]) const override {
        inner_->spring_diagonal(state, pass, blocks);
    }
    double stiffening_energy(State<T>& state, const kernels::StiffeningConstants<T>& constants) const override {
        return inner_->stiffening_energy(state, constants);
    }
    const AlignedArray<T>& inverse_masses() const override { return inner_->inverse_masses(); }
    const kernels::KernelTable<T>& kernel_table() const override { return inner_->kernel_table(); }
    std::vector<Stage> step_stages(State<T>& state, const StepParameters& parameters) const override;

private:
    std::unique_ptr<Body<T>> inner_;
    kernels::StiffeningConstants<T> constants_;
};

extern template class StiffenedBody<float>;
extern template class StiffenedBody<double>;

} // namespace hybmss
