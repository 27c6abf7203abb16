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

std::array<Vector3d, 13> spring_vectors() {
    std::array<Vector3d, 13> vectors;
    std::size_t n = 0;
    for (int z = -1; z <= 1; ++z) {
        for (int y = -1; y <= 1; ++y) {
            for (int x = -1; x <= 1; ++x) {
                if (x + 3 * y + 9 * z > 0) {
                    vectors[n++] = Vector3d(x, y, z);
                }
            }
        }
    }
    return vectors;
}

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
double spring_force_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& size) {
    const double q = 2 * rest_vector.cwiseAbs().dot(size) + size.dot(size);
    const double length = (rest_vector + du).norm() + rest_vector.norm();
    return stiffness * (q / length + std::abs(relative_elongation(rest_vector, du)) * size.norm());
}

// k |dp| ( |t| + y + 3 y |du|/|d| + 3/2 y^3 (2 |du| l + |du|^2) / l^2 ),  y = 1 - t = l/|d|: H's own two terms; the
// turn and the change of length of d, by which (1 - t) n n^T changes three times over; and the rounding of |d|^2/l^2 -
// 1, whose change dt = y^3/2 ds enters there too.
double spring_product_scale(double stiffness, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& sizes,
                            const Vector3d& size_of_dp) {
    const double l = rest_vector.norm(), size = sizes.norm(), d = bounded_length(rest_vector + du, l);
    const double t = relative_elongation(rest_vector, du), y = 1 - t;
    return stiffness * size_of_dp.norm() *
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

double stiffening_scale(const SpringStiffening& law, const Vector3d& rest_vector, const Vector3d& du) {
    const double e = std::abs(strain(rest_vector, du));
    return 1 + 2 * std::abs(law.quadratic) * (e + 1) + 3 * law.cubic * e * (e + 2);
}

Vector3d dashpot_force(double damping, const Vector3d& rest_vector, const Vector3d& du, const Vector3d& dv) {
    const Vector3d n = direction(rest_vector, du);
    return damping * n.dot(dv) * n;
}

namespace {

using Vector24d = Eigen::Matrix<double, 24, 1>;
using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

auto at(std::size_t corner) {
    return Eigen::seqN(static_cast<Eigen::Index>(3 * corner), 3);
}

Matrix3d mean_edges_at(const MeanSprings& cell, const Corners& u) {
    return cell.cell_size * Matrix3d::Identity() + mean_edges(u);
}

/// Of a corner in a, b, c.
Vector3d edge_weights(std::size_t corner) {
    return Vector3d(side(corner, 0), side(corner, 1), side(corner, 2)) / 4;
}

/// visit(k, r, weights): a spring k on d = sum over corners of weight x, r at rest.
template <class Visit>
void for_each_spring(const MeanSprings& cell, const Visit& visit) {
    for (const Vector3d& r : spring_vectors()) {
        const auto axes = static_cast<std::size_t>(std::lround(r.squaredNorm()));
        const double k = cell.stiffness[axes - 1];
        if (k == 0) {
            continue;
        }
        Vector8d weights;
        for (std::size_t c = 0; c < 8; ++c) {
            weights[static_cast<Eigen::Index>(c)] = r.dot(edge_weights(c));
        }
        visit(k, r, weights);
    }
}

/// s_y s_z / 8, s_x s_z / 8, s_x s_y / 8 of a corner.
Vector3d pattern_weights(std::size_t corner) {
    const double x = side(corner, 0), y = side(corner, 1), z = side(corner, 2);
    return Vector3d(y * z, x * z, x * y) / 8;
}

/// Columns g_1, g_2, g_3, m. Displacements will do: the patterns are zero at rest.
Matrix3d patterns(const Corners& u) {
    Matrix3d g = Matrix3d::Zero();
    for (std::size_t c = 0; c < 8; ++c) {
        g += (u[c] - u[0]) * pattern_weights(c).transpose(); // a common translation drops out before anything is summed
    }
    return g;
}

/// s_x s_y s_z / 8 of a corner, and g_4, m.
double fourth_weight(std::size_t corner) {
    return side(corner, 0) * side(corner, 1) * side(corner, 2) / 8;
}
Vector3d fourth_pattern(const Corners& u) {
    Vector3d g = Vector3d::Zero();
    for (std::size_t c = 0; c < 8; ++c) {
        g += fourth_weight(c) * (u[c] - u[0]);
    }
    return g;
}
/// Its size without the cancellation inside it: half a mean of +- the changes of four parallel edges.
double fourth_size(const Corners& u) {
    return mean_edge_sizes(u).colwise().norm().minCoeff() / 2;
}

/// P_ij = g_i . a_j / h
Matrix3d products(const MeanSprings& cell, const Corners& u) {
    return patterns(u).transpose() * mean_edges_at(cell, u) / cell.cell_size;
}

/// dW_h/dP; linear in P, so of a change of P it gives its own.
//  Q_ij = k_b (P_ij + nu P_ji) for i != j,  Q_ii = k_t (alpha P_ii + beta (P_11 + P_22 + P_33))
Matrix3d tensions(const HourglassStiffness& k, const Matrix3d& p) {
    Matrix3d q = k.bending * p + k.coupling * p.transpose();
    for (Eigen::Index i = 0; i < 3; ++i) {
        q(i, i) = k.twisting * p(i, i) + k.twist_sum * p.trace();
    }
    return q;
}

/// The sizes that rounding errors are measured by: of g_1, g_2, g_3 and a, b, c without the cancellation inside them.
struct Sizes {
    Vector3d pattern, edge;
};

Sizes sizes_of(const Matrix3d& edges, const Corners& u) {
    // A pattern is half a mean of +- the changes of four parallel edges, of either of its two directions.
    const Vector3d change = mean_edge_sizes(u).colwise().norm(), length = edges.colwise().norm();
    return {Vector3d(std::min(change[1], change[2]), std::min(change[0], change[2]), std::min(change[0], change[1])) /
                2,
            length.cwiseMax(change)};
}

/// The size of the forces of Q on a corner, times h: |sum Q_ij (a_j/8 + g_i/4)|, all by their sizes.
double force_size(const Matrix3d& tension, const Vector3d& pattern, const Vector3d& edge) {
    return (tension * edge).norm() / 8 + (tension.transpose() * pattern).norm() / 4;
}

/// The tensions' sizes where P has the sizes `p`.
Matrix3d tension_sizes(HourglassStiffness k, const Matrix3d& p) {
    k.coupling = std::abs(k.coupling);
    return tensions(k, p);
}

} // namespace

// W = sum over the springs of 1/2 k (|d| - l)^2 and what stiffening adds + 1/2 P:Q + 1/2 k_4 |g_4|^2
double mean_spring_energy(const SpringStiffening& law, const MeanSprings& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u), p = products(cell, u);
    double sum = p.cwiseProduct(tensions(cell.hourglass, p)).sum() / 2 +
                 cell.hourglass.fourth * fourth_pattern(u).squaredNorm() / 2;
    for_each_spring(cell, [&](double k, const Vector3d& r, const Vector8d&) {
        sum += spring_energy(k, cell.cell_size * r, change * r) +
               stiffening_energy(law, k, cell.cell_size * r, change * r);
    });
    return sum;
}

