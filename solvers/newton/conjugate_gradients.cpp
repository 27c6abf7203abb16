#include "solvers/newton/conjugate_gradients.hpp"

#include <cmath>
#include <limits>

namespace hybmss {

template <class T>
ConjugateGradients<T>::ConjugateGradients(const VectorSpace<T>& space)
    : space_(&space), residual_(space.make()), preconditioned_(space.make()), direction_(space.make()),
      product_(space.make()) {}

template <class T>
CgResult ConjugateGradients<T>::solve(const Potential<T>& potential, Preconditioner<T>& preconditioner,
                                      const NodeVector<T>& gradient, const CgLimits& limits, NodeVector<T>& step) {
    const double radius = limits.radius > 0 ? limits.radius : std::numeric_limits<double>::infinity();
    space_->clear(step);
    space_->for_each([](const T& g, T& r) { r = -g; }, gradient, residual_);
    preconditioner.apply(residual_, preconditioned_);
    space_->copy(preconditioned_, direction_);

    CgResult result;
    double rho = space_->dot(residual_, preconditioned_);
    const double goal = limits.relative_residual * limits.relative_residual * rho;
    const double force_goal = limits.relative_force > 0
                                  ? limits.relative_force * limits.relative_force * space_->dot(residual_, residual_)
                                  : 0;
    // p . M p, p . M d and d . M d with M = B^-1, by their recurrences.
    double pp = 0, pd = 0, dd = rho;
    const auto advance = [&](double by) {
        space_->add_multiple(by, direction_, step);
        pp += 2 * by * pd + by * by * dd;
    };
    if (!(rho > 0)) {
        result.end = CgEnd::stagnated;
        return result;
    }
    for (;;) {
        potential.multiply(direction_, product_, limits.curvature);
        ++result.iterations;
        if (limits.progress && !limits.progress(result.iterations)) {
            result.end = CgEnd::stopped;
            break;
        }
        const double curvature = space_->dot(direction_, product_);
        // Along a rigid motion there is no curvature but for rounding.
        const bool downwards = !(curvature > 4 * std::numeric_limits<T>::epsilon() * dd);
        const double alpha = rho / curvature;
        const double next_pp = pp + 2 * alpha * pd + alpha * alpha * dd;
        if (downwards || next_pp >= radius * radius) {
            result.negative_curvature = downwards;
            result.end = downwards ? CgEnd::negative_curvature : CgEnd::boundary;
            double t = limits.length / space_->largest_component(direction_);
            if (std::isfinite(radius)) {
                // |p + t d| = radius
                const double root = std::sqrt(std::max(pd * pd + dd * (radius * radius - pp), 0.0));
                t = pd > 0 ? (radius * radius - pp) / (pd + root) : (root - pd) / dd;
            }
            result.predicted_reduction += t * rho - 0.5 * t * t * curvature;
            advance(t);
            break;
        }
        advance(alpha);
        result.predicted_reduction += 0.5 * alpha * rho;
        space_->add_multiple(-alpha, product_, residual_);
        if (limits.relative_force > 0 && space_->dot(residual_, residual_) <= force_goal) {
            result.end = CgEnd::converged;
            break;
        }
        preconditioner.apply(residual_, preconditioned_);
        const double next_rho = space_->dot(residual_, preconditioned_);
        if (!(next_rho > goal)) {
            result.end = CgEnd::converged;
            break;
        }
        if (result.iterations >= limits.iterations) {
            result.end = CgEnd::iterations;
            break;
        }
        const double beta = next_rho / rho;
        rho = next_rho;
        const T b = static_cast<T>(beta);
        space_->for_each([b](const T& z, T& d) { d = z + b * d; }, preconditioned_, direction_);
        pd = beta * (pd + alpha * dd);
        dd = rho + beta * beta * dd;
    }
    result.step_norm = std::sqrt(std::max(pp, 0.0));
    return result;
}

template class ConjugateGradients<float>;
template class ConjugateGradients<double>;

} // namespace hybmss
