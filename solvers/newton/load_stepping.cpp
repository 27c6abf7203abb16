#include "solvers/newton/load_stepping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

namespace hybmss {
namespace {

constexpr double kCut = 0.25, kGrow = 2;
/// Newton iterations a step: more are a sign to take shorter ones, if that is possible.
constexpr int kPatience = 40;

/// Residuals from which on rounding alone does not tell why a solve ended.
constexpr double kNearBalance = 0.01;

/// The end of a load step.
struct Attempt {
    EquilibriumStatus status = EquilibriumStatus::converged;
    double fraction = 0, residual = 0;
    double potential = 0; ///< J
};

std::string failure(const Attempt& attempt, double tolerance) {
    std::ostringstream text;
    text << name(attempt.status);
    switch (attempt.status) {
    case EquilibriumStatus::unbounded:
        text << ": the energy falls without end and nodes move away; there is no equilibrium near this state";
        break;
    case EquilibriumStatus::not_finite:
        text << ": an energy or a force became infinite or NaN";
        break;
    case EquilibriumStatus::no_descent:
        text << (attempt.residual < kNearBalance ? ": rounding hides what is left to gain"
                                                 : ": no step was found that lowers the energy, far from balance");
        break;
    case EquilibriumStatus::inverted:
        text << ": beyond this load only states with cells turned inside out were found";
        break;
    default:
        break;
    }
    text << " (";
    if (std::isfinite(attempt.residual)) {
        text << "residual " << attempt.residual << ", ";
    }
    text << "tolerance " << tolerance << ", at " << attempt.fraction << " of the loading)";
    return text.str();
}

/// Whether a state is worth keeping that is not quite in equilibrium.
bool may_be_near(const Attempt& attempt) {
    return attempt.status == EquilibriumStatus::no_descent ||
           attempt.status == EquilibriumStatus::iterations_exhausted || attempt.status == EquilibriumStatus::stopped;
}

/// What to say of a body that nothing holds along an axis.
std::string falling(int axis) {
    std::string text = "unbounded: nothing holds the body along x against the resultant of its loads";
    text[text.find(" x ") + 1] = "xyz"[axis];
    return text;
}

} // namespace

template <class T>
LoadStepping<T>::LoadStepping(const VectorSpace<T>& space) : space_(&space), minimiser_(space), last_(space.make()) {}

template <class T>
MinimiserResult LoadStepping<T>::settle(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                                        const MinimiserOptions& limits, Saddles saddles, EquilibriumResult& work) {
    // Few saddles lie one below the other.
    constexpr int kSaddles = 5;
    for (int saddle = 0;; ++saddle) {
        const MinimiserResult found = minimiser_.minimise(potential, preconditioner, state, limits);
        work.newton_iterations += found.iterations;
        work.cg_iterations += found.cg_iterations;
        work.negative_curvatures += found.negative_curvatures;
        const bool look = saddles == Saddles::left || (saddles == Saddles::suspected && work.negative_curvatures > 0);
        if (found.status != EquilibriumStatus::converged || saddle == kSaddles || !look ||
            !minimiser_.leave_saddle(potential, preconditioner, state, work.cg_iterations)) {
            return found;
        }
        ++work.negative_curvatures;
    }
}

template <class T>
bool LoadStepping<T>::approach(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                               const MinimiserOptions& limits, EquilibriumResult& work) {
    constexpr int kSteps = 20;
    constexpr double kNear = 1e-2;
    const Body<T>& body = potential.body();
    const FieldView<T> u{state.displacement};
    const auto size = [&] { return space_->largest([](const T& x) { return x < 0 ? -x : x; }, u); };
    const double far = size() + 100 * potential.extent();
    MinimiserOptions roughly = limits;
    roughly.tolerance = std::max(limits.tolerance, 1e-3);
    std::vector<T> from(3 * body.node_count());
    double strength = 1 / (body.critical_time_step() * body.critical_time_step());
    for (int step = 0; step < kSteps; ++step, strength /= 10) {
        body.read(state.displacement, body.length_unit(), VectorField<T>::aos(from.data(), body.node_count()));
        potential.pull(strength, VectorField<const T>::aos(from.data(), body.node_count()));
        const MinimiserResult found = minimiser_.minimise(potential, preconditioner, state, roughly);
        potential.release();
        work.newton_iterations += found.iterations;
        work.cg_iterations += found.cg_iterations;
        if (!(size() < far)) {
            return false;
        }
        if (found.status == EquilibriumStatus::stopped || minimiser_.residual(potential, state) < kNear) {
            break;
        }
    }
    return true;
}

template <class T>
EquilibriumResult LoadStepping<T>::follow(Potential<T>& potential, Preconditioner<T>& preconditioner, State<T>& state,
                                          const std::function<void(double fraction)>& prescribe,
                                          const EquilibriumOptions& options, bool near_end) {
    EquilibriumResult result;
    MutableFieldView<T> u{state.displacement};
    space_->copy(u, last_);
    double worst_before = potential.volume_ratios(state).min, last_step = 0;
    double step = std::min(options.first_load_step, options.largest_load_step);
    Attempt last, first; ///< equilibrium; attempt
    const FieldView<T> displacement{state.displacement};
    const auto size = [&] { return space_->largest([](const T& x) { return x < 0 ? -x : x; }, displacement); };
    const double far = size() + 10 * potential.extent();
    bool failed = false, near = false;
    const auto keep = [&](const auto& from, NodeVector<T>& in) { // made where it is needed: few solves do
        if (in.field[0].size() == 0) {
            in = space_->make();
        }
        space_->copy(from, in);
    };
    const auto describe = [&](const Attempt& state_of) {
        result.residual = state_of.residual;
        result.potential = state_of.potential;
        result.load_fraction = state_of.fraction;
        const VolumeRatios ratios = potential.volume_ratios(state);
        result.min_cell_volume_ratio = ratios.min;
        result.max_cell_volume_ratio = ratios.max;
    };
    const auto leave = [&](const Attempt& kept, NodeVector<T>& at) {
        space_->copy(at, u);
        describe(kept);
    };
    const auto leave_start = [&] {
        // The loading's beginning: it need not be defined before.
        prescribe(std::numeric_limits<double>::min());
        space_->copy(last_, u);
        last.residual = minimiser_.residual(potential, state);
        last.potential = potential.value(state).total * potential.body().length_unit();
        leave(last, last_);
    };
    for (;;) {
        const double target = last.fraction + step > 1 - 1e-9 ? 1.0 : last.fraction + step;
        prescribe(target);
        if (const int axis = potential.falling_axis(); axis >= 0) {
            result.status = EquilibriumStatus::unbounded;
            result.message = falling(axis);
            last.fraction > 0 ? leave(last, last_) : leave_start();
            break;
        }
        // With cut-backs left, a step need not try for ever.
        const bool shortest = kCut * step < options.smallest_load_step;
        // Turned sections do not go on along a straight line.
        const Turning<T>* const turning = potential.turning();
        const bool direct = turning != nullptr && turning->slender();
        // What touched in the last equilibrium holds it in the next one, too.
        const bool floats = potential.contact() && potential.held_axes() != 7 && (last.fraction == 0 || failed);
        if (!floats && last_step > 0 && turning == nullptr) {
            const T factor = static_cast<T>((target - last.fraction) / last_step);
            space_->for_each([factor](const T& now, const T& before, T& q) { q = now + factor * (now - before); },
                             last_, before_last_, u);
            potential.impose(state);
        } else if (floats || near_end) {
            // Near the end Newton's method is as good as a first answer, and makes matrices once.
            potential.impose(state);
        } else {
            std::function<bool(int)> progress;
            if (options.progress) {
                progress = [&](int cg) {
                    return options.progress(
                        {target, result.load_steps, 0, result.cg_iterations + cg, 1, last.potential});
                };
            }
            result.cg_iterations += minimiser_.predict(potential, preconditioner, state, progress);
        }
        MinimiserOptions limits;
        limits.tolerance = options.tolerance;
        limits.iterations = shortest ? options.newton_iterations : std::min(options.newton_iterations, kPatience);
        if (options.progress) {
            limits.progress = [&](int iteration, long cg, double residual, double energy) {
                return options.progress(
                    {target, result.load_steps, iteration, result.cg_iterations + cg, residual, energy});
            };
        }
        if (floats && !approach(potential, preconditioner, state, limits, result)) {
            result.status = EquilibriumStatus::unbounded;
            result.message = "unbounded: obstacles alone do not hold the body, which slides off or falls past them";
            last.fraction > 0 ? leave(last, last_) : leave_start();
            break;
        }
        const Saddles saddles = target < 1              ? Saddles::stay
                                : options.leave_saddles ? Saddles::left
                                : direct                ? Saddles::suspected
                                                        : Saddles::stay;
        const MinimiserResult found = settle(potential, preconditioner, state, limits, saddles, result);
        ++result.load_steps;
        const double worst = potential.volume_ratios(state).min;
        const bool inverted = worst <= 0 && worst_before > 0;
        Attempt attempt{found.status, target, found.residual, found.potential};
        if (attempt.status == EquilibriumStatus::converged && !inverted) {
            last_step = target - last.fraction;
            last = attempt;
            if (target == 1.0) {
                result.status = EquilibriumStatus::converged;
                describe(last);
                break;
            }
            keep(last_, before_last_);
            space_->copy(u, last_);
            worst_before = worst;
            step = std::min({failed ? step : kGrow * step, options.largest_load_step, 1 - target});
            failed = false;
            continue;
        }
        if (attempt.status == EquilibriumStatus::converged) {
            attempt.status = EquilibriumStatus::inverted;
        }
        ++result.failed_load_steps;
        failed = true;
        if (result.failed_load_steps == 1) {
            keep(u, first_attempt_);
            first = attempt;
            near = may_be_near(first) && !inverted && size() < far;
        }
        step *= kCut;
        if (attempt.status == EquilibriumStatus::stopped || step < options.smallest_load_step ||
            result.load_steps >= options.load_steps) {
            const bool keep_first = last.fraction == 0 && near;
            const Attempt& told = keep_first ? first : attempt;
            result.status = told.status;
            result.message = failure(told, options.tolerance);
            if (last.fraction > 0) {
                std::ostringstream text;
                text << "; left is the equilibrium at " << last.fraction << " of the loading";
                result.message += text.str();
                leave(last, last_);
            } else if (keep_first) {
                result.message += "; left is the state that this attempt ended at";
                leave(first, first_attempt_);
            } else {
                result.message += "; left is the start";
                leave_start();
            }
            break;
        }
        space_->copy(last_, u);
    }
    result.preconditioner = preconditioner.name();
    return result;
}

template class LoadStepping<float>;
template class LoadStepping<double>;

} // namespace hybmss
