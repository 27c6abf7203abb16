#include "simulation/run/energy_meter.hpp"

#include "plan/bodies/step_factors.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace hybmss {
namespace {

double dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double sum_of(const std::vector<MeteredState::Obstacle>& obstacles, double MeteredState::Obstacle::*part) {
    double sum = 0;
    for (const MeteredState::Obstacle& obstacle : obstacles) {
        sum += obstacle.*part;
    }
    return sum;
}

double sum_of(const std::vector<EffectEnergy>& effects, double EffectEnergy::*part) {
    double sum = 0;
    for (const EffectEnergy& effect : effects) {
        sum += effect.*part;
    }
    return sum;
}

} // namespace

double EnergyBalance::imbalance() const {
    return supports + loads + gravity + obstacles - kinetic - free_obstacles - elastic - effects - mass_damping -
           effects_dissipated;
}

double EnergyBalance::relative_imbalance() const {
    double scale = peak_kinetic;
    for (const double part : {supports, loads, gravity, obstacles, kinetic, free_obstacles, elastic, effects,
                              mass_damping, effects_dissipated}) {
        scale = std::max(scale, std::abs(part));
    }
    return scale > 0 ? std::abs(imbalance()) / scale : 0;
}

EnergyMeter::Constants::Constants(const StepParameters& parameters, std::span<const double> mass, bool loads_change)
    : step(parameters), time_step(parameters.time_step), masses(mass), changing_loads(loads_change), kick(time_step),
      slowing(1 + time_step * parameters.mass_damping), braking(parameters.mass_damping), share(0) {
    if (parameters.integrator == Integrator::leapfrog && braking > 0) {
        const StepFactors factors = step_factors(parameters, parameters);
        kick = factors.kick;
        slowing = 1 / factors.velocity;
        braking = 1 / factors.force - 1 / time_step;
        share = (1 / time_step - factors.velocity / factors.force) / braking;
    }
}

EnergyMeter::EnergyMeter(const Constants& constants, MeteredState start, std::vector<Vector3> velocities)
    : constants_(constants), last_(std::move(start)), start_(last_.displacements), velocity_(std::move(velocities)),
      start_elastic_(last_.elastic), start_free_(sum_of(last_.obstacles, &MeteredState::Obstacle::kinetic)),
      start_effects_(last_.effects) {
    if (constants.step.integrator == Integrator::leapfrog) { // given at the start itself, not half a step before
        const StepFactors half = half_kick(constants.step);
        velocity_ = kicked(-half.force, half.velocity, -half.acting);
    }
}

double EnergyMeter::kinetic(std::span<const Vector3> next) const {
    double sum = 0;
    for (std::size_t n = 0; n < next.size(); ++n) {
        sum += constants_.masses[n] * dot(velocity_[n], next[n]);
    }
    return sum / 2;
}

/// With w the velocity before the last state and w' the one after it:
///
///     damping force  -c m w', with leapfrog about -c m (w + w')/2
///     support force  R = m (w' - w)/dt - damping force - f - m g - load
///     m g and loads, where they change
///
/// each over the way dt (before w + after w').
void EnergyMeter::add_works(std::span<const Vector3> next, double before, double after, Works& works) const {
    const double dt = constants_.time_step, c = constants_.braking;
    const auto slowed = [&](std::size_t n, std::size_t a) { return next[n][a] + constants_.share * velocity_[n][a]; };
    const auto way = [&](std::size_t n, std::size_t a) { return dt * (before * velocity_[n][a] + after * next[n][a]); };
    if (c > 0) {
        double sum = 0;
        for (std::size_t n = 0; n < next.size(); ++n) {
            for (std::size_t a = 0; a < 3; ++a) {
                sum += constants_.masses[n] * slowed(n, a) * way(n, a);
            }
        }
        works.mass_damping += c * sum;
    }
    for (std::size_t n = 0; constants_.changing_loads && n < next.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            works.gravity += constants_.masses[n] * last_.gravity[a] * way(n, a);
            works.loads += last_.loads.empty() ? 0 : last_.loads[n][a] * way(n, a);
        }
    }
    for (const PrescribedNode& node : last_.held) {
        const std::size_t n = node.node;
        for (std::size_t a = 0; a < 3; ++a) {
            if (node.axes >> a & 1) {
                const double inertia = (next[n][a] - velocity_[n][a]) / dt + c * slowed(n, a) - last_.gravity[a];
                const double load = last_.loads.empty() ? 0 : last_.loads[n][a];
                works.supports += (constants_.masses[n] * inertia - last_.forces[n][a] - load) * way(n, a);
            }
        }
    }
}

