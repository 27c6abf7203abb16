#include "bench/yardstick.hpp"

#include <cmath>
#include <cstddef>

namespace hybmss::bench {
namespace {

Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

Vector3 operator*(double s, const Vector3& a) {
    return {s * a.x, s * a.y, s * a.z};
}

double dot(const Vector3& a, const Vector3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The three edge vectors of a cell, each the mean of its four parallel edges.
struct MeanEdges {
    Vector3 a, b, c;
};

template <class PointOf>
MeanEdges mean_edges(const std::array<int, 8>& corners, const PointOf& point_of) {
    Vector3 p[8];
    for (std::size_t corner = 0; corner < 8; ++corner) {
        p[corner] = point_of(static_cast<std::size_t>(corners[corner]));
    }
    return {0.25 * ((p[1] - p[0]) + (p[3] - p[2]) + (p[5] - p[4]) + (p[7] - p[6])),
            0.25 * ((p[2] - p[0]) + (p[3] - p[1]) + (p[6] - p[4]) + (p[7] - p[5])),
            0.25 * ((p[4] - p[0]) + (p[5] - p[1]) + (p[6] - p[2]) + (p[7] - p[3]))};
}

MeanEdges mean_edges(const std::vector<YardstickNode>& nodes, const std::array<int, 8>& corners) {
    return mean_edges(corners, [&](std::size_t n) { return nodes[n].position; });
}

/// phi'(J) of the volume energy kappa V0 phi(J).
double volume_energy_derivative(VolumeEnergy energy, double volume_ratio) {
    if (energy == VolumeEnergy::mean_stretch) {
        if (volume_ratio < 0.125) {
            return -6.0;
        }
        const double stretch = std::cbrt(volume_ratio);
        return 3.0 * (stretch - 1.0) / (stretch * stretch);
    }
    return volume_ratio - 1.0;
}

double volume_energy_second_derivative(VolumeEnergy energy, double volume_ratio) {
    if (energy == VolumeEnergy::mean_stretch) {
        if (volume_ratio < 0.125) {
            return 0.0;
        }
        const double stretch = std::cbrt(volume_ratio);
        return (2.0 - stretch) / (stretch * stretch * stretch * stretch * stretch);
    }
    return 1.0;
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

/// (K p)_b = k [ t (p_b - p_a) + (1 - t) n (n . (p_b - p_a)) ], t = 1 - l/|d|, n = d/|d|; (K p)_a = -(K p)_b.
void add_spring_products(const Yardstick& body, const std::vector<Vector3>& direction, std::vector<Vector3>& product) {
    for (const YardstickSpring& spring : body.springs) {
        const auto a = static_cast<std::size_t>(spring.a), b = static_cast<std::size_t>(spring.b);
        const Vector3 d = body.nodes[b].position - body.nodes[a].position;
        const double length = std::sqrt(dot(d, d)), t = 1.0 - spring.rest_length / length;
        const Vector3 n = (1.0 / length) * d, p = direction[b] - direction[a];
        const Vector3 change = (spring.stiffness * t) * p + (spring.stiffness * (1.0 - t) * dot(n, p)) * n;
        product[a] = product[a] - change;
        product[b] = product[b] + change;
    }
}

/// (K p)_i = kappa [ phi''/V0 dV dV/dx_i + phi' d(dV/dx_i) ], d the change by p.
void add_volume_products(const Yardstick& body, const std::vector<Vector3>& direction, std::vector<Vector3>& product) {
    for (const YardstickCell& cell : body.cells) {
        const auto [a, b, c] = mean_edges(body.nodes, cell.nodes);
        const auto [pa, pb, pc] = mean_edges(cell.nodes, [&](std::size_t n) { return direction[n]; });
        const Vector3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
        const double volume_ratio = dot(a, bc) / cell.rest_volume;
        const double along = 0.25 * cell.kappa * volume_energy_second_derivative(body.volume_energy, volume_ratio) /
                             cell.rest_volume * (dot(pa, bc) + dot(pb, ca) + dot(pc, ab));
        const double pressure = 0.25 * cell.kappa * volume_energy_derivative(body.volume_energy, volume_ratio);
        const Vector3 x = along * bc + pressure * (cross(pb, c) + cross(b, pc));
        const Vector3 y = along * ca + pressure * (cross(pc, a) + cross(c, pa));
        const Vector3 z = along * ab + pressure * (cross(pa, b) + cross(a, pb));
        for (std::size_t corner = 0; corner < 8; ++corner) {
            Vector3& sum = product[static_cast<std::size_t>(cell.nodes[corner])];
            sum = corner & 1 ? sum + x : sum - x;
            sum = corner & 2 ? sum + y : sum - y;
            sum = corner & 4 ? sum + z : sum - z;
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

void hessian_product(const Yardstick& body, const std::vector<Vector3>& direction, std::vector<Vector3>& product) {
    product.assign(body.nodes.size(), {});
    add_spring_products(body, direction, product);
    add_volume_products(body, direction, product);
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
