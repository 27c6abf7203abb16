#include "reference/volume_energy.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace hybmss::reference {
namespace {

Matrix3d cross_matrix(const Vector3d& v) {
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

/// Below J = 1/8 (a mean stretch of one half) the mean-stretch energy goes on linearly.
bool is_crushed(double j) {
    return j < -7.0 / 8.0;
}

/// What the scales of rounding errors are made of: sizes without the cancellation inside them.
struct Magnitudes {
    double j;        ///< J - 1
    double j_terms;  ///< j* below
    Vector3d length; ///< of a, b, c
};

// V0 j* = |da|.|b x c| + |db|.|c x a0| + |dc|.|a0 x b0|, component by component: j* is J - 1 without the cancellation
// inside and between its terms, |da| the mean of the absolute changes of the four edges. An edge that collapses keeps
// the size of its change, which it is rounded by.
Magnitudes magnitudes(const Cell& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u), size = mean_edge_sizes(u), edges = cell.rest_edges + change;
    const Vector3d a0 = cell.rest_edges.col(0), b0 = cell.rest_edges.col(1), b = edges.col(1), c = edges.col(2);
    Magnitudes m;
    m.j = volume_ratio_change(cell.rest_edges, change);
    m.j_terms = (size.col(0).dot(b.cross(c).cwiseAbs()) + size.col(1).dot(c.cross(a0).cwiseAbs()) +
                 size.col(2).dot(a0.cross(b0).cwiseAbs())) /
                volume(cell.rest_edges);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        m.length[axis] = std::max(edges.col(axis).norm(), size.col(axis).norm());
    }
    return m;
}

/// How far below J0 a cell is, J0 - J, or 0.
double crushed_by(const Cell& cell, double j) {
    return cell.crush > 0 ? std::max(cell.crush_ratio - 1 - j, 0.0) : 0;
}

/// `automatic` goes by the cell.
VolumeEnergy energy_of(VolumeEnergy energy, const Cell& cell) {
    const VolumeEnergy own = cell.kappa < 0 ? VolumeEnergy::mean_stretch : VolumeEnergy::quadratic;
    return energy == VolumeEnergy::automatic ? own : energy;
}

// kappa phi(J)
VolumeDerivatives phi_derivatives(VolumeEnergy given, const Cell& cell, double j) {
    const VolumeEnergy energy = energy_of(given, cell);
    return {cell.kappa * phi_derivative(energy, j), cell.kappa * phi_second_derivative(energy, j),
            cell.kappa * phi_third_derivative(energy, j)};
}
// crush (J0 - J)^3 / (3 J0^2)
VolumeDerivatives crush_derivatives(const Cell& cell, double j) {
    const double depth = crushed_by(cell, j);
    if (depth == 0) {
        return {0, 0, 0};
    }
    const double modulus = cell.crush / (cell.crush_ratio * cell.crush_ratio);
    return {-modulus * depth * depth, 2 * modulus * depth, -2 * modulus};
}
/// The sizes of both, which may cancel.
VolumeDerivatives derivative_sizes(VolumeEnergy energy, const Cell& cell, double j) {
    const VolumeDerivatives volume = phi_derivatives(energy, cell, j), crush = crush_derivatives(cell, j);
    return {std::abs(volume.first) + std::abs(crush.first), std::abs(volume.second) + std::abs(crush.second),
            std::abs(volume.third) + std::abs(crush.third)};
}

/// sqrt(|b|^2 |c|^2 + |c|^2 |a|^2 + |a|^2 |b|^2) / 4: the size of a gradient of V'.
double gradient_size(const Vector3d& length) {
    return Vector3d(length[1] * length[2], length[2] * length[0], length[0] * length[1]).norm() / 4;
}

} // namespace

double side(std::size_t corner, std::size_t axis) {
    return corner >> axis & 1 ? 1.0 : -1.0;
}

