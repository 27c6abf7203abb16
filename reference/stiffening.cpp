#include "reference/stiffening.hpp"

#include "reference/spring_energy.hpp"

#include <algorithm>

namespace hybmss::reference {
namespace {

double strain(const Vector3d& rest_vector, const Vector3d& du) {
    return elongation(rest_vector, du) / rest_vector.norm();
}

/// n, bounded to d / (10^-12 l) where the ends meet.
Vector3d direction(const Vector3d& rest_vector, const Vector3d& du) {
    const Vector3d d = rest_vector + du;
    return d / std::max(d.norm(), 1e-12 * rest_vector.norm());
}

} // namespace

double stiffening_energy(const SpringStiffening& law, double stiffness, const Vector3d& rest_vector,
                         const Vector3d& du) {
    const double e = strain(rest_vector, du);
    return stiffness * rest_vector.squaredNorm() * (law.quadratic * e * e * e / 3 + law.cubic * e * e * e * e / 4);
}

Vector3d stiffening_force(const SpringStiffening& law, double stiffness, const Vector3d& rest_vector,
                          const Vector3d& du) {
    const double e = strain(rest_vector, du);
    return stiffness * rest_vector.norm() * (law.quadratic * e * e + law.cubic * e * e * e) *
           direction(rest_vector, du);
}

// k [ g/(1 + e) (I - n n^T) + g' n n^T ]
Matrix3d stiffening_hessian(const SpringStiffening& law, double stiffness, const Vector3d& rest_vector,
                            const Vector3d& du) {
    const double e = strain(rest_vector, du);
    const double across = (law.quadratic * e * e + law.cubic * e * e * e) / std::max(1 + e, 1e-12);
    const double along = 2 * law.quadratic * e + 3 * law.cubic * e * e;
    const Vector3d n = direction(rest_vector, du);
    const Matrix3d axial = n * n.transpose();
    return stiffness * (across * (Matrix3d::Identity() - axial) + along * axial);
}

Vector3d dashpot_force(double damping, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& dv) {
    const Vector3d n = direction(rest_vector, du);
    return damping * n.dot(dv) * n;
}

} // namespace hybmss::reference
