#include "simulation/run/any_dynamics.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

/// What get(dynamics, field) writes.
template <class Get>
std::vector<Vector3> read(const AnyDynamics& any, const Get& get) {
    return std::visit(
        [&]<class T, template <class> class Dynamics>(const Dynamics<T>& dynamics) {
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
        },
        any);
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

template <class T>
ImplicitDynamics<T>::ImplicitDynamics(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : solver_(lattice, material, options), displacement_(3 * solver_.node_count(), T(0)),
      velocity_(displacement_.size(), T(0)) {}

template <class T>
ImplicitDynamics<T>::ImplicitDynamics(const Network& network, const PlanOptions& options)
    : solver_(network, options), displacement_(3 * solver_.node_count(), T(0)), velocity_(displacement_.size(), T(0)) {}

template <class T>
EquilibriumResult ImplicitDynamics<T>::step(const Loading& loading, double time_step, double mass_damping,
                                            const EquilibriumOptions& options) {
    Field displacement = displacement_, velocity = velocity_;
    EquilibriumResult result =
        solver_.step(loading, time_step, mass_damping, view(displacement), view(velocity), options);
    if (result.status == EquilibriumStatus::converged) {
        displacement_.swap(displacement);
        velocity_.swap(velocity);
    }
    return result;
}

template <class T>
EquilibriumResult ImplicitDynamics<T>::follow(const std::function<Loading(double fraction)>& path,
                                              const EquilibriumOptions& options) {
    std::fill(velocity_.begin(), velocity_.end(), T(0));
    return solver_.follow(path, view(displacement_), options);
}

template <class T>
std::vector<T> ImplicitDynamics<T>::exact_state() const {
    std::vector<T> values = displacement_;
    values.insert(values.end(), velocity_.begin(), velocity_.end());
    const std::vector<T> memory = solver_.memory();
    values.insert(values.end(), memory.begin(), memory.end());
    return values;
}
template <class T>
void ImplicitDynamics<T>::set_exact_state(std::span<const T> values) {
    const std::size_t size = displacement_.size();
    if (values.size() < 2 * size) {
        throw std::invalid_argument("state of " + std::to_string(values.size()) + " values given: the body's " +
                                    std::to_string(node_count()) + " nodes have six each");
    }
    std::copy_n(values.begin(), size, displacement_.begin());
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(size), size, velocity_.begin());
    solver_.set_memory(values.subspan(2 * size));
}
template <class T>
double ImplicitDynamics<T>::kinetic_energy() const {
    double sum = 0;
    for (std::size_t n = 0; n < node_count(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            const auto v = static_cast<double>(velocity_[3 * n + a]);
            sum += 0.5 * masses()[n] * v * v;
        }
    }
    return sum;
}

template <class T>
void ImplicitDynamics<T>::copy(VectorField<const T> from, VectorField<T> to) {
    for (std::size_t n = 0; n < from.size; ++n) {
        const auto in = static_cast<std::ptrdiff_t>(n) * from.stride, out = static_cast<std::ptrdiff_t>(n) * to.stride;
        to.x[out] = from.x[in];
        to.y[out] = from.y[in];
        to.z[out] = from.z[in];
    }
}

template class ImplicitDynamics<float>;
template class ImplicitDynamics<double>;

namespace {

template <class... BodyAndOptions>
AnyDynamics made(SolverMethod method, Precision precision, const BodyAndOptions&... of) {
    const bool single = precision == Precision::float32;
    if (explicit_in_time(method)) {
        return single ? AnyDynamics(ExplicitDynamics<float>(of...)) : AnyDynamics(ExplicitDynamics<double>(of...));
    }
    return single ? AnyDynamics(ImplicitDynamics<float>(of...)) : AnyDynamics(ImplicitDynamics<double>(of...));
}

} // namespace

AnyDynamics make_dynamics(const Lattice& lattice, const Material& material, SolverMethod method,
                          const SimulationOptions& options) {
    return made(method, options.precision, lattice, material, options.plan);
}

AnyDynamics make_dynamics(const Network& network, SolverMethod method, const SimulationOptions& options) {
    return made(method, options.precision, network, options.plan);
}

std::vector<Vector3> displacements_of(const AnyDynamics& dynamics) {
    return read(dynamics, [](const auto& d, const auto& out) { d.get_displacements(out); });
}

std::vector<Vector3> velocities_of(const AnyDynamics& dynamics) {
    return read(dynamics, [](const auto& d, const auto& out) { d.get_velocities(out); });
}

std::vector<Vector3> forces_of(const AnyDynamics& dynamics) {
    std::vector<Vector3> forces = read(dynamics, [](const auto& d, const auto& out) { d.get_forces(out); });
    if (effect_energies_of(dynamics).empty()) {
        return forces;
    }
    const std::vector<Vector3> others =
        read(dynamics, [](const auto& d, const auto& out) { d.get_effect_forces(out); });
    for (std::size_t n = 0; n < others.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            forces[n][a] += others[n][a];
        }
    }
    return forces;
}

std::vector<Vector3> contact_forces_of(const AnyDynamics& dynamics) {
    return read(dynamics, [](const auto& d, const auto& out) {
        if constexpr (requires { d.get_contact_forces(out); }) {
            d.get_contact_forces(out);
        }
    });
}

std::vector<EffectEnergy> effect_energies_of(const AnyDynamics& dynamics) {
    return std::visit([](const auto& d) { return d.effect_energies(); }, dynamics);
}

std::vector<double> effect_memory_of(const AnyDynamics& dynamics) {
    return std::visit([](const auto& d) { return d.effect_memory(); }, dynamics);
}

void set_effect_memory(AnyDynamics& dynamics, std::span<const double> memory) {
    std::visit([&](auto& d) { d.set_effect_memory(memory); }, dynamics);
}

void set_state(AnyDynamics& dynamics, std::span<const Vector3> displacements, std::span<const Vector3> velocities) {
    std::visit([&](auto& d) { write(d, displacements, velocities); }, dynamics);
}

} // namespace hybmss
