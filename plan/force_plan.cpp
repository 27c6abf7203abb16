#include "hybmss/force_plan.hpp"

#include "plan/bodies/largest_eigenvalue.hpp"
#include "plan/tuning/planned_body.hpp"

#include <cmath>
#include <mutex>
#include <vector>

namespace hybmss {

/// The body, and the states that are not in use: each execution takes one, so that a plan may run many times at once.
template <class T>
struct ForcePlan<T>::Implementation {
    explicit Implementation(PlannedBody<T> made) : planned(std::move(made)), body(planned.body.get()) {
        idle.push_back(body->make_state(false));
    }

    State<T> take() {
        const std::lock_guard lock(mutex);
        if (idle.empty()) {
            return body->make_state(false);
        }
        State<T> state = std::move(idle.back());
        idle.pop_back();
        return state;
    }
    void give_back(State<T> state) {
        const std::lock_guard lock(mutex);
        idle.push_back(std::move(state));
    }

    PlannedBody<T> planned;
    const Body<T>* body;
    std::mutex mutex;
    std::vector<State<T>> idle;
};

template <class T>
ForcePlan<T>::ForcePlan(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(plan_body<T>(lattice, material, options, Operation::forces))) {}
template <class T>
ForcePlan<T>::ForcePlan(const Network& network, const PlanOptions& options)
    : implementation_(std::make_unique<Implementation>(plan_body<T>(network, options, Operation::forces))) {}
template <class T>
ForcePlan<T>::ForcePlan(ForcePlan&&) noexcept = default;
template <class T>
ForcePlan<T>& ForcePlan<T>::operator=(ForcePlan&&) noexcept = default;
template <class T>
ForcePlan<T>::~ForcePlan() = default;

template <class T>
std::size_t ForcePlan<T>::node_count() const {
    return implementation_->body->node_count();
}

template <class T>
void ForcePlan<T>::add_forces(VectorField<const T> displacement, VectorField<T> force) const {
    const Body<T>& body = *implementation_->body;
    State<T> state = implementation_->take();
    body.write(displacement, 1 / body.length_unit(), state.displacement);
    body.compute_forces(state);
    body.add(state.force, force);
    implementation_->give_back(std::move(state));
}

template <class T>
PotentialEnergy ForcePlan<T>::energy(VectorField<const T> displacement) const {
    const Body<T>& body = *implementation_->body;
    State<T> state = implementation_->take();
    body.write(displacement, 1 / body.length_unit(), state.displacement);
    const PotentialEnergy energy = body.energy(state);
    implementation_->give_back(std::move(state));
    return energy;
}

template <class T>
void ForcePlan<T>::add_hessian_product(VectorField<const T> displacement, VectorField<const T> direction,
                                       VectorField<T> product) const {
    const Body<T>& body = *implementation_->body;
    State<T> state = implementation_->take();
    body.write(displacement, 1 / body.length_unit(), state.displacement);
    body.allocate_like(state.displacement, state.direction);
    body.write(direction, 1 / body.length_unit(), state.direction);
    body.hessian_product(state, state.direction, state.force);
    body.add(state.force, product);
    implementation_->give_back(std::move(state));
}

template <class T>
void ForcePlan<T>::hessian_diagonal(VectorField<const T> displacement, std::span<T> blocks) const {
    const Body<T>& body = *implementation_->body;
    State<T> state = implementation_->take();
    body.write(displacement, 1 / body.length_unit(), state.displacement);
    AlignedArray<T> sums[6];
    body.hessian_diagonal(state, sums);
    body.read_blocks(sums, 1 / body.length_unit(), blocks);
    implementation_->give_back(std::move(state));
}

template <class T>
double ForcePlan<T>::critical_time_step() const {
    return implementation_->body->critical_time_step();
}

/// With q = M^(1/2) p the eigenvalues of M^-1 K are those of the symmetric M^(-1/2) K M^(-1/2).
template <class T>
double ForcePlan<T>::estimate_critical_time_step(VectorField<const T> displacement) const {
    const std::span<const double> mass = implementation_->body->masses();
    const std::size_t size = 3 * mass.size();
    std::vector<T> direction(size), product(size);
    const auto multiply = [&](std::span<const double> in, std::span<double> out) {
        for (std::size_t i = 0; i < size; ++i) {
            direction[i] = static_cast<T>(in[i] / std::sqrt(mass[i / 3]));
            product[i] = 0;
        }
        add_hessian_product(displacement, VectorField<const T>::aos(direction.data(), mass.size()),
                            VectorField<T>::aos(product.data(), mass.size()));
        for (std::size_t i = 0; i < size; ++i) {
            out[i] = static_cast<double>(product[i]) / std::sqrt(mass[i / 3]);
        }
    };
    return 2 / std::sqrt(largest_eigenvalue(size, multiply));
}

template <class T>
PlanDescription ForcePlan<T>::describe() const {
    PlanDescription description = implementation_->planned.describe();
    const std::lock_guard lock(implementation_->mutex);
    for (const State<T>& state : implementation_->idle) {
        description.bytes += state.bytes();
    }
    return description;
}

template class ForcePlan<float>;
template class ForcePlan<double>;

} // namespace hybmss
