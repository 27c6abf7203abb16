#include "reference/spring_energy.hpp"

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
    const Vector3d d = rest_vector + du;
    const Vector3d n = d / bounded_length(d, rest_vector.norm());
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

} // namespace hybmss::reference
