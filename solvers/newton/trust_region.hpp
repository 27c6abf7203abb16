#pragma once

#include "hybmss/equilibrium.hpp"
#include "solvers/newton/conjugate_gradients.hpp"

#include <functional>

namespace hybmss {

struct MinimiserOptions {
    double tolerance = 1e-8;
    int iterations = 200;
    /// The preconditioner was made near the start: it is not made anew before conjugate gradients get slow.
    bool preconditioner_is_made = false;
    /// Called with the residual and the potential (J) at every iteration, of conjugate gradients too; false stops.
    std::function<bool(int iteration, long cg_iterations, double residual, double potential)> progress;
};

struct MinimiserResult {
    EquilibriumStatus status = EquilibriumStatus::converged;
    double residual = 0;
    double potential = 0; ///< J
    int iterations = 0;
    long cg_iterations = 0;
    int negative_curvatures = 0;
};

/// Newton's method with conjugate gradients in a trust region, for a potential that may curve downwards.
///
/// A step is judged by the potential's difference where that stands clear of rounding, and by the mean of the forces
/// before and after otherwise. The solve ends where the largest unbalanced force is at most the tolerance by the
/// largest support force or load; where there are none of either, by a small part of what was unbalanced at first.
template <class T>
class TrustRegion {
public:
    explicit TrustRegion(const VectorSpace<T>& space);

    /// Moves the held components of `state` to where they are prescribed and the free ones along, to first order: one
    /// step of Newton's method in both. Returns the CG iterations. `progress` may be empty, or is told their number;
    /// where it says false, only the held components move.
    long predict(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                 const std::function<bool(int cg_iterations)>& progress = {});

    /// What a solve left of the total momentum's balance is set right, where nothing holds the body and that leaves the
    /// residual within the tolerance. Changes the state and what `result` says of it.
    void keep_momentum(Potential<T>& potential, State<T>& state, double tolerance, MinimiserResult& result);

    /// Of a state as it is, as minimise() would have it.
    double residual(Potential<T>& potential, State<T>& state);

    /// Where the potential curves downwards at an equilibrium, moves the free components a little way along and returns
    /// true. Adds to the CG iterations.
    bool leave_saddle(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state, long& cg_iterations);

    /// Moves the free components of `state` to a minimum; the held ones must be where they are prescribed. Leaves the
    /// best state found.
    MinimiserResult minimise(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                             const MinimiserOptions& options);

private:
    const VectorSpace<T>* space_;
    ConjugateGradients<T> cg_;
    NodeVector<T> gradient_, trial_gradient_, step_, before_;
};

extern template class TrustRegion<float>;
extern template class TrustRegion<double>;

} // namespace hybmss
