#include "reference/springs.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::reference {
namespace {

/// |d|, bounded below so that coincident ends have a finite factor in front of d = 0.
double bounded_length(const Vector3d& d, double rest_length) {
    return std::max(d.norm(), 1e-12 * rest_length);
}

/// t = 1 - l/|d| = (|d| - l) / |d|
double relative_elongation(const Vector3d& rest_vector, const Vector3d& du) {
    return elongation(rest_vector, du) / bounded_length(rest_vector + du, rest_vector.norm());
}

/// e = |d|/l - 1
double strain(const Vector3d& rest_vector, const Vector3d& du) {
    return elongation(rest_vector, du) / rest_vector.norm();
}

/// n, bounded to d / (10^-12 l) where the ends meet.
Vector3d direction(const Vector3d& rest_vector, const Vector3d& du) {
    const Vector3d d = rest_vector + du;
    return d / bounded_length(d, rest_vector.norm());
}

} // namespace

// |d| - l = q / (|d| + l),  q = |d|^2 - l^2 = 2 r.du + du.du
double elongation(const Vector3d& rest_vector, const Vector3d& du) {
    const double q = 2 * rest_vector.dot(du) + du.dot(du);
    return q / ((rest_vector + du).norm() + rest_vector.norm());
}

// W = 1/2 k (|d| - l)^2
double spring_energy(double stiffness, const Vector3d& rest_vector, const Vector3d& du) {
    const double e = elongation(rest_vector, du);
    return 0.5 * stiffness * e * e;
}

// (3.1)  f_a = k (1 - l/|d|) d
Vector3d spring_force(double stiffness, const Vector3d& rest_vector, const Vector3d& du) {
    return stiffness * relative_elongation(rest_vector, du) * (rest_vector + du);
}

// k [ t I + (1 - t) n n^T ],  t = 1 - l/|d|,  n = d/|d|
Matrix3d spring_hessian(double stiffness, const Vector3d& rest_vector, const Vector3d& du) {
    const Vector3d n = direction(rest_vector, du);
    const double t = relative_elongation(rest_vector, du);
    return stiffness * (t * Matrix3d::Identity() + (1 - t) * n * n.transpose());
}

// k ( (2 sum |r_i du_i| + du.du) / (|d| + l) + |t| |du| ): the first term is the elongation without its cancellation,
// the second the turn of a short d by the rounding of du.
double spring_force_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du) {
    const double q = 2 * rest_vector.cwiseAbs().dot(du.cwiseAbs()) + du.dot(du);
    const double length = (rest_vector + du).norm() + rest_vector.norm();
    return stiffness * (q / length + std::abs(relative_elongation(rest_vector, du)) * du.norm());
}

// k |dp| ( |t| + y + 3 y |du|/|d| + 3/2 y^3 (2 |du| l + |du|^2) / l^2 ),  y = 1 - t = l/|d|: H's own two terms; the
// turn and the change of length of d, by which (1 - t) n n^T changes three times over; and the rounding of |d|^2/l^2 -
// 1, whose change dt = y^3/2 ds enters there too.
double spring_product_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& dp) {
    const double l = rest_vector.norm(), size = du.norm(), d = bounded_length(rest_vector + du, l);
    const double t = relative_elongation(rest_vector, du), y = 1 - t;
    return stiffness * dp.norm() *
           (std::abs(t) + y + 3 * y * size / d + 1.5 * y * y * y * (2 * l * size + size * size) / (l * l));
}

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
