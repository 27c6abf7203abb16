#pragma once

/// \file
/// Springs: one, and those of a cell on its means.
///
/// One spring of stiffness k (N/m) with the rest vector r, its ends displaced relative to each other by du = u_b - u_a.
/// Displacement form: relative accuracy holds at any strain. Coincident ends give finite values and zero force.

#include "reference/body.hpp"
#include "reference/volume_energy.hpp"

#include <array>

namespace hybmss::reference {

/// The springs of a cell of edge 1: the 13 vectors to neighbours in a lattice, one of r and -r each.
std::array<Vector3d, 13> spring_vectors();

/// |d| - l, m, with d = r + du and l = |r|.
double elongation(const Vector3d& rest_vector, const Vector3d& du);

/// J.
double spring_energy(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// The force on end a, N; end b feels the opposite.
Vector3d spring_force(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// d^2 W / du^2, N/m: minus the derivative of end b's force with respect to du.
Matrix3d spring_hessian(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// The force's magnitude, N, with every term that may cancel inside it taken by its absolute value: rounding errors of
/// a computed force are a small multiple of epsilon of this. `size` is |du|, component by component, or larger where du
/// itself is a sum of terms that cancel.
double spring_force_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& size);

/// The same for H (p_b - p_a), H the second derivative: what rounding du and d once changes it by is a small multiple
/// of epsilon of this. `size_of_dp` is |p_b - p_a| like `size`.
double spring_product_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& size,
                            const Vector3d& size_of_dp);

// What a spring has beyond its linear law: with e = |d|/l - 1 and g(e) = quadratic e^2 + cubic e^3 its stiffening, and
// a dashpot beside it.

/// k l^2 (quadratic e^3/3 + cubic e^4/4), J.
double stiffening_energy(const SpringStiffening& law, double stiffness, const Vector3d& rest_vector,
                         const Vector3d& du);

/// k l g(e) n: the force on end a, N; end b feels the opposite.
Vector3d stiffening_force(const SpringStiffening& law, double stiffness, const Vector3d& rest_vector,
                          const Vector3d& du);

/// The energy's second derivative with respect to du, N/m.
Matrix3d stiffening_hessian(const SpringStiffening& law, double stiffness, const Vector3d& rest_vector,
                            const Vector3d& du);

/// By how much the rounding of a strain, which the linear law passes on as it is, grows by stiffening.
double stiffening_scale(const SpringStiffening& law, const Vector3d& rest_vector, const Vector3d& du);

/// k (n . dv) n: the force on end a, N, of a dashpot k (N s/m) whose ends move by dv = v_b - v_a (m/s).
Vector3d dashpot_force(double damping, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& dv);

// HybMSS-M: the springs of one cell act on its mean edge vectors a, b, c (5.14) instead of between its nodes: three on
// a, b, c, six on the sums and differences of two, four on those of all three, each whole. In every homogeneous
// deformation that is the energy of HybMSS. What a, b, c do not see of eight corners are four patterns; with s = -1, +1
// at the low and the high side of an axis,
//
//     g_1 = 1/8 sum s_y s_z x,  g_2 = 1/8 sum s_x s_z x,  g_3 = 1/8 sum s_x s_y x,  g_4 = 1/8 sum s_x s_y s_z x
//
// zero at rest and in homogeneous deformations. They have an energy of their own, with a_1, a_2, a_3 = a, b, c:
//
//     P_ij = g_i . a_j / h,
//     W_h  = sum over i < j of 1/2 k_b (P_ij^2 + P_ji^2 + 2 nu P_ij P_ji)
//            + 1/2 k_t [ alpha (P_11^2 + P_22^2 + P_33^2) + beta (P_11 + P_22 + P_33)^2 ] + 1/2 k_4 |g_4|^2
//
// P_31 is h^2/4 times the slope along y of the Green strain along x in the middle of the cell: no rotation changes it.

/// J, at the corner displacements u, m.
double mean_spring_energy(const SpringStiffening& law, const MeanSprings& cell, const Corners& u);

/// The forces on the corners, N.
Corners mean_spring_forces(const SpringStiffening& law, const MeanSprings& cell, const Corners& u);

/// The forces on the corners, N, of dashpots of `stiffness_damping` (s) times the stiffness of springs and patterns
/// beside them, at the corner velocities v, m/s.
Corners mean_spring_damping_forces(const MeanSprings& cell, double stiffness_damping, const Corners& u,
                                   const Corners& v);

/// The second derivatives, N/m.
Matrix24d mean_spring_hessian(const SpringStiffening& law, const MeanSprings& cell, const Corners& u);

/// The magnitude of a corner's force, N, with the terms that may cancel inside it taken by their absolute values.
double mean_spring_force_scale(const SpringStiffening& law, const MeanSprings& cell, const Corners& u);

/// The same for the product of mean_spring_hessian and the corners' p, N.
double mean_spring_product_scale(const SpringStiffening& law, const MeanSprings& cell, const Corners& u,
                                 const Corners& p);

} // namespace hybmss::reference
