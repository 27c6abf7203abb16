#pragma once

#include "solvers/newton/preconditioner.hpp"

#include <functional>

namespace hybmss {

/// Why a run of conjugate gradients ended.
enum class CgEnd {
    converged,
    boundary,
    negative_curvature,
    iterations,
    stopped,  ///< by the caller
    stagnated ///< at the start already: the gradient is zero, or r . B r is not positive
};

struct CgLimits {
    double relative_residual = 1e-8; ///< of the preconditioned residual's norm sqrt(r . B r)
    double relative_force = 0;       ///< the same of sqrt(r . r), whichever is met first: asks for no cycle; 0: none
    double radius = 0;               ///< bound of the step's norm sqrt(p . B^-1 p); 0 or infinite: none
    int iterations = 1000;
    Curvature curvature = Curvature::whole; ///< of K
    /// How far a component may go along a negative or vanishing curvature where the radius sets no bound.
    double length = 0;
    /// Called at every iteration with their number; false stops. May be empty.
    std::function<bool(int iterations)> progress = {};
};

struct CgResult {
    CgEnd end = CgEnd::converged;
    int iterations = 0;
    double step_norm = 0;            ///< sqrt(p . B^-1 p)
    double predicted_reduction = 0;  ///< g . p + 1/2 p . K p with the sign changed; above 0
    bool negative_curvature = false; ///< or none that stands clear of rounding
};

/// Preconditioned conjugate gradients for the step p that minimises g . p + 1/2 p . K p within a ball (Steihaug, SIAM
/// J. Numer. Anal. 20, 1983): where K curves downwards, the step goes on to the ball's boundary, or without a ball by a
/// given length.
template <class T>
class ConjugateGradients {
public:
    explicit ConjugateGradients(const VectorSpace<T>& space);

    CgResult solve(const Potential<T>& potential, Preconditioner<T>& preconditioner, const NodeVector<T>& gradient,
                   const CgLimits& limits, NodeVector<T>& step);

private:
    const VectorSpace<T>* space_;
    NodeVector<T> residual_, preconditioned_, direction_, product_;
};

extern template class ConjugateGradients<float>;
extern template class ConjugateGradients<double>;

} // namespace hybmss
