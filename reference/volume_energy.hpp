#pragma once

/// \file
/// The volume energy kappa V0 phi(J) of one hexahedral cell, J = V'/V0. All in terms of j = J - 1, so that small volume
/// changes keep their digits.

#include "reference/body.hpp"

#include <array>
#include <span>
#include <vector>

namespace hybmss::reference {

/// Corner positions or displacements of a cell, in corner order.
using Corners = std::array<Vector3d, 8>;
using Matrix24d = Eigen::Matrix<double, 24, 24>;

/// +1 on the high side of the axis, -1 on the low side.
double side(std::size_t corner, std::size_t axis);

/// phi(J) and its first three derivatives at J = 1 + j. `energy` is quadratic or mean_stretch (`none` gives zero).
double phi(VolumeEnergy energy, double j);
double phi_derivative(VolumeEnergy energy, double j);
double phi_second_derivative(VolumeEnergy energy, double j);
double phi_third_derivative(VolumeEnergy energy, double j);

/// (5.14): columns a, b, c, each the mean of four parallel edges. Linear: displacements give the edges' change.
Matrix3d mean_edges(const Corners& corners);

/// The same of the absolute changes of the edges by the displacements u.
Matrix3d mean_edge_sizes(const Corners& u);

/// (5.13): V' = a . (b x c), m^3.
double volume(const Matrix3d& edges);

/// J - 1 from the rest edges and their change, without cancellation.
double volume_ratio_change(const Matrix3d& rest_edges, const Matrix3d& edge_change);

/// dV'/dx_i for each corner, m^2: (5.16) with the factor 1/4 that the printed paper lacks.
Corners volume_gradient(const Matrix3d& edges);

/// d^2 V'/dx_i dx_j, m; row and column 3 corner + axis.
Matrix24d volume_hessian(const Matrix3d& edges);

/// The energy of a cell's volume by its rest volume, Pa: kappa phi(J), and below J0 what resists being crushed.
double volume_energy_density(VolumeEnergy energy, const Cell& cell, double j);

/// Its derivatives by J, Pa.
struct VolumeDerivatives {
    double first, second, third;
};
VolumeDerivatives volume_derivatives(VolumeEnergy energy, const Cell& cell, double j);

// ---- polyhedra: corners as many as their nodes

/// V', m^3.
double polyhedron_volume(const Polyhedron& polyhedron, std::span<const Vector3d> corners);

/// V' - V, m^3, from the rest positions and the displacements, without cancellation; and the sum of its terms' sizes.
struct VolumeChange {
    double change, size;
};
VolumeChange polyhedron_volume_change(const Polyhedron& polyhedron, std::span<const Vector3d> rest,
                                      std::span<const Vector3d> u);

/// dV'/dx_i of each corner, m^2.
std::vector<Vector3d> polyhedron_gradient(const Polyhedron& polyhedron, std::span<const Vector3d> corners);

/// d^2 V'/dx_i dx_j, m; row and column 3 corner + axis.
Eigen::MatrixXd polyhedron_hessian(const Polyhedron& polyhedron, std::span<const Vector3d> corners);

// ----

/// The cell's energy, J, at the corner displacements u, m.
double cell_energy(VolumeEnergy energy, const Cell& cell, const Corners& u);

/// The forces on the corners, N.
Corners cell_forces(VolumeEnergy energy, const Cell& cell, const Corners& u);

/// The second derivatives of the cell's energy, N/m.
Matrix24d cell_hessian(VolumeEnergy energy, const Cell& cell, const Corners& u);

/// The magnitude of a corner's force, N, with the terms that may cancel inside it taken by their absolute values.
double cell_force_scale(VolumeEnergy energy, const Cell& cell, const Corners& u);

/// The same for the product of cell_hessian and the corners' p, N.
double cell_product_scale(VolumeEnergy energy, const Cell& cell, const Corners& u, const Corners& p);

} // namespace hybmss::reference
