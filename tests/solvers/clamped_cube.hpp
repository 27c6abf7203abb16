#pragma once

/// \file
/// Cubes between two clamped plates, the plate at the high end of y moved: the experiments of Golec et al., section 6.

#include "hybmss/equilibrium.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace hybmss::testing {

using Vector = std::array<double, 3>;

/// Where the rest position X of a point on the moved plate goes.
using PlateMotion = std::function<Vector(const Vector&)>;

inline PlateMotion translated(const Vector& by) {
    return [by](const Vector& x) { return Vector{x[0] + by[0], x[1] + by[1], x[2] + by[2]}; };
}
/// About the axis through (center, *, center) along y.
inline PlateMotion turned(double degrees, double center) {
    const double angle = degrees * std::acos(-1.0) / 180, c = std::cos(angle), s = std::sin(angle);
    return [=](const Vector& x) {
        const double px = x[0] - center, pz = x[2] - center;
        return Vector{center + c * px + s * pz, x[1], center - s * px + c * pz};
    };
}

/// Rest positions in node order.
inline std::vector<Vector> rest_positions(const Lattice& lattice) {
    std::vector<Vector> positions;
    for (std::uint32_t grid_node : lattice.nodes()) {
        positions.push_back(lattice.rest_position(grid_node));
    }
    return positions;
}

/// The nodes at the low end of y held, those at the high end moved.
inline Loading plates(const Lattice& lattice, const PlateMotion& motion) {
    const std::vector<Vector> rest = rest_positions(lattice);
    const double height = lattice.cells()[1] * lattice.cell_size();
    Loading loading;
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n][1] == 0 || rest[n][1] == height) {
            const Vector to = rest[n][1] == 0 ? rest[n] : motion(rest[n]);
            loading.supports.push_back({static_cast<std::uint32_t>(n),
                                        7,
                                        {to[0] - rest[n][0], to[1] - rest[n][1], to[2] - rest[n][2]},
                                        {0, 0, 0}});
        }
    }
    return loading;
}

/// What is read off at equilibrium.
struct PlateReading {
    Vector force = {0, 0, 0}; ///< on the moved plate, N
    double torque = 0;        ///< on the moved plate about the cube's axis along y, N m
    double volume_change = 0; ///< |sum V' - sum V| / sum V, V' = a . (b x c)
};

inline PlateReading read_plate(const Lattice& lattice, const std::vector<Vector>& u, const std::vector<Vector>& force) {
    const std::vector<Vector> rest = rest_positions(lattice);
    const auto [nx, ny, nz] = lattice.cells();
    const double h = lattice.cell_size(), center_x = nx * h / 2, center_z = nz * h / 2;
    PlateReading reading;
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n][1] == ny * h) {
            for (std::size_t c = 0; c < 3; ++c) {
                reading.force[c] -= force[n][c];
            }
            const double x = rest[n][0] + u[n][0] - center_x, z = rest[n][2] + u[n][2] - center_z;
            reading.torque -= z * force[n][0] - x * force[n][2];
        }
    }
    double volume = 0;
    for (int k = 0; k < nz; ++k) {
        for (int j = 0; j < ny; ++j) {
            for (int i = 0; i < nx; ++i) {
                double edge[3][3] = {};
                for (int corner = 0; corner < 8; ++corner) {
                    const std::size_t n =
                        lattice.grid_node_index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
                    for (int axis = 0; axis < 3; ++axis) {
                        for (std::size_t c = 0; c < 3; ++c) {
                            edge[axis][c] += (corner >> axis & 1 ? 0.25 : -0.25) * (rest[n][c] + u[n][c]);
                        }
                    }
                }
                const auto& [a, b, c] = edge;
                volume += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                          a[2] * (b[0] * c[1] - b[1] * c[0]);
            }
        }
    }
    const double before = nx * ny * nz * h * h * h;
    reading.volume_change = std::abs(volume - before) / before;
    return reading;
}

} // namespace hybmss::testing
