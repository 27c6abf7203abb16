#include "reference/homogeneous_lattice.hpp"

#include "reference/body.hpp"
#include "reference/constants.hpp"
#include "reference/springs.hpp"
#include "reference/volume_energy.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace hybmss::reference {

HomogeneousLattice::HomogeneousLattice(const Material& material, const Matrix3d& deformation)
    : deformation_(deformation), form_(material.springs),
      hourglass_(reference::hourglass_stiffness(material.young_modulus, material.poisson_ratio, 1)),
      volume_energy_(resolve_volume_energy(material)), cell_{{},
                                                             Matrix3d::Identity(),
                                                             kappa(material.young_modulus, material.poisson_ratio),
                                                             material.crush.stiffness *
                                                                 shear_modulus(material.young_modulus,
                                                                               material.poisson_ratio),
                                                             material.crush.ratio} {
    const double g = shear_modulus(material.young_modulus, material.poisson_ratio);
    const double ratio = material.face_diagonal_ratio;
    const double stiffness[] = {edge_stiffness(g, ratio, 1), face_diagonal_stiffness(g, ratio, 1),
                                cube_diagonal_stiffness(g, ratio, 1)};
    std::size_t s = 0;
    for (const Vector3d& r : spring_vectors()) {
        const double k = stiffness[std::lround(r.squaredNorm()) - 1];
        const Vector3d du = deformation * r - r;
        springs_[s++] = {r, spring_hessian(k, r, du), spring_force(k, r, du), spring_energy(k, r, du)};
    }
    const Vector3d a = deformation.col(0), b = deformation.col(1), c = deformation.col(2);
    cofactor_ << b.cross(c), c.cross(a), a.cross(b);
}

// W = sum over the 13 spring vectors + w(det F), w = kappa phi and what resists being crushed
double HomogeneousLattice::energy_density() const {
    const double j = volume_ratio_change(Matrix3d::Identity(), deformation_ - Matrix3d::Identity());
    double sum = volume_energy_density(volume_energy_, cell_, j);
    for (const SpringVector& spring : springs_) {
        sum += spring.energy;
    }
    return sum;
}

// P = sum k t d r^T + w'(J) cof F
Matrix3d HomogeneousLattice::stress() const {
    const double j = volume_ratio_change(Matrix3d::Identity(), deformation_ - Matrix3d::Identity());
    Matrix3d sum = volume_derivatives(volume_energy_, cell_, j).first * cofactor_;
    for (const SpringVector& spring : springs_) {
        sum += spring.tension * spring.rest.transpose();
    }
    return sum;
}

// Springs: 2 (1 - cos q.r) k [t I + (1 - t) n n^T] for each of the 13 vectors.
// Cells: the edges change by da_e = 2 i s_e U with s_x = sin(qx/2) cos(qy/2) cos(qz/2), likewise s_y and s_z (5.14), so
//   w''/V0 v v^T,  v = 2 (s_x b x c + s_y c x a + s_z a x b),
// and springs on means change by dd = 2 i (r.s) U: 4 (r.s)^2 k [t I + (1 - t) n n^T].
// The term of w' d^2 V' drops out: s_e s_f is symmetric in e and f and d^2 V'/de df is antisymmetric.
Matrix3d HomogeneousLattice::wave_stiffness(const Vector3d& phase) const {
    const Vector3d sine = (phase / 2).array().sin(), cosine = (phase / 2).array().cos();
    const Vector3d s(sine.x() * cosine.y() * cosine.z(), sine.y() * cosine.z() * cosine.x(),
                     sine.z() * cosine.x() * cosine.y());
    Matrix3d sum = Matrix3d::Zero();
    for (const SpringVector& spring : springs_) {
        // 1 - cos q = 2 sin^2(q/2), without cancellation
        const bool on_means = form_ == SpringForm::means;
        const double half = on_means ? s.dot(spring.rest) : std::sin(phase.dot(spring.rest) / 2);
        sum += 4 * half * half * spring.hessian;
    }
    if (form_ == SpringForm::means) {
        sum += hourglass_stiffness(sine, cosine);
    }
    const double j = volume_ratio_change(Matrix3d::Identity(), deformation_ - Matrix3d::Identity());
    const Vector3d v = 2 * cofactor_ * s;
    return sum + volume_derivatives(volume_energy_, cell_, j).second * v * v.transpose();
}

// The patterns change by dg_i = -c_i U with c_1 = cos(qx/2) sin(qy/2) sin(qz/2), likewise c_2 and c_3; they are zero
// before, so dP_ij = c_i a_j.U (reference/springs.hpp); and |dg_4| = sin(qx/2) sin(qy/2) sin(qz/2) |U|.
Matrix3d HomogeneousLattice::hourglass_stiffness(const Vector3d& sine, const Vector3d& cosine) const {
    const Vector3d c(cosine.x() * sine.y() * sine.z(), cosine.y() * sine.z() * sine.x(),
                     cosine.z() * sine.x() * sine.y());
    Matrix3d sum = hourglass_.fourth * std::pow(sine.prod(), 2) * Matrix3d::Identity();
    for (Eigen::Index i = 0; i < 3; ++i) {
        for (Eigen::Index j = 0; j < 3; ++j) {
            const Vector3d a = c[i] * deformation_.col(j), transposed = c[j] * deformation_.col(i);
            const Vector3d own = c[i] * deformation_.col(i), other = c[j] * deformation_.col(j);
            if (i == j) {
                sum += hourglass_.twisting * a * a.transpose();
            } else {
                sum += hourglass_.bending * a * a.transpose() + hourglass_.coupling * a * transposed.transpose();
            }
            sum += hourglass_.twist_sum * own * other.transpose();
        }
    }
    return sum;
}

// Q(n) = sum (n.r)^2 k [t I + (1 - t) n_d n_d^T] + w'' v v^T,  v = cof(F) n
Matrix3d HomogeneousLattice::acoustic_tensor(const Vector3d& direction) const {
    Matrix3d sum = Matrix3d::Zero();
    for (const SpringVector& spring : springs_) {
        sum += std::pow(direction.dot(spring.rest), 2) * spring.hessian;
    }
    const double j = volume_ratio_change(Matrix3d::Identity(), deformation_ - Matrix3d::Identity());
    const Vector3d v = cofactor_ * direction;
    return sum + volume_derivatives(volume_energy_, cell_, j).second * v * v.transpose();
}

} // namespace hybmss::reference
