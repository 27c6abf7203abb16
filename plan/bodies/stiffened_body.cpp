#include "plan/bodies/stiffened_body.hpp"

#include <algorithm>

namespace hybmss {
namespace {

using kernels::SpringLaw;

/// sum += sign * more, more = 0, component by component.
template <class T>
void move_into(AlignedArray<T>* sum, AlignedArray<T>* more, std::size_t components, T sign, const Workers& workers) {
    constexpr std::size_t kPiece = 8192;
    const std::size_t size = more[0].size(), pieces = (size + kPiece - 1) / kPiece;
    workers.run(components * pieces, [&](std::size_t i, std::size_t) {
        T* const to = sum[i / pieces].data();
        T* const from = more[i / pieces].data();
        const std::size_t begin = i % pieces * kPiece;
        for (std::size_t n = begin; n < std::min(begin + kPiece, size); ++n) {
            to[n] += sign * from[n];
            from[n] = 0;
        }
    });
}

template <class T>
std::size_t components(const NodeField<T>& field) {
    return field[1].size() > 0 ? 3 : 1;
}

} // namespace

template <class T>
StiffenedBody<T>::StiffenedBody(std::unique_ptr<Body<T>> inner, const SpringStiffening& stiffening, int threads)
    : Body<T>(Workers(threads)),
      inner_(std::move(inner)), constants_{static_cast<T>(stiffening.quadratic), static_cast<T>(stiffening.cubic)} {}

template <class T>
State<T> StiffenedBody<T>::make_state(bool moving) const {
    State<T> state = inner_->make_state(moving);
    this->allocate_like(state.displacement, state.stiffening);
    return state;
}

template <class T>
void StiffenedBody<T>::compute_forces(State<T>& state) const {
    inner_->compute_forces(state);
    this->workers().run(spring_stages(state, {SpringLaw::stiffening, constants_}, nullptr, state.stiffening), 1);
    move_into(state.force, state.stiffening, components<T>(state.force), T(-1), this->workers());
}

template <class T>
PotentialEnergy StiffenedBody<T>::energy(State<T>& state) const {
    PotentialEnergy energy = inner_->energy(state);
    energy.springs += inner_->stiffening_energy(state, constants_);
    return energy;
}

template <class T>
void StiffenedBody<T>::hessian_product(State<T>& state, const NodeField<T>& direction, NodeField<T>& product) const {
    inner_->hessian_product(state, direction, product);
    this->workers().run(spring_stages(state, {SpringLaw::stiffening_tangent, constants_}, &direction, state.stiffening),
                        1);
    move_into(product, state.stiffening, components<T>(product), T(1), this->workers());
}

template <class T>
void StiffenedBody<T>::hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6]) const {
    inner_->hessian_diagonal(state, blocks);
    AlignedArray<T> more[6];
    inner_->spring_diagonal(state, {SpringLaw::stiffening_tangent, constants_}, more);
    move_into(blocks, more, 6, T(1), this->workers());
}

template <class T>
std::vector<Stage> StiffenedBody<T>::step_stages(State<T>& state, const StepParameters& parameters) const {
    std::vector<Stage> stages = spring_stages(state, {SpringLaw::stiffening, constants_}, nullptr, state.stiffening);
    this->add_kick_stages(state.velocity, state.stiffening, parameters.time_step, nullptr, stages);
    for (Stage& stage : inner_->step_stages(state, parameters)) {
        stages.push_back(std::move(stage));
    }
    return stages;
}

template <class T>
PlanDescription StiffenedBody<T>::describe() const {
    PlanDescription description = inner_->describe();
    description.kernel += " + stiffening springs";
    return description;
}

template class StiffenedBody<float>;
template class StiffenedBody<double>;

} // namespace hybmss
