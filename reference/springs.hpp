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

/// k (n . dv) n: the force on end a, N, of a dashpot k (N s/m) whose ends move by dv = v_b - v_a (m/s).
Vector3d dashpot_force(double damping, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& dv);

} // namespace hybmss::reference
