#include "solvers/newton/load_stepping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace hybmss {
namespace {

constexpr double kCut = 0.25, kGrow = 2;
/// Newton iterations a step: more are a sign to take shorter ones, if that is possible.
constexpr int kPatience = 40;

std::string failure(const EquilibriumResult& result, double tolerance) {
    std::ostringstream text;
    text << name(result.status);
    switch (result.status) {
    case EquilibriumStatus::unbounded:
        text << ": the energy falls without end and nodes move away; there is no equilibrium near this state";
        break;
    case EquilibriumStatus::not_finite:
        text << ": an energy or a force became infinite or NaN";
        break;
    case EquilibriumStatus::no_descent:
        text << ": rounding hides what is left to gain";
        break;
    case EquilibriumStatus::inverted:
        text << ": beyond this load only states with cells turned inside out were found";
        break;
    default:
        break;
    }
    text << " (";
    if (std::isfinite(result.residual)) {
        text << "residual " << result.residual << ", ";
    }
    text << "tolerance " << tolerance << ", at " << result.load_fraction << " of the loading)";
    return text.str();
}

/// What to say of a body that nothing holds along an axis.
std::string falling(int axis) {
    std::string text = "unbounded: nothing holds the body along x against the resultant of its loads";
    text[text.find(" x ") + 1] = "xyz"[axis];
    return text;
}

} // namespace

template <class T>
LoadStepping<T>::LoadStepping(const VectorSpace<T>& space)
    : space_(&space), minimiser_(space), last_(space.make()), before_last_(space.make()), first_attempt_(space.make()) {
}

template <class T>
EquilibriumResult LoadStepping<T>::follow(Potential<T>& potential, Preconditioner<T>& preconditioner,
                                          Preconditioner<T>* plain, State<T>& state,
                                          const std::function<void(double fraction)>& prescribe,
                                          const EquilibriumOptions& options) {
    EquilibriumResult result;
    MutableFieldView<T> u{state.displacement};
    space_->copy(u, last_);
    double worst_before = potential.volume_ratios(state).min;
    double done = 0, step = options.first_load_step, last_step = 0, last_potential = 0;
    bool failed = false;
    for (;;) {
        const double target = done + step > 1 - 1e-9 ? 1.0 : done + step;
        prescribe(target);
        if (const int axis = potential.falling_axis(); axis >= 0) {
            result.status = EquilibriumStatus::unbounded;
            result.message = falling(axis);
            break;
        }
        // With cut-backs left, a step need not try for ever.
        const bool shortest = kCut * step < options.smallest_load_step;
        if (last_step > 0) {
            const T factor = static_cast<T>((target - done) / last_step);
            space_->for_each([factor](const T& now, const T& before, T& q) { q = now + factor * (now - before); },
                             last_, before_last_, u);
            potential.impose(state);
        } else {
            result.cg_iterations += minimiser_.predict(potential, preconditioner, state);
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
        MinimiserResult found = minimiser_.minimise(potential, preconditioner, plain, state, limits);
        // Few saddles lie one below the other.
        constexpr int kSaddles = 5;
        for (int saddle = 0; options.leave_saddles && target == 1.0 && saddle < kSaddles; ++saddle) {
            if (found.status != EquilibriumStatus::converged ||
                !minimiser_.leave_saddle(potential, preconditioner, state, result.cg_iterations)) {
                break;
            }
            result.newton_iterations += found.iterations;
            result.cg_iterations += found.cg_iterations;
            result.negative_curvatures += found.negative_curvatures + 1;
            found = minimiser_.minimise(potential, preconditioner, plain, state, limits);
        }
        ++result.load_steps;
        result.newton_iterations += found.iterations;
        result.cg_iterations += found.cg_iterations;
        result.negative_curvatures += found.negative_curvatures;
        result.status = found.status;
        result.residual = found.residual;
        result.potential = found.potential;
        const auto [worst, best] = potential.volume_ratios(state);
        result.min_cell_volume_ratio = worst;
        result.max_cell_volume_ratio = best;
        result.load_fraction = target;
        const bool inverted = worst <= 0 && worst_before > 0;
        const bool good = found.status == EquilibriumStatus::converged && !inverted;
        if (good) {
            const double previous = done;
            done = target;
            if (done == 1.0) {
                break;
            }
            last_step = target - previous;
            space_->copy(last_, before_last_);
            space_->copy(u, last_);
            worst_before = worst;
            last_potential = found.potential;
            step = std::min(failed ? step : kGrow * step, 1 - done);
            failed = false;
        } else {
            ++result.failed_load_steps;
            failed = true;
            if (result.failed_load_steps == 1) {
                space_->copy(u, first_attempt_);
            }
            step *= kCut;
            const bool give_up = found.status == EquilibriumStatus::stopped || step < options.smallest_load_step;
            if (give_up || result.load_steps >= options.load_steps) {
                if (found.status == EquilibriumStatus::converged) {
                    result.status = EquilibriumStatus::inverted;
                }
                result.load_fraction = done;
                result.message = failure(result, options.tolerance);
                space_->copy(done > 0 ? last_ : first_attempt_, u);
                const VolumeRatios left = potential.volume_ratios(state);
                result.potential = done > 0 ? last_potential : result.potential;
                result.min_cell_volume_ratio = left.min;
                result.max_cell_volume_ratio = left.max;
                break;
            }
            space_->copy(last_, u);
        }
    }
    result.preconditioner = preconditioner.name();
    return result;
}

template class LoadStepping<float>;
template class LoadStepping<double>;

} // namespace hybmss
