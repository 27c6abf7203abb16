#include "bench/yardstick.hpp"

#include <cmath>
#include <cstddef>

namespace hybmss::bench {
namespace {

MeanEdges mean_edges(const std::vector<YardstickNode>& nodes, const std::array<int, 8>& corners) {
    Vector3 p[8];
    for (std::size_t corner = 0; corner < 8; ++corner) {
        p[corner] = nodes[static_cast<std::size_t>(corners[corner])].position;
    }
    return {0.25 * ((p[1] - p[0]) + (p[3] - p[2]) + (p[5] - p[4]) + (p[7] - p[6])),
            0.25 * ((p[2] - p[0]) + (p[3] - p[1]) + (p[6] - p[4]) + (p[7] - p[5])),
            0.25 * ((p[4] - p[0]) + (p[5] - p[1]) + (p[6] - p[2]) + (p[7] - p[3]))};
}

/// f_a = k (1 - l/|d|) d, d = x_b - x_a; f_b = -f_a.
void add_spring_forces(Yardstick& body) {
    for (const YardstickSpring& spring : body.springs) {
        YardstickNode& a = body.nodes[static_cast<std::size_t>(spring.a)];
        YardstickNode& b = body.nodes[static_cast<std::size_t>(spring.b)];
        const Vector3 d = b.position - a.position;
        const Vector3 force = spring.stiffness * (1.0 - spring.rest_length / std::sqrt(dot(d, d))) * d;
        a.force = a.force + force;
        b.force = b.force - force;
    }
}

/// f_i = -kappa phi'(J) dV/dx_i, dV/dx_i = (+-(b x c) +- (c x a) +- (a x b)) / 4.
void add_volume_forces(Yardstick& body) {
    for (const YardstickCell& cell : body.cells) {
        const auto [a, b, c] = mean_edges(body.nodes, cell.nodes);
        const Vector3 bc = cross(b, c);
        const double volume_ratio = dot(a, bc) / cell.rest_volume;
        const double pressure = -0.25 * cell.kappa * volume_energy_derivative(body.volume_energy, volume_ratio);
        const Vector3 x = pressure * bc;
        const Vector3 y = pressure * cross(c, a);
        const Vector3 z = pressure * cross(a, b);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            YardstickNode& node = body.nodes[static_cast<std::size_t>(cell.nodes[corner])];
            node.force = corner & 1 ? node.force + x : node.force - x;
            node.force = corner & 2 ? node.force + y : node.force - y;
            node.force = corner & 4 ? node.force + z : node.force - z;
        }
    }
}

} // namespace

Yardstick make_yardstick(const Network& network) {
    Yardstick body;
    body.volume_energy = network.volume_energy;
    body.nodes.reserve(network.rest_positions.size());
    for (std::size_t n = 0; n < network.rest_positions.size(); ++n) {
        const auto& x = network.rest_positions[n];
        body.nodes.push_back({{x[0], x[1], x[2]}, {}, {}, network.masses[n]});
    }
    body.springs.reserve(network.springs.size());
    for (const Network::Spring& spring : network.springs) {
        const auto& r = spring.rest_vector;
        body.springs.push_back({spring.a, spring.b, spring.stiffness, std::hypot(r[0], r[1], r[2])});
    }
    body.cells.reserve(network.cells.size());
    for (const Network::Cell& cell : network.cells) {
        const auto [a, b, c] = mean_edges(body.nodes, cell.nodes);
        body.cells.push_back({cell.nodes, cell.kappa, dot(a, cross(b, c))});
    }
    return body;
}

void compute_forces(Yardstick& body) {
    for (YardstickNode& node : body.nodes) {
        node.force = {};
    }
    add_spring_forces(body);
    add_volume_forces(body);
}

void step(Yardstick& body, double time_step, double mass_damping) {
    compute_forces(body);
    const double decay = 1.0 / (1.0 + time_step * mass_damping);
    for (YardstickNode& node : body.nodes) {
        node.velocity = decay * (node.velocity + (time_step / node.mass) * node.force);
        node.position = node.position + time_step * node.velocity;
    }
}

} // namespace hybmss::bench