// quadratic:     phi = 1/2 (J - 1)^2                                       (5.1)
// mean stretch:  phi = 9/2 (cbrt(J) - 1)^2;  below J = 1/8: phi(1/8) - 6 (J - 1/8), phi(1/8) = 9/8
double phi(VolumeEnergy energy, double j) {
    if (energy != VolumeEnergy::mean_stretch) {
        return energy == VolumeEnergy::quadratic ? 0.5 * j * j : 0;
    }
    if (is_crushed(j)) {
        return 9.0 / 8.0 - 6.0 * (j + 7.0 / 8.0);
    }
    const double stretch = std::expm1(std::log1p(j) / 3); // cbrt(J) - 1
    return 4.5 * stretch * stretch;
}

// quadratic:     phi' = J - 1
// mean stretch:  phi' = 3 (c - 1) / c^2, c = cbrt(J);  below J = 1/8: -6
double phi_derivative(VolumeEnergy energy, double j) {
    if (energy != VolumeEnergy::mean_stretch) {
        return energy == VolumeEnergy::quadratic ? j : 0;
    }
    if (is_crushed(j)) {
        return -6;
    }
    const double stretch = std::expm1(std::log1p(j) / 3);
    const double c = 1 + stretch;
    return 3 * stretch / (c * c);
}

// quadratic:     phi'' = 1
// mean stretch:  phi'' = (2 - c) / c^5;  below J = 1/8: 0
double phi_second_derivative(VolumeEnergy energy, double j) {
    if (energy != VolumeEnergy::mean_stretch) {
        return energy == VolumeEnergy::quadratic ? 1 : 0;
    }
    if (is_crushed(j)) {
        return 0;
    }
    const double c = std::cbrt(1 + j);
    return (2 - c) / (c * c * c * c * c);
}

// quadratic:     phi''' = 0
// mean stretch:  phi''' = (4 c - 10) / (3 c^8);  below J = 1/8: 0
double phi_third_derivative(VolumeEnergy energy, double j) {
    if (energy != VolumeEnergy::mean_stretch || is_crushed(j)) {
        return 0;
    }
    const double c = std::cbrt(1 + j);
    return (4 * c - 10) / (3 * std::pow(c, 8));
}

// (5.14)  a = 1/4 sum over corners of +-x, + on the high side of x, - on the low side; b and c likewise in y and z
Matrix3d mean_edges(const Corners& corners) {
    // Differences along each edge first: a common translation then drops out before anything is summed.
    Matrix3d edges = Matrix3d::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t low = 0; low < 8; ++low) {
            const std::size_t high = low | std::size_t{1} << axis; // `low` itself, and no edge, in half of all cases
            edges.col(static_cast<Eigen::Index>(axis)) += (corners[high] - corners[low]) / 4;
        }
    }
    return edges;
}

Matrix3d mean_edge_sizes(const Corners& u) {
    Matrix3d size = Matrix3d::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t low = 0; low < 8; ++low) {
            const std::size_t high = low | std::size_t{1} << axis;
            size.col(static_cast<Eigen::Index>(axis)) += (u[high] - u[low]).cwiseAbs() / 4;
        }
    }
    return size;
}

// (5.13)  V' = a . (b x c)
double volume(const Matrix3d& edges) {
    return edges.col(0).dot(edges.col(1).cross(edges.col(2)));
}

// V0 (J - 1) = a . (b x c) - a0 . (b0 x c0) = da . (b x c) + a0 . (db x c) + a0 . (b0 x dc)
double volume_ratio_change(const Matrix3d& rest_edges, const Matrix3d& edge_change) {
    const Vector3d a0 = rest_edges.col(0), b0 = rest_edges.col(1), c0 = rest_edges.col(2);
    const Vector3d da = edge_change.col(0), db = edge_change.col(1), dc = edge_change.col(2);
    const Vector3d b = b0 + db, c = c0 + dc;
    return (da.dot(b.cross(c)) + a0.dot(db.cross(c)) + a0.dot(b0.cross(dc))) / volume(rest_edges);
}

// dV'/dx_i = 1/4 (+-(b x c) +- (c x a) +- (a x b)), sign + on the high side of x, y, z, - on the low side
Corners volume_gradient(const Matrix3d& edges) {
    const Vector3d a = edges.col(0), b = edges.col(1), c = edges.col(2);
    Corners gradient;
    for (std::size_t i = 0; i < 8; ++i) {
        gradient[i] = (side(i, 0) * b.cross(c) + side(i, 1) * c.cross(a) + side(i, 2) * a.cross(b)) / 4;
    }
    return gradient;
}

