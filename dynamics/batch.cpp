#include "hybmss/batch.hpp"

#include "dynamics/shared_out.hpp"
#include "plan/bodies/step_factors.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {
namespace {

template <class T>
void check(std::span<ExplicitDynamics<T>* const> bodies) {
    std::vector<std::pair<ExplicitDynamics<T>*, std::size_t>> named;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (!bodies[i]) {
            throw std::invalid_argument("bodies[" + std::to_string(i) + "] is null: it must point to a body");
        }
        named.emplace_back(bodies[i], i);
    }
    std::sort(named.begin(), named.end());
    const auto twice =
        std::adjacent_find(named.begin(), named.end(), [](const auto& a, const auto& b) { return a.first == b.first; });
    if (twice != named.end()) {
        throw std::invalid_argument("bodies[" + std::to_string((twice + 1)->second) + "] is bodies[" +
                                    std::to_string(twice->second) + "] too: each must be named once");
    }
}

template <class T>
void check(const StepParameters& parameters) {
    // For what it throws.
    static_cast<void>(step_constants<T>(step_factors(parameters), 1));
}

} // namespace

template <class T>
struct Batch<T>::Implementation : SharedOut {
    using SharedOut::SharedOut;
};

template <class T>
Batch<T>::Batch(int threads) : implementation_(std::make_unique<Implementation>(threads)) {}
template <class T>
Batch<T>::Batch(Batch&&) noexcept = default;
template <class T>
Batch<T>& Batch<T>::operator=(Batch&&) noexcept = default;
template <class T>
Batch<T>::~Batch() = default;

template <class T>
int Batch<T>::threads() const {
    return implementation_->workers().threads();
}

template <class T>
void Batch<T>::step(std::span<ExplicitDynamics<T>> bodies, const StepParameters& parameters, long count) {
    check<T>(parameters);
    implementation_->run(bodies.size(), [&](std::size_t i) { bodies[i].step(parameters, count); });
}

template <class T>
void Batch<T>::step(std::span<ExplicitDynamics<T>* const> bodies, std::span<const StepParameters> parameters,
                    long count) {
    if (parameters.size() != bodies.size()) {
        throw std::invalid_argument("parameters of " + std::to_string(parameters.size()) + " bodies given for " +
                                    std::to_string(bodies.size()) + ": there must be as many of them");
    }
    check<T>(bodies);
    for (const StepParameters& p : parameters) {
        check<T>(p);
    }
    implementation_->run(bodies.size(), [&](std::size_t i) { bodies[i]->step(parameters[i], count); });
}

template class Batch<float>;
template class Batch<double>;

} // namespace hybmss
