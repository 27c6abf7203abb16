#include "plan/bodies/stiffened_body.hpp"

namespace hybmss {

using kernels::SpringLaw;

template <class T>
StiffenedBody<T>::StiffenedBody(std::unique_ptr<Body<T>> inner, const SpringStiffening& stiffening)
    : Body<T>(Body<T>::workers_of(*inner)),
      inner_(std::move(inner)), constants_{static_cast<T>(stiffening.quadratic), static_cast<T>(stiffening.cubic)} {}

template <class T>
State<T> StiffenedBody<T>::make_state(bool moving) const {
    State<T> state = inner_->make_state(moving);
    this->allocate_like(state.displacement, state.stiffening);
    return state;
}

template <class T>
std::vector<Stage> StiffenedBody<T>::force_stages(State<T>& state) const {
    std::vector<Stage> stages = inner_->force_stages(state);
    append(spring_stages(state, {SpringLaw::stiffening, constants_}, nullptr, state.stiffening), stages);
    stages.push_back(this->move_into_stage(state.force, state.stiffening, array_count<T>(state.stiffening), T(-1)));
    return stages;
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
    std::vector<Stage> stages =
        spring_stages(state, {SpringLaw::stiffening_tangent, constants_}, &direction, state.stiffening);
    stages.push_back(this->move_into_stage(product, state.stiffening, array_count<T>(product), T(1)));
    this->workers().run(stages, 1);
}

template <class T>
void StiffenedBody<T>::hessian_diagonal(State<T>& state, AlignedArray<T> (&blocks)[6]) const {
    inner_->hessian_diagonal(state, blocks);
    AlignedArray<T> more[6];
    inner_->spring_diagonal(state, {SpringLaw::stiffening_tangent, constants_}, more);
    const Stage stage = this->move_into_stage(blocks, more, 6, T(1));
    this->workers().run({&stage, 1}, 1);
}

template <class T>
std::vector<Stage> StiffenedBody<T>::step_stages(State<T>& state, const StepParameters& parameters) const {
    std::vector<Stage> stages = spring_stages(state, {SpringLaw::stiffening, constants_}, nullptr, state.stiffening);
    this->add_kick_stages(state.velocity, state.stiffening, parameters.time_step, nullptr, stages);
    append(inner_->step_stages(state, parameters), stages);
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