// f_c = - sum over the springs of weight dW/dd - sum Q_ij dP_ij/dx_c - k_4 (weight of c in g_4) g_4,
// dP_ij/dx_c = (weight of c in g_i) a_j / h + (weight of c in a_j) g_i / h
Corners mean_spring_forces(const SpringStiffening& law, const MeanSprings& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u), edges = mean_edges_at(cell, u);
    const Matrix3d q = tensions(cell.hourglass, products(cell, u)) / cell.cell_size;
    const Matrix3d on_patterns = edges * q.transpose(), on_edges = patterns(u) * q; // dW_h/dg_i, dW_h/da_j
    const Vector3d on_fourth = cell.hourglass.fourth * fourth_pattern(u);
    Corners forces;
    for (std::size_t c = 0; c < 8; ++c) {
        forces[c] = -on_patterns * pattern_weights(c) - on_edges * edge_weights(c) - fourth_weight(c) * on_fourth;
    }
    for_each_spring(cell, [&](double k, const Vector3d& r, const Vector8d& weights) {
        const Vector3d tension =
            spring_force(k, cell.cell_size * r, change * r) + stiffening_force(law, k, cell.cell_size * r, change * r);
        for (std::size_t c = 0; c < 8; ++c) {
            forces[c] -= weights[static_cast<Eigen::Index>(c)] * tension;
        }
    });
    return forces;
}

// The springs' dashpots, and of the patterns what Q changes by as P does.
Corners mean_spring_damping_forces(const MeanSprings& cell, double stiffness_damping, const Corners& u,
                                   const Corners& v) {
    const Matrix3d change = mean_edges(u), rate = mean_edges(v), edges = mean_edges_at(cell, u), g = patterns(u);
    const Matrix3d p_rate = (patterns(v).transpose() * edges + g.transpose() * rate) / cell.cell_size;
    const Matrix3d q = stiffness_damping * tensions(cell.hourglass, p_rate) / cell.cell_size;
    const Vector3d on_fourth = stiffness_damping * cell.hourglass.fourth * fourth_pattern(v);
    Corners forces;
    for (std::size_t c = 0; c < 8; ++c) {
        forces[c] =
            -edges * q.transpose() * pattern_weights(c) - g * q * edge_weights(c) - fourth_weight(c) * on_fourth;
    }
    for_each_spring(cell, [&](double k, const Vector3d& r, const Vector8d& weights) {
        const Vector3d tension = dashpot_force(stiffness_damping * k, cell.cell_size * r, change * r, rate * r);
        for (std::size_t c = 0; c < 8; ++c) {
            forces[c] -= weights[static_cast<Eigen::Index>(c)] * tension;
        }
    });
    return forces;
}

