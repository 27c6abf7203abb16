#pragma once

#include "layouts/node_numbers.hpp"
#include "plan/bodies/body.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace hybmss {

/// A prescribed component of a node: where it lies and what it is set to, in the body's units.
template <class T>
struct PrescribedComponent {
    std::size_t index;
    std::uint32_t node;
    std::uint8_t axis;
    T displacement;
    T velocity;
};

/// A loaded component of a node: where it lies and what the load accelerates it by, in the body's units by s^2.
template <class T>
struct LoadedComponent {
    std::size_t index;
    int axis;
    T acceleration;
    bool operator==(const LoadedComponent&) const = default;
};

/// What bounds the largest stable step near rest; see FrequencyBounds.
struct StepBounds {
    FrequencyBounds frequencies;
    double stiffness_damping = 0; ///< s
};

/// A force f(u, v, t) beyond the body's own, gravity, mass damping and loads: one object for each effect that is called
/// for, nothing at all for those that are not.
///
/// One that is known before the step's sweep acts there, as a kick of the velocities: v += kick f/m (see StepFactors).
/// The sweep's own force depends on u alone, and the step is linear in the sum of the forces, so that this is the step
/// under that sum; of symplectic Euler
///
///     (v + dt f/m + dt (F/m + g)) / (1 + dt c)
///
/// One that depends on where the step ends acts when all else has: v += dv, u += dt dv, dv = late_force f/m.
template <class T>
class StepEffect {
public:
    virtual ~StepEffect() = default;

    virtual std::string_view name() const = 0;
    /// What it holds.
    virtual std::size_t bytes() const = 0;
    /// Makes the bounds on a step as narrow as the effect asks for.
    virtual void narrow(StepBounds&) const {}
    /// J stored in it at a state, 0 for an effect that only takes energy out.
    virtual double energy(const Body<T>& body, State<T>& state) const = 0;
    /// J taken out since it was made, up to a state. Negative where it put energy in.
    virtual double dissipated(const Body<T>& body, State<T>& state) const = 0;
    /// Adds its force at a state, N.
    virtual void add_forces(const Body<T>& body, State<T>& state, NodeField<T>& force) const = 0;
    /// Replaces the components that are set after each step, whatever the effect does to them. The span outlives the
    /// stages.
    virtual void set_prescribed(std::span<const PrescribedComponent<T>>) {}
    /// Replaces the loads. The span is not kept.
    virtual void set_loaded(std::span<const LoadedComponent<T>>) {}
    /// By how much other effects accelerate a node at most from now on, beyond what its springs do, m/s^2.
    virtual void set_pushed(double) {}
    /// Appends what one step needs; the stages are run again for every step of a call. The body, the state and the
    /// effect outlive them.
    virtual void add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                            std::vector<Stage>& stages) = 0;
    /// Likewise what comes last in a step: the loads have acted, and what is prescribed has been set back.
    virtual void add_last_stages(const Body<T>&, State<T>&, const StepFactors&, std::vector<Stage>&) {}
    /// A leapfrog step's velocities get the half kick that they lack, by the forces at this state: those that the
    /// effect itself has, too.
    virtual void complete(const State<T>&, const StepFactors&) {}
    /// The state has been set from outside.
    virtual void state_was_set() {}
    /// Cells have been removed from the lattice that the body was made from; these nodes have lost some. A body that
    /// cannot be cut never comes here.
    virtual void body_was_cut(const Body<T>&, const Lattice&, const NodeNumbers&, std::span<const CutNode>) {}

    /// All that later steps depend on besides the state: what a checkpoint keeps.
    virtual std::vector<double> memory() const { return {}; }
    /// How many numbers memory() gives.
    virtual std::size_t memory_size() const { return 0; }
    /// Takes over the memory of an effect made in the same way; memory_size() numbers.
    virtual void set_memory(std::span<const double>) {}
};

/// What a step does besides the body's own forces, gravity and damping. Not owned.
template <class T>
struct StepActions {
    std::span<const std::unique_ptr<StepEffect<T>>> effects;
    std::span<const PrescribedComponent<T>> prescribed; ///< each component once
    std::span<const LoadedComponent<T>> loaded;         ///< likewise
    /// Leads what is prescribed on to the end of the step at hand; empty: it stays. Must not throw.
    std::function<void()> lead = {};
};

/// One step after the other: the kicks of the effects, the step proper, the loads, the prescribed components, and what
/// comes last. What is led goes on after that, as if it were set between two steps.
template <class T>
void take_steps(const Body<T>& body, State<T>& state, const StepFactors& factors, const StepActions<T>& actions,
                long count);
/// `before`: the leapfrog step whose second half kick the velocities lack, if any; then these are such steps too.
template <class T>
void take_steps(const Body<T>& body, State<T>& state, const StepParameters& parameters,
                const std::optional<StepParameters>& before, const StepActions<T>& actions, long count);

template <class T>
void set_prescribed(State<T>& state, std::span<const PrescribedComponent<T>> prescribed);

} // namespace hybmss
