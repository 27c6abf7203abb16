#include "plan/bodies/step_factors.hpp"

#include "layouts/messages.hpp"

#include <cmath>
#include <string>

namespace hybmss {
namespace {

/// Damping in a step by a factor of up to e^50, more than a float's digits are of use for: a force before the sweep is
/// divided by it.
constexpr double kMostDamping = 50;

/// By what is given: a factor that rounds to one may still change the sign of a zero.
bool is_driven(const StepParameters& p) {
    return p.mass_damping != 0 || p.acceleration != std::array<double, 3>{0, 0, 0};
}

/// v <- (v + dt (f/m + g)) / (1 + dt c)
StepFactors symplectic_euler(const StepParameters& p) {
    const double dt = p.time_step, factor = 1 / (1 + dt * p.mass_damping);
    StepFactors f{};
    f.velocity = factor;
    f.force = dt * factor;
    f.late_force = dt / (1 + dt * p.mass_damping);
    for (std::size_t a = 0; a < 3; ++a) {
        f.gain[a] = p.acceleration[a] * dt * factor;
    }
    f.driven = is_driven(p);
    f.kick = dt;
    f.acting = dt;
    f.acceleration = p.acceleration;
    return f;
}

/// One kick after another, with no drift in between.
StepFactors composed(const StepFactors& first, const StepFactors& second) {
    StepFactors f{};
    f.velocity = first.velocity * second.velocity;
    f.force = second.velocity * first.force + second.force;
    f.driven = first.driven || second.driven;
    f.acting = first.acting + second.acting;
    for (std::size_t a = 0; a < 3; ++a) {
        f.gain[a] = second.velocity * first.gain[a] + second.gain[a];
        f.acceleration[a] = (first.acting * first.acceleration[a] + second.acting * second.acceleration[a]) / f.acting;
    }
    f.kick = f.force / f.velocity;
    f.late_force = f.force;
    return f;
}

} // namespace

/// The motion under a constant force in half a step, exactly: v <- e^(-c t) v + (1 - e^(-c t)) / c (f/m + g). So two
/// halves are a whole, whatever the damping, and the step is stable wherever it is without any.
StepFactors half_kick(const StepParameters& p) {
    const double t = p.time_step / 2, c = p.mass_damping;
    StepFactors f{};
    f.velocity = c > 0 ? std::exp(-c * t) : 1;
    f.force = c > 0 ? -std::expm1(-c * t) / c : t;
    for (std::size_t a = 0; a < 3; ++a) {
        f.gain[a] = f.force * p.acceleration[a];
    }
    f.driven = is_driven(p);
    f.kick = f.force / f.velocity;
    f.late_force = f.force;
    f.acting = t;
    f.acceleration = p.acceleration;
    return f;
}

StepFactors step_factors(const StepParameters& p, const std::optional<StepParameters>& before) {
    if (!(p.mass_damping >= 0) || !std::isfinite(p.mass_damping)) {
        refuse_value("mass_damping", p.mass_damping, "finite and at least 0");
    }
    const bool leapfrog = p.integrator == Integrator::leapfrog;
    if (leapfrog && p.mass_damping * p.time_step > kMostDamping) {
        refuse_value("mass_damping", p.mass_damping,
                     printed("at most %g for a leapfrog step of %g s", kMostDamping / p.time_step, p.time_step));
    }
    StepFactors f = leapfrog ? half_kick(p) : symplectic_euler(p);
    if (leapfrog && before) { // mostly its like, and exponentials are some percent of a step of 3^3 cells
        f = composed(*before == p ? f : half_kick(*before), f);
    }
    f.time_step = p.time_step;
    return f;
}

template <class T>
kernels::StepConstants<T> step_constants(const StepFactors& f, double length_unit) {
    const auto allowed = [](double value, const char* what) {
        return std::string(what) + (std::isfinite(value) ? " in the body's precision" : "");
    };
    if (!(static_cast<T>(f.time_step) > 0) || !std::isfinite(static_cast<T>(f.time_step))) {
        refuse_value("time_step", f.time_step,
                     f.time_step > 0 ? allowed(f.time_step, "finite and above 0") : "finite and above 0");
    }
    kernels::StepConstants<T> constants{};
    constants.time_step = static_cast<T>(f.time_step);
    constants.velocity_factor = static_cast<T>(f.velocity);
    constants.force_factor = static_cast<T>(f.force);
    for (std::size_t c = 0; c < 3; ++c) {
        constants.velocity_gain[c] = static_cast<T>(f.gain[c] / length_unit);
        if (!std::isfinite(constants.velocity_gain[c])) {
            refuse_value("acceleration", f.acceleration[c], allowed(f.acceleration[c], "finite"));
        }
    }
    return constants;
}

template kernels::StepConstants<float> step_constants<float>(const StepFactors&, double);
template kernels::StepConstants<double> step_constants<double>(const StepFactors&, double);

} // namespace hybmss
