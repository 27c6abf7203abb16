#include "simulation/dynamics_state.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// What get(dynamics, field) writes.
template <class T, template <class> class Dynamics, class Get>
std::vector<Vector3> read(const Dynamics<T>& dynamics, const Get& get) {
    const std::size_t size = dynamics.node_count();
    std::vector<T> values(3 * size);
    get(dynamics, VectorField<T>::aos(values.data(), size));
    std::vector<Vector3> out(size);
    for (std::size_t n = 0; n < size; ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            out[n][a] = static_cast<double>(values[3 * n + a]);
        }
    }
    return out;
}

template <class T>
std::vector<T> interleaved(std::span<const Vector3> in) {
    std::vector<T> values;
    values.reserve(3 * in.size());
    for (const Vector3& v : in) {
        std::transform(v.begin(), v.end(), std::back_inserter(values), [](double x) { return static_cast<T>(x); });
    }
    return values;
}

template <class T, template <class> class Dynamics>
void write(Dynamics<T>& dynamics, std::span<const Vector3> displacements, std::span<const Vector3> velocities) {
    const std::vector<T> u = interleaved<T>(displacements), v = interleaved<T>(velocities);
    dynamics.set_displacements(VectorField<const T>::aos(u.data(), displacements.size()));
    dynamics.set_velocities(VectorField<const T>::aos(v.data(), velocities.size()));
}

} // namespace

AnyDynamics make_dynamics(const Lattice& lattice, const Material& material, SolverMethod method,
                          const SimulationOptions& options) {
    const bool single = options.precision == Precision::float32;
    if (method == SolverMethod::symplectic_euler) {
        return single ? AnyDynamics(ExplicitDynamics<float>(lattice, material, options.plan))
                      : AnyDynamics(ExplicitDynamics<double>(lattice, material, options.plan));
    }
    return single ? AnyDynamics(ImplicitDynamics<float>(lattice, material, options.plan))
                  : AnyDynamics(ImplicitDynamics<double>(lattice, material, options.plan));
}

std::vector<Vector3> displacements_of(const AnyDynamics& dynamics) {
    return std::visit(
        [](const auto& any) { return read(any, [](const auto& d, const auto& out) { d.get_displacements(out); }); },
        dynamics);
}

std::vector<Vector3> velocities_of(const AnyDynamics& dynamics) {
    return std::visit(
        [](const auto& any) { return read(any, [](const auto& d, const auto& out) { d.get_velocities(out); }); },
        dynamics);
}

namespace {

/// What explicit(dynamics) gives; of implicit dynamics, which have no effects, nothing.
template <class Result, class Explicit>
Result of_explicit(const AnyDynamics& dynamics, const Explicit& get) {
    if (const auto* single = std::get_if<ExplicitDynamics<float>>(&dynamics)) {
        return get(*single);
    }
    if (const auto* twice = std::get_if<ExplicitDynamics<double>>(&dynamics)) {
        return get(*twice);
    }
    return {};
}

} // namespace

std::vector<Vector3> forces_of(const AnyDynamics& dynamics) {
    std::vector<Vector3> forces = std::visit(
        [](const auto& any) { return read(any, [](const auto& d, const auto& out) { d.get_forces(out); }); }, dynamics);
    const auto others = of_explicit<std::vector<Vector3>>(dynamics, [](const auto& any) {
        return any.effect_energies().empty()
                   ? std::vector<Vector3>()
                   : read(any, [](const auto& d, const auto& out) { d.get_effect_forces(out); });
    });
    for (std::size_t n = 0; n < others.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            forces[n][a] += others[n][a];
        }
    }
    return forces;
}

std::vector<EffectEnergy> effect_energies_of(const AnyDynamics& dynamics) {
    return of_explicit<std::vector<EffectEnergy>>(dynamics, [](const auto& d) { return d.effect_energies(); });
}

std::vector<double> effect_memory_of(const AnyDynamics& dynamics) {
    return of_explicit<std::vector<double>>(dynamics, [](const auto& d) { return d.effect_memory(); });
}

void set_state(AnyDynamics& dynamics, std::span<const Vector3> displacements, std::span<const Vector3> velocities) {
    std::visit([&](auto& d) { write(d, displacements, velocities); }, dynamics);
}

} // namespace hybmss
