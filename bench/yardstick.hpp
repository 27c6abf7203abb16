#pragma once

/// \file
/// The code that people would write first: double, arrays of structs, one loop over springs, one over cells.
/// Every `ratio_to_reference` of the benchmarks is a speed over this code's, measured in the same run.

#include "hybmss/network.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace hybmss::bench {

struct Vector3 {
    double x = 0, y = 0, z = 0;
};

struct YardstickNode {
    Vector3 position; ///< m
    Vector3 velocity; ///< m/s
    Vector3 force;    ///< N
    double mass;      ///< kg
};

struct YardstickSpring {
    int a, b;
    double stiffness;   ///< N/m
    double rest_length; ///< m
};

struct YardstickCell {
    std::array<int, 8> nodes;
    double kappa;       ///< Pa
    double rest_volume; ///< m^3
};

/// A body at rest, until somebody moves its nodes.
struct Yardstick {
    std::vector<YardstickNode> nodes;
    std::vector<YardstickSpring> springs;
    std::vector<YardstickCell> cells;
    VolumeEnergy volume_energy = VolumeEnergy::quadratic;
};

/// Nodes, springs and cells in the network's order.
Yardstick make_yardstick(const Network& network);

/// Sets every node's force (N) from springs and cells.
void compute_forces(Yardstick& body);

/// Sets `product` (N) to K p with K the second derivatives of the energy at the nodes' positions and p (m) `direction`;
/// both have a vector a node.
void hessian_product(const Yardstick& body, const std::vector<Vector3>& direction, std::vector<Vector3>& product);

/// Semi-implicit Euler with the damping -c m v taken implicitly: v <- (v + dt f/m) / (1 + dt c), then x <- x + dt v.
void step(Yardstick& body, double time_step, double mass_damping);

// What the yardsticks of the step and of the Hessian share.

inline Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

inline Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline Vector3 operator*(double s, const Vector3& a) {
    return {s * a.x, s * a.y, s * a.z};
}

inline double dot(const Vector3& a, const Vector3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The three edge vectors of a cell, each the mean of its four parallel edges.
struct MeanEdges {
    Vector3 a, b, c;
};

/// phi'(J) of the volume energy kappa V0 phi(J).
inline double volume_energy_derivative(VolumeEnergy energy, double volume_ratio) {
    if (energy == VolumeEnergy::mean_stretch) {
        if (volume_ratio < 0.125) {
            return -6.0;
        }
        const double stretch = std::cbrt(volume_ratio);
        return 3.0 * (stretch - 1.0) / (stretch * stretch);
    }
    return volume_ratio - 1.0;
}

} // namespace hybmss::bench
