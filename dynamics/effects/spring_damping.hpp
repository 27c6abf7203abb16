#pragma once

#include "dynamics/step.hpp"

namespace hybmss {

/// Kelvin-Voigt damping: a dashpot c = beta k beside every spring,
///
///     f_a = c (n . (v_b - v_a)) n,  n = d/|d|,
///
/// along the spring alone, so that a rigid motion is not damped and linear and angular momentum are kept. The force is
/// taken at the velocity before the step: with leapfrog half a step before the force acts.
template <class T>
class SpringDamping final : public StepEffect<T> {
public:
    /// `seconds`: beta, finite and >= 0.
    explicit SpringDamping(double seconds) : seconds_(seconds) {}

    std::string_view name() const override { return "stiffness damping"; }
    std::size_t bytes() const override;
    void narrow(StepBounds& bounds) const override { bounds.stiffness_damping += seconds_; }
    double energy(const Body<T>&, State<T>&) const override { return 0; }
    double dissipated(const Body<T>&, State<T>&) const override { return dissipated_; }
    void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const override;
    void set_prescribed(std::span<const PrescribedComponent<T>> prescribed) override { prescribed_ = prescribed; }
    void add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                    std::vector<Stage>& stages) override;
    std::vector<double> memory() const override { return {dissipated_}; }
    std::size_t memory_size() const override { return 1; }
    void set_memory(std::span<const double> memory) override { dissipated_ = memory[0]; }

private:
    double seconds_, dissipated_ = 0;
    std::span<const PrescribedComponent<T>> prescribed_;
    NodeField<T> product_;
};

/// force -= beta C v: adds the dashpots' forces (N) at a state, for any `velocity` in the body's unit of length by s.
/// `product` is scratch, zero before and after.
template <class T>
void add_damping_forces(const Body<T>& body, State<T>& state, const NodeField<T>& velocity, double seconds,
                        NodeField<T>& product, NodeField<T>& force);

extern template class SpringDamping<float>;
extern template class SpringDamping<double>;

} // namespace hybmss
