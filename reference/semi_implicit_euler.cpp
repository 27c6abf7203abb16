#include "reference/semi_implicit_euler.hpp"
#include "reference/forces.hpp"

#include <cmath>

namespace hybmss::reference {

State rest_state(const Body& body) {
    const std::vector<Vector3d> zero(body.rest.size(), Vector3d::Zero());
    return {zero, zero};
}

void prescribe(std::span<const PrescribedNode> nodes, State& state) {
    for (const PrescribedNode& p : nodes) {
        for (unsigned axis = 0; axis < 3; ++axis) {
            if (p.axes >> axis & 1) {
                state.u[p.node][axis] = p.displacement[axis];
                state.v[p.node][axis] = p.velocity[axis];
            }
        }
    }
}

// v <- (v + dt (f/m + g)) / (1 + dt c),  u <- u + dt v
void semi_implicit_euler_step(const Body& body, const StepParameters& parameters,
                              std::span<const PrescribedNode> prescribed, State& state) {
    const double dt = parameters.time_step;
    const Vector3d g(parameters.acceleration[0], parameters.acceleration[1], parameters.acceleration[2]);
    const std::vector<Vector3d> f = forces(body, state.u);
    for (std::size_t n = 0; n < body.rest.size(); ++n) {
        state.v[n] = (state.v[n] + dt * (f[n] / body.mass[n] + g)) / (1 + dt * parameters.mass_damping);
        state.u[n] += dt * state.v[n];
    }
    prescribe(prescribed, state);
}

// v <- q v + (1 - q)/c (f/m + g), q = e^(-c dt/2); u <- u + dt v; v once more
void leapfrog_step(const Body& body, const StepParameters& parameters, std::span<const PrescribedNode> prescribed,
                   State& state) {
    const double dt = parameters.time_step, c = parameters.mass_damping, q = std::exp(-c * dt / 2);
    const Vector3d g(parameters.acceleration[0], parameters.acceleration[1], parameters.acceleration[2]);
    const auto half_kick = [&] {
        const std::vector<Vector3d> f = forces(body, state.u);
        for (std::size_t n = 0; n < body.rest.size(); ++n) {
            state.v[n] = q * state.v[n] + (c > 0 ? -std::expm1(-c * dt / 2) / c : dt / 2) * (f[n] / body.mass[n] + g);
        }
    };
    half_kick();
    for (std::size_t n = 0; n < body.rest.size(); ++n) {
        state.u[n] += dt * state.v[n];
    }
    prescribe(prescribed, state);
    half_kick();
    prescribe(prescribed, state);
}

// T = 1/2 sum m v.v
double kinetic_energy(const Body& body, const State& state) {
    double sum = 0;
    for (std::size_t n = 0; n < body.rest.size(); ++n) {
        sum += 0.5 * body.mass[n] * state.v[n].squaredNorm();
    }
    return sum;
}

} // namespace hybmss::reference