// d^2 V' / dx_i dx_j = 1/16 sum over e != f of s_e(i) s_f(j) d^2 V' / de df,  e, f in {a, b, c}, with
// d^2 V' / da db = -[c]x,  d^2 V' / db dc = -[a]x,  d^2 V' / dc da = -[b]x  and their transposes
Matrix24d volume_hessian(const Matrix3d& edges) {
    Matrix24d hessian = Matrix24d::Zero();
    for (std::size_t e = 0; e < 3; ++e) {
        const std::size_t f = (e + 1) % 3, other = (e + 2) % 3;
        const Matrix3d block = -cross_matrix(edges.col(static_cast<Eigen::Index>(other)));
        for (std::size_t i = 0; i < 8; ++i) {
            for (std::size_t j = 0; j < 8; ++j) {
                const auto row = static_cast<Eigen::Index>(3 * i), column = static_cast<Eigen::Index>(3 * j);
                hessian.block<3, 3>(row, column) += side(i, e) * side(j, f) / 16 * block;
                hessian.block<3, 3>(row, column) += side(i, f) * side(j, e) / 16 * block.transpose();
            }
        }
    }
    return hessian;
}

// kappa phi(J) + crush (J0 - J)^3 / (3 J0^2) below J0
double volume_energy_density(VolumeEnergy energy, const Cell& cell, double j) {
    const double depth = crushed_by(cell, j);
    const double crush = depth > 0 ? cell.crush * depth * depth * depth / (3 * cell.crush_ratio * cell.crush_ratio) : 0;
    return cell.kappa * phi(energy_of(energy, cell), j) + crush;
}

VolumeDerivatives volume_derivatives(VolumeEnergy energy, const Cell& cell, double j) {
    const VolumeDerivatives volume = phi_derivatives(energy, cell, j), crush = crush_derivatives(cell, j);
    return {volume.first + crush.first, volume.second + crush.second, volume.third + crush.third};
}

// With W = V0 w(J), w the density above and w' its derivatives by J:
double cell_energy(VolumeEnergy energy, const Cell& cell, const Corners& u) {
    const double j = volume_ratio_change(cell.rest_edges, mean_edges(u));
    return volume(cell.rest_edges) * volume_energy_density(energy, cell, j);
}

// f_i = -w' dV'/dx_i
Corners cell_forces(VolumeEnergy energy, const Cell& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u);
    const double j = volume_ratio_change(cell.rest_edges, change);
    const double slope = volume_derivatives(energy, cell, j).first;
    Corners forces = volume_gradient(cell.rest_edges + change);
    for (Vector3d& f : forces) {
        f *= -slope;
    }
    return forces;
}

// d^2 W / dx_i dx_j = w''/V0 (dV'/dx_i)(dV'/dx_j)^T + w' d^2 V'/dx_i dx_j
Matrix24d cell_hessian(VolumeEnergy energy, const Cell& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u);
    const double j = volume_ratio_change(cell.rest_edges, change);
    const Corners gradient = volume_gradient(cell.rest_edges + change);
    Eigen::Matrix<double, 24, 1> g;
    for (std::size_t i = 0; i < 8; ++i) {
        g.segment<3>(static_cast<Eigen::Index>(3 * i)) = gradient[i];
    }
    const VolumeDerivatives w = volume_derivatives(energy, cell, j);
    return w.second / volume(cell.rest_edges) * g * g.transpose() + w.first * volume_hessian(cell.rest_edges + change);
}

// (|w'| + |w''| j*) |grad V'|, what may cancel in w' and w'' by its sizes
double cell_force_scale(VolumeEnergy energy, const Cell& cell, const Corners& u) {
    const Magnitudes m = magnitudes(cell, u);
    const VolumeDerivatives size = derivative_sizes(energy, cell, m.j);
    return (size.first + size.second * m.j_terms) * gradient_size(m.length);
}

