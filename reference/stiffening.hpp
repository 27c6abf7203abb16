#pragma once

/// \file
/// What a spring of stiffness k (N/m) has beyond its linear law: its stiffening energy, and a dashpot beside it. The
/// rest vector is r, du = u_b - u_a, e = |d|/l - 1, g(e) = quadratic e^2 + cubic e^3.

#include "reference/body.hpp"

namespace hybmss::reference {

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
