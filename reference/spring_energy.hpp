#pragma once

/// \file
/// One spring of stiffness k (N/m) with the rest vector r, its ends displaced relative to each other by du = u_b - u_a.
/// Displacement form: relative accuracy holds at any strain. Coincident ends give finite values and zero force.

#include "reference/body.hpp"

namespace hybmss::reference {

/// |d| - l, m, with d = r + du and l = |r|.
double elongation(const Vector3d& rest_vector, const Vector3d& du);

/// J.
double spring_energy(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// The force on end a, N; end b feels the opposite.
Vector3d spring_force(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// d^2 W / du^2, N/m: minus the derivative of end b's force with respect to du.
Matrix3d spring_hessian(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// The force's magnitude, N, with every term that may cancel inside it taken by its absolute value: rounding errors of
/// a computed force are a small multiple of epsilon of this.
double spring_force_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du);

/// The same for H (p_b - p_a), H the second derivative: what rounding du and d once changes it by is a small multiple
/// of epsilon of this. `dp` is p_b - p_a.
double spring_product_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& dp);

} // namespace hybmss::reference
