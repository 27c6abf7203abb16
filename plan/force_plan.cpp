#include "hybmss/force_plan.hpp"

#include "plan/bodies/critical_time_step.hpp"
#include "plan/tuning/planned_body.hpp"

#include <cmath>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace hybmss {

/// The body, and the scratch that is not in use: each execution borrows one, so that a plan may run many times at once.
template <class T>
struct ForcePlan<T>::Implementation {
    /// What an execution works with. Its stages are made once, of the three that forces take: write the caller's
    /// displacements into the state, sweep, add to the caller's forces; where both lie is set anew for each call.
    struct Scratch {
        explicit Scratch(const Body<T>& body) : state(body.make_state(false)) {}
        Scratch(const Scratch&) = delete;
        Scratch& operator=(const Scratch&) = delete;

        State<T> state;
        VectorField<const T> displacement;
        VectorField<T> force;
        std::vector<Stage> force_stages; ///< empty until forces are asked for
    };

    /// One scratch for as long as the object lives.
    class Borrowed {
    public:
        explicit Borrowed(Implementation& plan) : plan_(plan), scratch_(plan.take()) {}
        /// With the state at these displacements.
        Borrowed(Implementation& plan, VectorField<const T> displacement) : Borrowed(plan) {
            plan.body->write(displacement, 1 / plan.body->length_unit(), scratch_->state.displacement);
        }
        Borrowed(const Borrowed&) = delete;
        Borrowed& operator=(const Borrowed&) = delete;
        ~Borrowed() { plan_.give_back(std::move(scratch_)); }
        Scratch& operator*() const { return *scratch_; }
        Scratch* operator->() const { return scratch_.get(); }

    private:
        Implementation& plan_;
        std::unique_ptr<Scratch> scratch_;
    };

    explicit Implementation(PlannedBody<T> made) : planned(std::move(made)), body(planned.body.get()) {
        idle.push_back(std::make_unique<Scratch>(*body));
    }

    std::unique_ptr<Scratch> take() {
        {
            const std::lock_guard lock(mutex);
            if (!idle.empty()) {
                std::unique_ptr<Scratch> scratch = std::move(idle.back());
                idle.pop_back();
                return scratch;
            }
            idle.reserve(++scratches); // so that to give it back takes no memory
        }
        return std::make_unique<Scratch>(*body);
    }
    void give_back(std::unique_ptr<Scratch> scratch) noexcept {
        const std::lock_guard lock(mutex);
        idle.push_back(std::move(scratch));
    }

    PlannedBody<T> planned;
    const Body<T>* body;
    std::mutex mutex;
    std::size_t scratches = 1; ///< made so far
    std::vector<std::unique_ptr<Scratch>> idle;
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
    body.check(force, {displacement});
    const typename Implementation::Borrowed scratch(*implementation_);
    scratch->displacement = displacement;
    scratch->force = force;
    if (scratch->force_stages.empty()) {
        State<T>& state = scratch->state;
        std::vector<Stage> stages;
        stages.push_back(body.write_stage(scratch->displacement, 1 / body.length_unit(), state.displacement));
        append(body.force_stages(state), stages);
        stages.push_back(body.add_stage(state.force, scratch->force));
        scratch->force_stages = std::move(stages);
    }
    body.workers().run(scratch->force_stages, 1);
}

template <class T>
PotentialEnergy ForcePlan<T>::energy(VectorField<const T> displacement) const {
    const typename Implementation::Borrowed scratch(*implementation_, displacement);
    return implementation_->body->energy(scratch->state);
}

template <class T>
void ForcePlan<T>::add_hessian_product(VectorField<const T> displacement, VectorField<const T> direction,
                                       VectorField<T> product) const {
    const Body<T>& body = *implementation_->body;
    body.check(product, {displacement, direction});
    const typename Implementation::Borrowed scratch(*implementation_, displacement);
    State<T>& state = scratch->state;
    body.allocate_like(state.displacement, state.direction);
    body.write(direction, 1 / body.length_unit(), state.direction);
    body.hessian_product(state, state.direction, state.force);
    const Stage add = body.add_stage(state.force, product);
    body.workers().run({&add, 1}, 1);
}

template <class T>
void ForcePlan<T>::hessian_diagonal(VectorField<const T> displacement, std::span<T> blocks) const {
    const Body<T>& body = *implementation_->body;
    const typename Implementation::Borrowed scratch(*implementation_, displacement);
    AlignedArray<T> sums[6];
    body.hessian_diagonal(scratch->state, sums);
    body.read_blocks(sums, 1 / body.length_unit(), blocks);
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
    for (const auto& scratch : implementation_->idle) {
        description.bytes += scratch->state.bytes();
    }
    return description;
}

template class ForcePlan<float>;
template class ForcePlan<double>;

} // namespace hybmss
