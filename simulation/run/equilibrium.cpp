#include "simulation/run/equilibrium.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {

std::vector<Vector3> support_forces(const NodalForces& forces, std::span<const PrescribedNode> held,
                                    std::span<const Vector3> accelerations) {
    std::vector<Vector3> support(forces.internal.size(), Vector3{0, 0, 0});
    for (std::size_t i = 0; i < held.size(); ++i) {
        const std::size_t n = held[i].node;
        for (std::size_t a = 0; a < 3; ++a) {
            if (held[i].axes >> a & 1) {
                const double inertia =
                    accelerations[i][a] + forces.mass_damping * held[i].velocity[a] - forces.gravity[a];
                support[n][a] = forces.masses[n] * inertia - forces.internal[n][a] - forces.load(n, a);
            }
        }
    }
    return support;
}

double relative_residual(const NodalForces& forces, std::span<const PrescribedNode> held, double floor) {
    double unbalanced = 0, scale = floor;
    std::size_t next = 0;
    for (std::size_t n = 0; n < forces.internal.size(); ++n) {
        const bool is_held = next < held.size() && held[next].node == n;
        const unsigned axes = is_held ? held[next].axes : 0u;
        next += is_held;
        for (std::size_t a = 0; a < 3; ++a) {
            const double weight = forces.masses[n] * forces.gravity[a] + forces.load(n, a);
            const double sum = std::abs(forces.internal[n][a] + weight);
            double& largest = axes >> a & 1 ? scale : unbalanced;
            largest = std::max(largest, sum);
            scale = std::max(scale, std::abs(weight));
        }
    }
    return unbalanced / scale;
}

ProbeReading read_probe(const ProbeNodes& probe, std::span<const Vector3> rest, std::span<const Vector3> displacements,
                        std::span<const Vector3> support) {
    ProbeReading reading;
    reading.name = probe.name;
    const auto count = static_cast<double>(probe.nodes.size());
    for (std::uint32_t n : probe.nodes) {
        const Vector3 &u = displacements[n], &f = support[n];
        Vector3 r{};
        for (std::size_t a = 0; a < 3; ++a) {
            r[a] = rest[n][a] - probe.centroid[a] + u[a];
            reading.force[a] += f[a];
            reading.mean_displacement[a] += u[a] / count;
        }
        reading.torque[0] += r[1] * f[2] - r[2] * f[1];
        reading.torque[1] += r[2] * f[0] - r[0] * f[2];
        reading.torque[2] += r[0] * f[1] - r[1] * f[0];
        reading.max_displacement = std::max(reading.max_displacement, std::hypot(u[0], u[1], u[2]));
    }
    return reading;
}

} // namespace hybmss
