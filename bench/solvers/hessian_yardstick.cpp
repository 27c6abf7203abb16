#include "bench/yardstick.hpp"

namespace hybmss::bench {
namespace {

/// Of point_of(node). Not shared with the step: inlined there it would make that yardstick a fifth faster than the code
/// that every ratio so far was taken against.
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
        const auto [a, b, c] = mean_edges(cell.nodes, [&](std::size_t n) { return body.nodes[n].position; });
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

void hessian_product(const Yardstick& body, const std::vector<Vector3>& direction, std::vector<Vector3>& product) {
    product.assign(body.nodes.size(), {});
    add_spring_products(body, direction, product);
    add_volume_products(body, direction, product);
}

} // namespace hybmss::bench