// sum over the springs of weight_c weight_d d^2 W/dd^2 + sum (dP_ij/dx_c) (dQ_ij/dP_kl) (dP_kl/dx_d)^T
//   + sum Q_ij d^2 P_ij/dx_c dx_d + k_4 (weights of c and d in g_4)
Matrix24d mean_spring_hessian(const SpringStiffening& law, const MeanSprings& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u), edges = mean_edges_at(cell, u);
    const Matrix3d q = tensions(cell.hourglass, products(cell, u));
    const Matrix3d g = patterns(u);
    Matrix24d hessian = Matrix24d::Zero();
    const auto add = [&](const Matrix8d& weights, const Matrix3d& block) {
        for (std::size_t c = 0; c < 8; ++c) {
            for (std::size_t d = 0; d < 8; ++d) {
                hessian(at(c), at(d)) += weights(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(d)) * block;
            }
        }
    };
    for_each_spring(cell, [&](double k, const Vector3d& r, const Vector8d& weights) {
        add(weights * weights.transpose(), spring_hessian(k, cell.cell_size * r, change * r) +
                                               stiffening_hessian(law, k, cell.cell_size * r, change * r));
    });

    Eigen::Matrix<double, 8, 3> of_patterns, of_edges;
    Vector8d of_fourth;
    for (std::size_t c = 0; c < 8; ++c) {
        of_patterns.row(static_cast<Eigen::Index>(c)) = pattern_weights(c);
        of_edges.row(static_cast<Eigen::Index>(c)) = edge_weights(c);
        of_fourth[static_cast<Eigen::Index>(c)] = fourth_weight(c);
    }
    add(of_fourth * of_fourth.transpose(), cell.hourglass.fourth * Matrix3d::Identity());
    std::array<std::array<Vector24d, 3>, 3> slope; // dP_ij/dx
    Matrix8d of_both = Matrix8d::Zero();           // sum Q_ij (weight of c in g_i) (weight of d in a_j), and turned
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
            for (std::size_t c = 0; c < 8; ++c) {
                const auto corner = static_cast<Eigen::Index>(c);
                slope[i][j](at(c)) =
                    (of_patterns(corner, row) * edges.col(column) + of_edges(corner, column) * g.col(row)) /
                    cell.cell_size;
            }
            const Matrix8d mixed = of_patterns.col(row) * of_edges.col(column).transpose();
            of_both += q(row, column) / cell.cell_size * (mixed + mixed.transpose());
        }
    }
    add(of_both, Matrix3d::Identity());
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t l = 0; l < 3; ++l) {
            Matrix3d unit = Matrix3d::Zero();
            unit(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) = 1;
            const Matrix3d by_p = tensions(cell.hourglass, unit); // dQ/dP_kl
            Vector24d sum = Vector24d::Zero();                    // of (dP_ij/dx) (dQ_ij/dP_kl)
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    sum += by_p(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * slope[i][j];
                }
            }
            hessian += sum * slope[k][l].transpose();
        }
    }
    return hessian;
}

// The springs' own scales with the changes of all edges by their absolute values; for P its products so.
double mean_spring_force_scale(const SpringStiffening& law, const MeanSprings& cell, const Corners& u) {
    const Matrix3d change = mean_edges(u), size = mean_edge_sizes(u);
    const Sizes of = sizes_of(mean_edges_at(cell, u), u);
    const double h = cell.cell_size;
    const Matrix3d tension = tension_sizes(cell.hourglass, of.pattern * of.edge.transpose() / h);
    double sum = force_size(tension, of.pattern, of.edge) / h + cell.hourglass.fourth * fourth_size(u) / 8;
    for_each_spring(cell, [&](double k, const Vector3d& r, const Vector8d& weights) {
        sum += weights.maxCoeff() * stiffening_scale(law, h * r, change * r) *
               spring_force_scale(k, h * r, change * r, size * r.cwiseAbs());
    });
    return sum;
}

double mean_spring_product_scale(const SpringStiffening& law, const MeanSprings& cell, const Corners& u,
                                 const Corners& p) {
    const Matrix3d deformed = mean_edges(u), size = mean_edge_sizes(u), size_of_p = mean_edge_sizes(p);
    const Sizes of = sizes_of(mean_edges_at(cell, u), u), by = sizes_of(Matrix3d::Zero(), p);
    const double h = cell.cell_size;
    const Matrix3d tension = tension_sizes(cell.hourglass, of.pattern * of.edge.transpose() / h);
    const Matrix3d change =
        tension_sizes(cell.hourglass, (by.pattern * of.edge.transpose() + of.pattern * by.edge.transpose()) / h);
    double sum = (force_size(tension, by.pattern, by.edge) + force_size(change, of.pattern, of.edge)) / h +
                 cell.hourglass.fourth * fourth_size(p) / 8;
    for_each_spring(cell, [&](double k, const Vector3d& r, const Vector8d& weights) {
        sum += weights.maxCoeff() * stiffening_scale(law, h * r, deformed * r) *
               spring_product_scale(k, h * r, deformed * r, size * r.cwiseAbs(), size_of_p * r.cwiseAbs());
    });
    return sum;
}

} // namespace hybmss::reference
