#include "dynamics/effects/spring_damping.hpp"

#include "dynamics/explicit_dynamics_implementation.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace hybmss {

template <class T>
std::size_t SpringDamping<T>::bytes() const {
    return product_[0].bytes() + product_[1].bytes() + product_[2].bytes();
}

template <class T>
void SpringDamping<T>::add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const {
    NodeField<T> scratch;
    add_damping_forces(body, state, state.velocity, seconds_, scratch, force);
}

template <class T>
void SpringDamping<T>::add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                                  std::vector<Stage>& stages) {
    Body<T>::allocate_like(state.displacement, product_);
    append(body.spring_stages(state, {kernels::SpringLaw::damping}, &state.velocity, product_), stages);
    const double factor = seconds_ * factors.kick;
    if (!prescribed_.empty()) {
        // What a kick takes out is its impulse p times the mean of the velocities before and after it, v - p/(2m). A
        // prescribed component keeps its velocity, so there it is p v.
        stages.push_back({1, [this, factor, unit = body.length_unit(),
                              inverse_mass = body.inverse_masses().data()](std::size_t, std::size_t) {
                              double sum = 0;
                              for (const PrescribedComponent<T>& p : prescribed_) {
                                  const Component<T> product = component(product_, static_cast<std::size_t>(p.axis));
                                  const auto at = static_cast<std::ptrdiff_t>(p.index) * product.stride;
                                  const double impulse = factor * static_cast<double>(product.first[at]);
                                  sum += impulse * impulse * static_cast<double>(inverse_mass[at]);
                              }
                              dissipated_ += unit * sum / 2;
                          }});
    }
    body.add_kick_stages(state.velocity, product_, factor, &dissipated_, stages);
}

template <class T>
void add_damping_forces(const Body<T>& body, State<T>& state, const NodeField<T>& velocity, double seconds,
                        NodeField<T>& product, NodeField<T>& force) {
    Body<T>::allocate_like(state.displacement, product);
    body.workers().run(body.spring_stages(state, {kernels::SpringLaw::damping}, &velocity, product), 1);
    const T factor = static_cast<T>(seconds);
    for (std::size_t c = 0; c < 3; ++c) {
        T* const from = product[c].data();
        T* const to = force[c].data();
        for (std::size_t n = 0; n < product[c].size(); ++n) {
            to[n] -= factor * from[n];
            from[n] = 0;
        }
    }
}

template <class T>
void ExplicitDynamics<T>::damp_springs(double stiffness_damping) {
    if (!(stiffness_damping >= 0) || !std::isfinite(stiffness_damping)) {
        throw std::invalid_argument("stiffness_damping = " + std::to_string(stiffness_damping) +
                                    " is not allowed: it must be finite and at least 0 s");
    }
    implementation_->template replace<SpringDamping<T>>(
        stiffness_damping > 0 ? std::make_unique<SpringDamping<T>>(stiffness_damping) : nullptr);
}

template class SpringDamping<float>;
template class SpringDamping<double>;
template void ExplicitDynamics<float>::damp_springs(double);
template void ExplicitDynamics<double>::damp_springs(double);
template void add_damping_forces(const Body<float>&, State<float>&, const NodeField<float>&, double, NodeField<float>&,
                                 NodeField<float>&);
template void add_damping_forces(const Body<double>&, State<double>&, const NodeField<double>&, double,
                                 NodeField<double>&, NodeField<double>&);

} // namespace hybmss