void EnergyMeter::record(MeteredState state) {
    std::vector<Vector3> next = state.displacements;
    for (std::size_t n = 0; n < next.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            next[n][a] = (next[n][a] - last_.displacements[n][a]) / constants_.time_step;
        }
    }
    if (!begun_) {
        start_kinetic_ = kinetic(next);
    }
    peak_kinetic_ = std::max(peak_kinetic_, kinetic(next));
    add_works(next, begun_ ? 0.5 : 0, 0.5, works_);
    for (std::size_t o = 0; o < state.obstacles.size(); ++o) {
        const auto &was = last_.obstacles[o], &is = state.obstacles[o];
        Vector3 way{}, angle{};
        for (std::size_t a = 0; a < 3; ++a) {
            way[a] = is.position[a] - was.position[a];
            angle[a] = is.angle[a] - was.angle[a];
        }
        // Contact pushes by the force that it has where the step ends.
        works_.obstacles += dot(is.force, way) + dot(is.torque, angle);
    }
    begun_ = true;
    velocity_ = std::move(next);
    last_ = std::move(state);
}

std::vector<double> EnergyMeter::memory() const {
    std::vector<double> memory = {begun_ ? 1.0 : 0.0, works_.supports, works_.mass_damping, works_.obstacles,
                                  start_kinetic_,     start_elastic_,  peak_kinetic_};
    if (constants_.changing_loads) {
        memory.insert(memory.end(), {works_.loads, works_.gravity});
    }
    for (const EffectEnergy& effect : start_effects_) {
        memory.push_back(effect.stored);
        memory.push_back(effect.dissipated);
    }
    for (const auto* field : {&start_, &velocity_}) {
        for (const Vector3& v : *field) {
            memory.insert(memory.end(), v.begin(), v.end());
        }
    }
    return memory;
}

void EnergyMeter::set_memory(std::span<const double> memory, MeteredState last) {
    const std::size_t works = constants_.changing_loads ? 9 : 7;
    if (memory.size() != works + 2 * start_effects_.size() + 6 * start_.size()) {
        throw std::runtime_error("its energy balance is of another body");
    }
    const double* next = memory.data();
    begun_ = *next++ != 0;
    works_ = {.supports = next[0], .mass_damping = next[1], .obstacles = next[2]};
    start_kinetic_ = next[3];
    start_elastic_ = next[4];
    peak_kinetic_ = next[5];
    next += 6;
    if (constants_.changing_loads) {
        works_.loads = *next++;
        works_.gravity = *next++;
    }
    for (EffectEnergy& effect : start_effects_) {
        effect.stored = *next++;
        effect.dissipated = *next++;
    }
    for (auto* field : {&start_, &velocity_}) {
        for (Vector3& v : *field) {
            std::copy_n(next, 3, v.begin());
            next += 3;
        }
    }
    last_ = std::move(last);
}

/// w by a kick at the last state; where it is held, after so many seconds.
std::vector<Vector3> EnergyMeter::kicked(double kick, double slowing, double seconds) const {
    std::vector<Vector3> next = velocity_;
    for (std::size_t n = 0; n < next.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const double load = last_.loads.empty() ? 0 : last_.loads[n][a];
            next[n][a] += kick * ((last_.forces[n][a] + load) / constants_.masses[n] + last_.gravity[a]);
            next[n][a] /= slowing;
        }
    }
    for (std::size_t i = 0; i < last_.held.size(); ++i) {
        const PrescribedNode& node = last_.held[i];
        for (std::size_t a = 0; a < 3; ++a) {
            if (node.axes >> a & 1) {
                next[node.node][a] = velocity_[node.node][a] + seconds * last_.accelerations[i][a];
            }
        }
    }
    return next;
}

EnergyBalance EnergyMeter::balance() const {
    EnergyBalance balance;
    Works works = works_;
    const std::vector<Vector3> next = kicked(constants_.kick, constants_.slowing, constants_.time_step);
    const double kinetic_now = kinetic(next);
    if (begun_) {
        add_works(next, 0.5, 0, works);
        balance.kinetic = kinetic_now - start_kinetic_;
    }
    balance.supports = works.supports;
    balance.obstacles = works.obstacles;
    balance.mass_damping = works.mass_damping;
    balance.gravity = works.gravity;
    balance.loads = works.loads;
    for (std::size_t n = 0; !constants_.changing_loads && n < start_.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const double way = last_.displacements[n][a] - start_[n][a];
            balance.gravity += constants_.masses[n] * last_.gravity[a] * way;
            balance.loads += last_.loads.empty() ? 0 : last_.loads[n][a] * way;
        }
    }
    balance.gravity += sum_of(last_.obstacles, &MeteredState::Obstacle::work_of_gravity);
    balance.free_obstacles = sum_of(last_.obstacles, &MeteredState::Obstacle::kinetic) - start_free_;
    balance.elastic = last_.elastic - start_elastic_;
    balance.effects = sum_of(last_.effects, &EffectEnergy::stored) - sum_of(start_effects_, &EffectEnergy::stored);
    balance.effects_dissipated =
        sum_of(last_.effects, &EffectEnergy::dissipated) - sum_of(start_effects_, &EffectEnergy::dissipated);
    balance.peak_kinetic = std::max(peak_kinetic_, std::abs(kinetic_now));
    return balance;
}

} // namespace hybmss
