#include "solvers/newton/trust_region.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// An unloaded body is at rest when this part of the first unbalanced force, times the tolerance, is left.
constexpr double kStartPart = 1e-3;
/// How far along a negative curvature a component goes at first, by the length of a spring: far enough to leave a
/// saddle, not so far as to turn cells inside out.
constexpr double kFirstStep = 0.1;
/// How far a step turns a section at most, and from where on its rotations are carried out as such; rad.
constexpr double kMostTurn = 0.7, kLeastTurn = 1e-4;
/// Residuals above which a step is by the convex part of the second derivatives alone: what else they have is of
/// tensions and pressures that the step is to take away. In volumes that are all but kept these are a hundred times too
/// large where a coarser mesh's equilibrium has been interpolated, and the energy curves downwards everywhere.
constexpr double kFar = 0.3;
/// How many times a start's residual, or 1, forces have grown to, while the energy fell, of a body that runs away.
constexpr double kLost = 1e3;
constexpr double kAccept = 1e-4, kPoor = 0.25, kGood = 0.75;

template <class T>
void move(const VectorSpace<T>& space, const NodeVector<T>& step, State<T>& state) {
    MutableFieldView<T> u{state.displacement};
    space.for_each([](const T& p, T& q) { q += p; }, step, u);
}

/// How many iterations a digit of the residual took: tells whether a preconditioner that is not fresh still serves.
double iterations_a_digit(const CgResult& cg, double forcing) {
    return cg.iterations / std::max(-std::log10(forcing), 0.3);
}

/// Takes the part of a step, along which the gradient has the slope.
void shorten(double part, double slope, CgResult& cg) {
    const double half_curvature = -slope - cg.predicted_reduction;
    cg.predicted_reduction = part * (-slope - part * half_curvature);
    cg.step_norm *= part;
    cg.end = CgEnd::boundary;
}

} // namespace

template <class T>
TrustRegion<T>::TrustRegion(const VectorSpace<T>& space)
    : space_(&space), cg_(space), gradient_(space.make()), trial_gradient_(space.make()), step_(space.make()),
      before_(space.make()) {}

template <class T>
long TrustRegion<T>::predict(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                             const std::function<bool(int cg_iterations)>& progress) {
    // K_ff p_f = -(g_f + K_fh p_h)
    potential.gradient(state, gradient_);
    potential.linearise(state);
    preconditioner.update(potential);
    potential.prescribed_step(state, before_);
    potential.multiply(before_, trial_gradient_);
    space_->add_multiple(1, trial_gradient_, gradient_);
    const CgLimits limits{
        .relative_residual = 1e-3, .radius = 0, .iterations = 2000, .length = 0, .progress = progress};
    const CgResult cg = cg_.solve(potential, preconditioner, gradient_, limits, step_);
    if (cg.end == CgEnd::stopped) {
        potential.impose(state);
        return cg.iterations;
    }
    const FieldView<T> u{state.displacement};
    MutableFieldView<T> mutable_u{state.displacement};
    Turning<T>* const turning = potential.turning();
    if (turning) {
        space_->add_multiple(1, before_, step_);
        turning->fit(state, step_);
        space_->copy(u, trial_gradient_);
    }
    potential.impose(state);
    const double energy = potential.value(state).total;
    const double worst_cell = potential.volume_ratios(state).min;
    space_->copy(u, before_);
    if (turning) {
        space_->copy(trial_gradient_, mutable_u);
        turning->move(step_, 1, state);
        potential.impose(state);
    } else {
        move(*space_, step_, state);
    }
    // Far from where it was drawn, a tangent may lead astray. More energy is no proof of that where the supports alone
    // have crushed cells or turned them inside out: such cells may have no energy at all.
    const bool better = potential.value(state).total <= energy || potential.volume_ratios(state).min > worst_cell;
    if (!better) {
        space_->copy(before_, mutable_u);
    }
    return cg.iterations;
}

template <class T>
void TrustRegion<T>::keep_momentum(Potential<T>& potential, State<T>& state, double tolerance,
                                   MinimiserResult& result) {
    const FieldView<T> u{state.displacement};
    MutableFieldView<T> mutable_u{state.displacement};
    if (potential.held_axes() == 7) {
        return;
    }
    const double before = potential.gradient(state, gradient_).unbalanced;
    space_->copy(u, before_);
    potential.balance_as_a_whole(gradient_, state);
    const double after = potential.gradient(state, gradient_).unbalanced;
    const double residual = before > 0 ? result.residual * after / before : result.residual;
    if (residual <= tolerance) {
        result.residual = residual;
    } else {
        space_->copy(before_, mutable_u);
    }
}

template <class T>
double TrustRegion<T>::residual(Potential<T>& potential, State<T>& state) {
    const Balance balance = potential.gradient(state, gradient_);
    return balance.unbalanced / std::max({balance.support, balance.load, potential.force_floor()});
}

