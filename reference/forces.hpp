#pragma once

/// \file
/// Energy, forces and second derivatives of a whole body at nodal displacements u = x - X (m, one a node).

#include "reference/body.hpp"
#include "reference/volume_energy.hpp"

#include <Eigen/SparseCore>

#include <array>
#include <span>
#include <vector>

namespace hybmss::reference {

/// J.
struct Energy {
    double springs = 0;
    double volume = 0;
    double total() const { return springs + volume; }
};

Energy energy(const Body& body, std::span<const Vector3d> u);
/// What one of a body's sums of polyhedra's volumes has in it, J.
double volume_sum_energy(const Body& body, const VolumeSum& volumes, std::span<const Vector3d> u);

/// Internal forces -dW/du, N, one a node.
std::vector<Vector3d> forces(const Body& body, std::span<const Vector3d> u);

/// Forces, N, of dashpots of `stiffness_damping` (s) times the springs' stiffness beside them, at the velocities v
/// (m/s).
std::vector<Vector3d> damping_forces(const Body& body, double stiffness_damping, std::span<const Vector3d> u,
                                     std::span<const Vector3d> v);

/// Forces, N, of a pressure of 1 Pa on the bilinear face with these corners (m), counter-clockwise seen from the side
/// that it pushes from: f_a = - integral of N_a dx/ds x dx/dt.
std::array<Vector3d, 4> pressure_forces(const std::array<Vector3d, 4>& corners);

/// m^3 of a cell whose points go linearly along each axis between its corners, by the bits of their number.
double trilinear_volume(const Corners& corners);

/// For each node the sum, N, of the magnitudes of all spring and volume forces on it, with what cancels inside each of
/// them taken by absolute values too: the scale that rounding errors of computed forces are measured by.
std::vector<double> force_scale(const Body& body, std::span<const Vector3d> u);

/// K p with K = d^2 W / du^2, N for p in m.
std::vector<Vector3d> hessian_product(const Body& body, std::span<const Vector3d> u, std::span<const Vector3d> p);

/// For each node the scale, N, of the rounding errors of a computed K p, like force_scale.
std::vector<double> hessian_product_scale(const Body& body, std::span<const Vector3d> u, std::span<const Vector3d> p);

/// The 3x3 blocks on K's diagonal, N/m, one a node.
std::vector<Matrix3d> hessian_diagonal(const Body& body, std::span<const Vector3d> u);

/// K itself, N/m; row and column 3 node + axis.
Eigen::SparseMatrix<double> hessian(const Body& body, std::span<const Vector3d> u);

} // namespace hybmss::reference
