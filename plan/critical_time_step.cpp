#include "plan/critical_time_step.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hybmss {
namespace {

using Matrix24 = Eigen::Matrix<double, 24, 24>;
using Eigen::Vector3d;

Vector3d corner_position(int corner) {
    return {static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1), static_cast<double>(corner >> 2)};
}

/// The stiffness matrix at rest of one cell with its shares of the springs: k n n^T for each, and
/// kappa/V0 (dV'/dx)(dV'/dx)^T, dV'/dx_i = h^2/4 (+-1, +-1, +-1).
Matrix24 cell_stiffness(const Material& material, double h) {
    const SpringConstants constants = spring_constants(material, h);
    Matrix24 stiffness = Matrix24::Zero();
    Eigen::Matrix<double, 24, 1> gradient;
    for (int a = 0; a < 8; ++a) {
        gradient.segment<3>(3 * a) = h * h / 4 * (2 * corner_position(a) - Vector3d::Ones());
        for (int b = a + 1; b < 8; ++b) {
            const Vector3d r = corner_position(b) - corner_position(a);
            const double length2 = r.squaredNorm();
            const double k = length2 == 1   ? constants.edge / 4
                             : length2 == 2 ? constants.face_diagonal / 2
                                            : constants.cube_diagonal;
            const Eigen::Matrix3d block = k / length2 * r * r.transpose();
            stiffness.block<3, 3>(3 * a, 3 * a) += block;
            stiffness.block<3, 3>(3 * b, 3 * b) += block;
            stiffness.block<3, 3>(3 * a, 3 * b) -= block;
            stiffness.block<3, 3>(3 * b, 3 * a) -= block;
        }
    }
    if (resolved_volume_energy(material) != VolumeEnergy::none) {
        stiffness += volume_modulus(material) / (h * h * h) * gradient * gradient.transpose();
    }
    return stiffness;
}

double step_for(double omega2) {
    return omega2 > 0 ? 2 / std::sqrt(omega2) : std::numeric_limits<double>::infinity();
}

} // namespace

double lattice_critical_time_step(const Lattice& lattice, const Material& material) {
    const double h = lattice.cell_size();
    const Eigen::SelfAdjointEigenSolver<Matrix24> solver(cell_stiffness(material, h), Eigen::EigenvaluesOnly);
    const auto scales = lattice.cell_scales();
    const double largest_scale = static_cast<double>(*std::max_element(scales.begin(), scales.end()));
    return step_for(largest_scale * solver.eigenvalues().maxCoeff() / (material.density * h * h * h / 8));
}

double network_critical_time_step(const Network& network) {
    std::vector<double> row_sum(network.masses.size(), 0.0);
    for (const Network::Spring& s : network.springs) {
        row_sum[static_cast<std::size_t>(s.a)] += 2 * s.stiffness;
        row_sum[static_cast<std::size_t>(s.b)] += 2 * s.stiffness;
    }
    for (const Network::Cell& cell : network.cells) {
        Eigen::Matrix3d edges = Eigen::Matrix3d::Zero();
        for (int corner = 0; corner < 8; ++corner) {
            const auto node = static_cast<std::size_t>(cell.nodes[static_cast<std::size_t>(corner)]);
            const Vector3d x(network.rest_positions[node].data());
            edges += x * ((2 * corner_position(corner) - Vector3d::Ones()) / 4).transpose();
        }
        const Vector3d a = edges.col(0), b = edges.col(1), c = edges.col(2);
        const double volume = a.dot(b.cross(c));
        double sum = 0;
        double norm[8];
        for (int corner = 0; corner < 8; ++corner) {
            const Vector3d sign = 2 * corner_position(corner) - Vector3d::Ones();
            norm[corner] = (sign[0] * b.cross(c) + sign[1] * c.cross(a) + sign[2] * a.cross(b)).norm() / 4;
            sum += norm[corner];
        }
        for (int corner = 0; corner < 8; ++corner) {
            const auto node = static_cast<std::size_t>(cell.nodes[static_cast<std::size_t>(corner)]);
            row_sum[node] += std::abs(cell.kappa) / volume * norm[corner] * sum;
        }
    }
    double largest = 0;
    for (std::size_t n = 0; n < row_sum.size(); ++n) {
        largest = std::max(largest, row_sum[n] / network.masses[n]);
    }
    return step_for(largest);
}

double contact_time_step(double body_time_step, std::span<const Obstacle> obstacles) {
    const double automatic = 1 / (body_time_step * body_time_step);
    double omega2 = 4 * automatic;
    for (const Obstacle& obstacle : obstacles) {
        omega2 += obstacle.stiffness > 0 ? obstacle.stiffness : automatic;
    }
    return omega2 > 0 ? 2 / std::sqrt(omega2) : std::numeric_limits<double>::infinity();
}

} // namespace hybmss