template <class T>
bool TrustRegion<T>::leave_saddle(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                                  long& cg_iterations) {
    potential.linearise(state);
    preconditioner.update(potential);
    // So small that what conjugate gradients gather before they meet the curvature does not count.
    const double size = 1e-6 * potential.force_floor();
    unsigned draw = 1;
    for (auto& array : gradient_.field) {
        for (std::size_t n = 0; n < array.size(); ++n) {
            draw = draw * 1664525u + 1013904223u;
            array[n] = static_cast<T>(size * (static_cast<double>(draw >> 8) / 8388608.0 - 1));
        }
    }
    space_->for_each([](const T& free, T& g) { g *= free; }, potential.free(), gradient_);
    const CgLimits limits{.relative_residual = 1e-3, .iterations = 2000, .length = kFirstStep * potential.length()};
    const CgResult cg = cg_.solve(potential, preconditioner, gradient_, limits, step_);
    cg_iterations += cg.iterations;
    if (cg.negative_curvature) {
        move(*space_, step_, state);
    }
    return cg.negative_curvature;
}

template <class T>
MinimiserResult TrustRegion<T>::minimise(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                                         const MinimiserOptions& options) {
    constexpr double kEpsilon = std::numeric_limits<T>::epsilon();
    const double unit = potential.body().length_unit();
    MinimiserResult result;
    const FieldView<T> u{state.displacement};
    MutableFieldView<T> mutable_u{state.displacement};

    Balance balance = potential.gradient(state, gradient_);
    typename Potential<T>::Value value = potential.value(state);
    const double start_part = kStartPart * balance.unbalanced;
    const double start_size = space_->largest([](const T& x) { return x < 0 ? -x : x; }, u);
    const auto residual_of = [&](const Balance& b) {
        const double scale = std::max({b.support, b.load, start_part, potential.force_floor()});
        return b.unbalanced / scale;
    };
    const double lost = kLost * std::max(residual_of(balance), 1.0), start_energy = value.total;
    const auto without_descent = [&] {
        return result.residual > lost && value.total < start_energy ? EquilibriumStatus::unbounded
                                                                    : EquilibriumStatus::no_descent;
    };
    double radius = kInfinite, fresh_rate = 0; // in the preconditioner's norm
    bool renew = !options.preconditioner_is_made;
    bool expecting = false; // touches that the step before would have made, and what their springs store at first
    double stored = 0;
    // Bodies whose sections turn are far for another reason: longer or less exact steps twist them beyond what cells
    // hold. And a step of time is held near its start by masses: what curves downwards there is on the way.
    const bool straight = potential.turning() == nullptr;
    bool convex = straight && potential.pull_stiffness().empty();
    std::function<bool(int)> cg_progress;
    if (options.progress) {
        cg_progress = [&](int more) {
            return options.progress(result.iterations, result.cg_iterations + more, result.residual, result.potential);
        };
    }
    double forcing = 0.1;
    int stalls = 0;
    for (;; ++result.iterations) {
        result.residual = residual_of(balance);
        result.potential = value.total * unit;
        if (!std::isfinite(result.residual) || !std::isfinite(value.total)) {
            result.status = EquilibriumStatus::not_finite;
            return result;
        }
        if (options.progress &&
            !options.progress(result.iterations, result.cg_iterations, result.residual, result.potential)) {
            result.status = EquilibriumStatus::stopped;
            return result;
        }
        if (result.residual <= options.tolerance) {
            return result;
        }
        if (result.iterations >= options.iterations) {
            result.status = EquilibriumStatus::iterations_exhausted;
            return result;
        }

        if (!expecting) {
            potential.linearise(state);
        }
        const NodeVector<T>& slope = expecting ? trial_gradient_ : gradient_; // of the model
        const bool fresh = renew;
        if (renew) {
            preconditioner.update(potential);
        }
        // Not further than the tolerance asks.
        const double enough = 0.3 * options.tolerance / result.residual;
        const double relative = std::max(forcing, std::min(enough, 0.1));
        CgLimits limits{.relative_residual = relative,
                        .relative_force = straight ? relative : 0,
                        .radius = radius,
                        .iterations = 5000,
                        .curvature = convex && result.residual > kFar ? Curvature::convex : Curvature::whole,
                        .length = kFirstStep * potential.length(),
                        .progress = cg_progress};
        CgResult cg = cg_.solve(potential, preconditioner, slope, limits, step_);
        result.cg_iterations += cg.iterations;
        if (limits.curvature == Curvature::convex && cg.negative_curvature) {
            convex = false; // below nu = 1/4 the volume's energy is not
            limits.curvature = Curvature::whole;
            cg = cg_.solve(potential, preconditioner, slope, limits, step_);
            result.cg_iterations += cg.iterations;
        }
        if (cg.end == CgEnd::stopped) {
            result.status = EquilibriumStatus::stopped;
            return result;
        }
        result.negative_curvatures += cg.negative_curvature;
        if (cg.end == CgEnd::stagnated && !fresh) {
            // Not positive any more: the matrix has moved too far away.
            renew = true;
            continue;
        }
        const double rate = iterations_a_digit(cg, limits.relative_residual);
        if (renew || fresh_rate == 0) {
            fresh_rate = rate;
        }
        renew = cg.negative_curvature || rate > 1.5 * fresh_rate;
        double turn = 0;
        if (Turning<T>* const turning = potential.turning()) {
            turn = turning->fit(state, step_);
            if (turn > kMostTurn) {
                shorten(kMostTurn / turn, space_->dot(slope, step_), cg);
                space_->for_each([by = static_cast<T>(kMostTurn / turn)](T& p) { p *= by; }, step_);
                turn = turning->fit(state, step_);
            }
        }
        cg.predicted_reduction -= expecting ? stored : 0;
        const double longest = space_->largest_component(step_);
        const double size = space_->largest([](const T& x) { return x < 0 ? -x : x; }, u);
        if (!(longest > 0.25 * kEpsilon * size) &&
            !(longest > 0.25 * kEpsilon * potential.length() * result.residual)) {
            result.status = std::isfinite(longest) ? without_descent() : EquilibriumStatus::not_finite;
            return result;
        }
        space_->copy(u, before_);
        if (turn > kLeastTurn) {
            potential.turning()->move(step_, 1, state);
        } else {
            move(*space_, step_, state);
        }
        const Balance trial_balance = potential.gradient(state, trial_gradient_);
        const typename Potential<T>::Value trial = potential.value(state);

        const double noise = 16 * kEpsilon * std::max(value.size, trial.size);
        double actual = value.total - trial.total;
        const bool drowned = std::abs(actual) < noise || cg.predicted_reduction < noise;
        if (drowned) {
            // The work of the mean force along the step: exact up to the third order.
            actual = -0.5 * (space_->dot(gradient_, step_) + space_->dot(trial_gradient_, step_));
        }
        const double ratio = actual / cg.predicted_reduction;
        const bool accepted = ratio > kAccept || (drowned && trial_balance.unbalanced < balance.unbalanced);
        if (drowned && !(trial_balance.unbalanced < 0.7 * balance.unbalanced)) {
            ++stalls;
        } else {
            stalls = 0;
        }
        // What a step presses on that does not touch yet, the model is told of once, before steps become shorter.
        const std::vector<ComingTouch> touches =
            accepted || expecting ? std::vector<ComingTouch>() : potential.touches(state);
        if (!accepted) {
            space_->copy(before_, mutable_u);
            space_->copy(gradient_, trial_gradient_);
            stored = potential.expect(touches, trial_gradient_);
        }
        expecting = !accepted && stored >= 0;
        if (expecting) {
            renew = true;
        } else if (!(ratio >= kPoor) && !(drowned && accepted)) {
            radius = cg.step_norm * std::min(0.25, potential.extent() / longest);
        } else if (ratio > kGood && cg.end != CgEnd::converged) {
            radius = 2 * std::max(std::isfinite(radius) ? radius : 0.0, cg.step_norm);
        } else if (cg.negative_curvature && !std::isfinite(radius)) {
            radius = cg.step_norm;
        }
        if (!accepted) {
            if (stalls >= 4) {
                result.status = without_descent();
                return result;
            }
            continue;
        }
        // Eisenstat and Walker's second choice (SIAM J. Sci. Comput. 17, 1996), from largest forces.
        const double fall = trial_balance.unbalanced / balance.unbalanced;
        const double safeguard = 0.9 * forcing * forcing;
        forcing = std::min(0.1, std::max(0.9 * fall * fall, safeguard > 0.1 ? safeguard : 0.0));
        forcing = std::max(forcing, 1e-6);
        balance = trial_balance;
        value = trial;
        std::swap(gradient_, trial_gradient_);
        if (stalls >= 4) {
            result.residual = residual_of(balance);
            result.potential = value.total * unit;
            result.status =
                result.residual <= options.tolerance ? EquilibriumStatus::converged : EquilibriumStatus::no_descent;
            return result;
        }
        if (space_->largest([](const T& x) { return x < 0 ? -x : x; }, u) > start_size + 100 * potential.extent()) {
            result.residual = residual_of(balance);
            result.potential = value.total * unit;
            result.status = EquilibriumStatus::unbounded;
            return result;
        }
    }
}

template class TrustRegion<float>;
template class TrustRegion<double>;

} // namespace hybmss
