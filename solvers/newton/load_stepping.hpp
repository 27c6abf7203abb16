#pragma once

#include "solvers/newton/trust_region.hpp"

namespace hybmss {

/// Follows the equilibrium of a body while its supports and loads go from the fraction 0 to 1.
///
/// The whole way is tried first (or what the options say). A step that finds no equilibrium, or one with cells turned
/// inside out that were not so before, is tried again at a quarter; after a step that does, the next one is twice as
/// long, up to what the options allow. Steps start from the first-order change of the last equilibrium, or the
/// extrapolation of the last two.
template <class T>
class LoadStepping {
public:
    explicit LoadStepping(const VectorSpace<T>& space);

    /// For what is no load step: its vectors are a good part of a solver's memory.
    TrustRegion<T>& minimiser() { return minimiser_; }

    /// prescribe(fraction) sets the supports and loads of the potential.
    /// `near_end`: the state is near the equilibrium at the end already.
    EquilibriumResult follow(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                             const std::function<void(double fraction)>& prescribe, const EquilibriumOptions& options,
                             bool near_end = false);

private:
    /// What to do about saddles. Solves with a slender lattice's factors end so soon that no direction but theirs is
    /// looked at: where one curved downwards on the way, there may be another at the end.
    enum class Saddles { stay, suspected, left };
    /// Goes to a minimum from the state, and from saddles on to others. Adds to the work done.
    MinimiserResult settle(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                           const MinimiserOptions& limits, Saddles saddles, EquilibriumResult& work);

    /// Brings a body that nothing but obstacles holds near its balance, from where its supports are: second derivatives
    /// do not hold what does not touch yet. By steps of backward Euler without inertia, each ten times as long as the
    /// one before. Adds to the work done. Returns whether it did not move away without end.
    bool approach(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                  const MinimiserOptions& limits, EquilibriumResult& work);

    const VectorSpace<T>* space_;
    TrustRegion<T> minimiser_;
    NodeVector<T> last_, before_last_, first_attempt_;
};

extern template class LoadStepping<float>;
extern template class LoadStepping<double>;

} // namespace hybmss