// (|w''| + |w'''| j*) dV*/V0 |grad V'| + (|w'| + |w''| j*) dg*,  dV* = |pa| |b| |c| + ...,
// dg* = (|pb| |c| + |b| |pc| + ...) / 4 with pa, pb, pc the changes of the edges by p
double cell_product_scale(VolumeEnergy energy, const Cell& cell, const Corners& u, const Corners& p) {
    const Magnitudes m = magnitudes(cell, u);
    const Matrix3d edge_sizes = mean_edge_sizes(p);
    double volume_change = 0, gradient_change = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const double size = edge_sizes.col(axis).norm();
        const double one = m.length[(axis + 1) % 3], other = m.length[(axis + 2) % 3];
        volume_change += size * one * other;
        gradient_change += size * (one + other) / 4;
    }
    const VolumeDerivatives size = derivative_sizes(energy, cell, m.j);
    const double along = size.second + size.third * m.j_terms;
    return along * volume_change / volume(cell.rest_edges) * gradient_size(m.length) +
           (size.first + size.second * m.j_terms) * gradient_change;
}

// V' = sum of w/6 p . (q x r),  p, q, r = x_i - x_0, x_j - x_0, x_k - x_0
double polyhedron_volume(const Polyhedron& polyhedron, std::span<const Vector3d> x) {
    double volume = 0;
    for (const auto& [at, weight] : polyhedron.triangles) {
        volume += weight / 6 * (x[at[0]] - x[0]).dot((x[at[1]] - x[0]).cross(x[at[2]] - x[0]));
    }
    return volume;
}

// p . (q x r) - p0 . (q0 x r0) = dp . (q x r) + p0 . (dq x r) + p0 . (q0 x dr)
VolumeChange polyhedron_volume_change(const Polyhedron& polyhedron, std::span<const Vector3d> rest,
                                      std::span<const Vector3d> u) {
    VolumeChange sum{0, 0};
    for (const auto& [at, weight] : polyhedron.triangles) {
        Vector3d r0[3], d[3], r[3];
        for (std::size_t e = 0; e < 3; ++e) {
            r0[e] = rest[at[e]] - rest[0];
            d[e] = u[at[e]] - u[0];
            r[e] = r0[e] + d[e];
        }
        sum.change += weight / 6 * (d[0].dot(r[1].cross(r[2])) + r0[0].dot(d[1].cross(r[2]) + r0[1].cross(d[2])));
        sum.size += weight / 6 *
                    (d[0].norm() * r[1].norm() * r[2].norm() +
                     r0[0].norm() * (d[1].norm() * r[2].norm() + r0[1].norm() * d[2].norm()));
    }
    return sum;
}

// w/6 (q x r, r x p, p x q), and the opposite on node 0
std::vector<Vector3d> polyhedron_gradient(const Polyhedron& polyhedron, std::span<const Vector3d> x) {
    std::vector<Vector3d> gradient(x.size(), Vector3d::Zero());
    for (const auto& [at, weight] : polyhedron.triangles) {
        for (std::size_t e = 0; e < 3; ++e) {
            const Vector3d along = (x[at[(e + 1) % 3]] - x[0]).cross(x[at[(e + 2) % 3]] - x[0]) * (weight / 6);
            gradient[at[e]] += along;
            gradient[0] -= along;
        }
    }
    return gradient;
}

// The derivative of q x r by q is -[r]x, by r [q]x.
Eigen::MatrixXd polyhedron_hessian(const Polyhedron& polyhedron, std::span<const Vector3d> x) {
    const auto size = static_cast<Eigen::Index>(3 * x.size());
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
    const auto add = [&](std::size_t i, std::size_t j, const Matrix3d& block) {
        hessian.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) += block;
    };
    for (const auto& [at, weight] : polyhedron.triangles) {
        for (std::size_t e = 0; e < 3; ++e) {
            const std::size_t f = (e + 1) % 3, g = (e + 2) % 3;
            const Matrix3d by_f = -weight / 6 * cross_matrix(x[at[g]] - x[0]);
            const Matrix3d by_g = weight / 6 * cross_matrix(x[at[f]] - x[0]);
            for (const auto& [row, sign] : {std::pair{at[e], 1.0}, {std::size_t{0}, -1.0}}) {
                add(row, at[f], sign * by_f);
                add(row, at[g], sign * by_g);
                add(row, 0, -sign * (by_f + by_g));
            }
        }
    }
    return hessian;
}

} // namespace hybmss::reference
