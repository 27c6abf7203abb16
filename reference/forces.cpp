#include "reference/forces.hpp"
#include "reference/springs.hpp"
#include "reference/volume_energy.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <map>
#include <utility>

namespace hybmss::reference {
namespace {

std::size_t index(int node) {
    return static_cast<std::size_t>(node);
}

Vector3d relative(const Spring& spring, std::span<const Vector3d> u) {
    return u[index(spring.b)] - u[index(spring.a)];
}

Vector3d force_on_a(const Body& body, const Spring& s, std::span<const Vector3d> u) {
    const Vector3d du = relative(s, u);
    return spring_force(s.stiffness, s.rest_vector, du) +
           stiffening_force(body.stiffening, s.stiffness, s.rest_vector, du);
}

Matrix3d hessian_of(const Body& body, const Spring& s, std::span<const Vector3d> u) {
    const Vector3d du = relative(s, u);
    return spring_hessian(s.stiffness, s.rest_vector, du) +
           stiffening_hessian(body.stiffening, s.stiffness, s.rest_vector, du);
}

/// For each node the sum of what springs, cells' volumes and springs on their means give to all their nodes alike.
template <class OfSpring, class OfCell, class OfMeans>
std::vector<double> sums_at_nodes(const Body& body, const OfSpring& of_spring, const OfCell& of_cell,
                                  const OfMeans& of_means) {
    std::vector<double> sums(body.rest.size(), 0.0);
    for (const Spring& s : body.springs) {
        const double given = of_spring(s);
        sums[index(s.a)] += given;
        sums[index(s.b)] += given;
    }
    const auto give = [&](const auto& cell, double given) {
        for (int node : cell.nodes) {
            sums[index(node)] += given;
        }
    };
    for (const Cell& cell : body.cells) {
        give(cell, of_cell(cell));
    }
    for (const MeanSprings& cell : body.mean_springs) {
        give(cell, of_means(cell));
    }
    return sums;
}

template <class AnyCell>
Corners gather(const AnyCell& cell, std::span<const Vector3d> u) {
    Corners corners;
    for (std::size_t c = 0; c < 8; ++c) {
        corners[c] = u[index(cell.nodes[c])];
    }
    return corners;
}

auto block_of(const Matrix24d& matrix, std::size_t i, std::size_t j) {
    return matrix.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j));
}

std::vector<Vector3d> at_corners(const Polyhedron& polyhedron, std::span<const Vector3d> field) {
    std::vector<Vector3d> corners;
    for (const int node : polyhedron.nodes) {
        corners.push_back(field[index(node)]);
    }
    return corners;
}

/// What a sum of volumes is at displacements u: its J - 1, and the size of the terms of that.
VolumeChange ratio_change(const Body& body, const VolumeSum& sum, std::span<const Vector3d> u) {
    VolumeChange ratio{0, 0};
    for (const auto& [p, share] : sum.parts) {
        const Polyhedron& polyhedron = body.polyhedra[p];
        const VolumeChange part =
            polyhedron_volume_change(polyhedron, at_corners(polyhedron, body.rest), at_corners(polyhedron, u));
        ratio.change += share * part.change / sum.rest_volume;
        ratio.size += share * part.size / sum.rest_volume;
    }
    return ratio;
}

std::vector<Vector3d> positions(const Body& body, std::span<const Vector3d> u) {
    std::vector<Vector3d> x(body.rest);
    for (std::size_t n = 0; n < x.size(); ++n) {
        x[n] += u[n];
    }
    return x;
}

/// d (sum of the shares of V') / dx, by nodes.
std::vector<std::pair<int, Vector3d>> gradient_of(const Body& body, const VolumeSum& sum, std::span<const Vector3d> x) {
    std::map<int, Vector3d> gradient;
    for (const auto& [p, share] : sum.parts) {
        const Polyhedron& polyhedron = body.polyhedra[p];
        const std::vector<Vector3d> part = polyhedron_gradient(polyhedron, at_corners(polyhedron, x));
        for (std::size_t c = 0; c < part.size(); ++c) {
            gradient.try_emplace(polyhedron.nodes[c], Vector3d::Zero()).first->second += share * part[c];
        }
    }
    return {gradient.begin(), gradient.end()};
}

/// visit(node i, node j, block) of the second derivatives of the polyhedra's energy: of each sum of volumes kappa
/// phi''/V0 g_i g_j^T, and kappa phi' d^2 V'/dx_i dx_j of its parts.
template <class Visit>
void for_each_volume_block(const Body& body, std::span<const Vector3d> u, const Visit& visit) {
    const std::vector<Vector3d> x = positions(body, u);
    for (const VolumeSum& sum : body.volume_sums) {
        const double j = ratio_change(body, sum, u).change;
        const double slope = sum.kappa * phi_derivative(body.volume_energy, j);
        const double along = sum.kappa * phi_second_derivative(body.volume_energy, j) / sum.rest_volume;
        const auto gradient = gradient_of(body, sum, x);
        for (const auto& [row, of_row] : gradient) {
            for (const auto& [column, of_column] : gradient) {
                visit(row, column, Matrix3d(along * of_row * of_column.transpose()));
            }
        }
        for (const auto& [p, share] : sum.parts) {
            const Polyhedron& polyhedron = body.polyhedra[p];
            const Eigen::MatrixXd hessian = polyhedron_hessian(polyhedron, at_corners(polyhedron, x));
            for (std::size_t a = 0; a < polyhedron.nodes.size(); ++a) {
                for (std::size_t b = 0; b < polyhedron.nodes.size(); ++b) {
                    const Matrix3d block =
                        hessian.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
                    visit(polyhedron.nodes[a], polyhedron.nodes[b], Matrix3d(slope * share * block));
                }
            }
        }
    }
}

/// Adds the sizes that rounding of polyhedra's forces, or of their products with p, goes by: of each sum of volumes
/// with phi's derivatives f1, f2, f3, the size j* of the terms of j, and l the longest edge from node 0
///
///     forces     |kappa| (|f1| + |f2| j*) l^2
///     products   |kappa| (|f2| + |f3| j*) dV*/V0 l^2 + |kappa| (|f1| + |f2| j*) dp* l
void add_volume_scales(const Body& body, std::span<const Vector3d> u, const std::span<const Vector3d>* p,
                       std::vector<double>& sums) {
    const std::vector<Vector3d> x = positions(body, u);
    for (const VolumeSum& sum : body.volume_sums) {
        const VolumeChange ratio = ratio_change(body, sum, u);
        const double kappa = std::abs(sum.kappa);
        const double first = std::abs(phi_derivative(body.volume_energy, ratio.change));
        const double second = std::abs(phi_second_derivative(body.volume_energy, ratio.change));
        const double third = std::abs(phi_third_derivative(body.volume_energy, ratio.change));
        double volume_change = 0;
        for (const auto& [part, share] : sum.parts) {
            const std::vector<Vector3d> corners = at_corners(body.polyhedra[part], x);
            const std::vector<Vector3d> along =
                p ? at_corners(body.polyhedra[part], *p) : std::vector<Vector3d>(corners.size(), Vector3d::Zero());
            for (const auto& [at, weight] : body.polyhedra[part].triangles) {
                for (std::size_t e = 0; e < 3; ++e) {
                    volume_change += share * weight / 6 * (along[at[e]] - along[0]).norm() *
                                     (corners[at[(e + 1) % 3]] - corners[0]).norm() *
                                     (corners[at[(e + 2) % 3]] - corners[0]).norm();
                }
            }
        }
        for (const auto& [part, share] : sum.parts) {
            const Polyhedron& polyhedron = body.polyhedra[part];
            const std::vector<Vector3d> corners = at_corners(polyhedron, x);
            double length = 0, change = 0;
            for (std::size_t c = 1; c < corners.size(); ++c) {
                length = std::max(length, (corners[c] - corners[0]).norm());
                change += p ? ((*p)[index(polyhedron.nodes[c])] - (*p)[index(polyhedron.nodes[0])]).norm() : 0;
            }
            const double size = p ? (second + third * ratio.size) * volume_change / sum.rest_volume * length * length +
                                        (first + second * ratio.size) * change * length
                                  : (first + second * ratio.size) * length * length;
            for (const int node : polyhedron.nodes) {
                sums[index(node)] += kappa * share * size;
            }
        }
    }
}

/// visit(a cell's nodes, the second derivatives of its energy): its volume's, and those of springs on its means.
template <class Visit>
void for_each_cell_hessian(const Body& body, std::span<const Vector3d> u, const Visit& visit) {
    for (const Cell& cell : body.cells) {
        visit(cell.nodes, cell_hessian(body.volume_energy, cell, gather(cell, u)));
    }
    for (const MeanSprings& cell : body.mean_springs) {
        visit(cell.nodes, mean_spring_hessian(body.stiffening, cell, gather(cell, u)));
    }
}

} // namespace

// W = sum over springs of 1/2 k (|d| - l)^2 and what stiffening adds + sum over cells of kappa V0 phi(J) and, in
// HybMSS-M, the energy of the springs on their means
Energy energy(const Body& body, std::span<const Vector3d> u) {
    Energy sum;
    for (const Spring& s : body.springs) {
        sum.springs += spring_energy(s.stiffness, s.rest_vector, relative(s, u)) +
                       stiffening_energy(body.stiffening, s.stiffness, s.rest_vector, relative(s, u));
    }
    for (const Cell& cell : body.cells) {
        sum.volume += cell_energy(body.volume_energy, cell, gather(cell, u));
    }
    for (const MeanSprings& cell : body.mean_springs) {
        sum.springs += mean_spring_energy(body.stiffening, cell, gather(cell, u));
    }
    for (const VolumeSum& volumes : body.volume_sums) {
        sum.volume += volume_sum_energy(body, volumes, u);
    }
    return sum;
}

// kappa V0 phi(J)
double volume_sum_energy(const Body& body, const VolumeSum& volumes, std::span<const Vector3d> u) {
    return volumes.kappa * volumes.rest_volume * phi(body.volume_energy, ratio_change(body, volumes, u).change);
}

// f = -dW/du
std::vector<Vector3d> forces(const Body& body, std::span<const Vector3d> u) {
    std::vector<Vector3d> f(body.rest.size(), Vector3d::Zero());
    for (const Spring& s : body.springs) {
        const Vector3d on_a = force_on_a(body, s, u);
        f[index(s.a)] += on_a;
        f[index(s.b)] -= on_a;
    }
    const auto add = [&](const std::array<int, 8>& nodes, const Corners& on_corners) {
        for (std::size_t c = 0; c < 8; ++c) {
            f[index(nodes[c])] += on_corners[c];
        }
    };
    for (const Cell& cell : body.cells) {
        add(cell.nodes, cell_forces(body.volume_energy, cell, gather(cell, u)));
    }
    for (const MeanSprings& cell : body.mean_springs) {
        add(cell.nodes, mean_spring_forces(body.stiffening, cell, gather(cell, u)));
    }
    const std::vector<Vector3d> x = positions(body, u);
    for (const VolumeSum& sum : body.volume_sums) {
        const double slope = sum.kappa * phi_derivative(body.volume_energy, ratio_change(body, sum, u).change);
        for (const auto& [node, gradient] : gradient_of(body, sum, x)) {
            f[index(node)] -= slope * gradient;
        }
    }
    return f;
}

std::vector<Vector3d> damping_forces(const Body& body, double stiffness_damping, std::span<const Vector3d> u,
                                     std::span<const Vector3d> v) {
    std::vector<Vector3d> f(body.rest.size(), Vector3d::Zero());
    for (const Spring& s : body.springs) {
        const Vector3d on_a =
            dashpot_force(stiffness_damping * s.stiffness, s.rest_vector, relative(s, u), relative(s, v));
        f[index(s.a)] += on_a;
        f[index(s.b)] -= on_a;
    }
    for (const MeanSprings& cell : body.mean_springs) {
        const Corners on_corners =
            mean_spring_damping_forces(cell, stiffness_damping, gather(cell, u), gather(cell, v));
        for (std::size_t c = 0; c < 8; ++c) {
            f[index(cell.nodes[c])] += on_corners[c];
        }
    }
    return f;
}

namespace {

/// Gauss' two points on 0 .. 1, each of the weight 1/2: exact to the third power.
const double kGauss[2] = {0.5 - std::sqrt(1.0 / 12), 0.5 + std::sqrt(1.0 / 12)};

} // namespace

std::array<Vector3d, 4> pressure_forces(const std::array<Vector3d, 4>& x) {
    std::array<Vector3d, 4> f = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    for (const double s : kGauss) {
        for (const double t : kGauss) {
            const Vector3d along_s = (1 - t) * (x[1] - x[0]) + t * (x[2] - x[3]);
            const Vector3d along_t = (1 - s) * (x[3] - x[0]) + s * (x[2] - x[1]);
            const double shape[4] = {(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t};
            for (std::size_t a = 0; a < 4; ++a) {
                f[a] -= shape[a] / 4 * along_s.cross(along_t);
            }
        }
    }
    return f;
}

double trilinear_volume(const Corners& x) {
    double volume = 0;
    for (int point = 0; point < 8; ++point) {
        const double at[3] = {kGauss[point & 1], kGauss[point >> 1 & 1], kGauss[point >> 2]};
        Matrix3d gradient = Matrix3d::Zero();
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (int axis = 0; axis < 3; ++axis) {
                double slope = 1;
                for (int other = 0; other < 3; ++other) {
                    const bool high = corner >> other & 1;
                    slope *= other == axis ? (high ? 1 : -1) : high ? at[other] : 1 - at[other];
                }
                gradient.col(axis) += slope * x[corner];
            }
        }
        volume += gradient.determinant() / 8;
    }
    return volume;
}

std::vector<double> force_scale(const Body& body, std::span<const Vector3d> u) {
    std::vector<double> sums = sums_at_nodes(
        body,
        [&](const Spring& s) {
            const Vector3d du = relative(s, u);
            return stiffening_scale(body.stiffening, s.rest_vector, du) *
                   spring_force_scale(s.stiffness, s.rest_vector, du, du.cwiseAbs());
        },
        [&](const Cell& cell) { return cell_force_scale(body.volume_energy, cell, gather(cell, u)); },
        [&](const MeanSprings& cell) { return mean_spring_force_scale(body.stiffening, cell, gather(cell, u)); });
    add_volume_scales(body, u, nullptr, sums);
    return sums;
}

// K p, block by block: a spring gives +-H (p_b - p_a), a cell its 24 x 24 block times its corners' p
std::vector<Vector3d> hessian_product(const Body& body, std::span<const Vector3d> u, std::span<const Vector3d> p) {
    std::vector<Vector3d> product(body.rest.size(), Vector3d::Zero());
    for (const Spring& s : body.springs) {
        const Vector3d on_b = hessian_of(body, s, u) * relative(s, p);
        product[index(s.a)] -= on_b;
        product[index(s.b)] += on_b;
    }
    for_each_cell_hessian(body, u, [&](const std::array<int, 8>& nodes, const Matrix24d& block) {
        for (std::size_t i = 0; i < 8; ++i) {
            for (std::size_t j = 0; j < 8; ++j) {
                product[index(nodes[i])] += block_of(block, i, j) * p[index(nodes[j])];
            }
        }
    });
    for_each_volume_block(
        body, u, [&](int row, int column, const Matrix3d& block) { product[index(row)] += block * p[index(column)]; });
    return product;
}

std::vector<double> hessian_product_scale(const Body& body, std::span<const Vector3d> u, std::span<const Vector3d> p) {
    std::vector<double> sums = sums_at_nodes(
        body,
        [&](const Spring& s) {
            const Vector3d du = relative(s, u), dp = relative(s, p);
            return stiffening_scale(body.stiffening, s.rest_vector, du) *
                   spring_product_scale(s.stiffness, s.rest_vector, du, du.cwiseAbs(), dp.cwiseAbs());
        },
        [&](const Cell& cell) {
            return cell_product_scale(body.volume_energy, cell, gather(cell, u), gather(cell, p));
        },
        [&](const MeanSprings& cell) {
            return mean_spring_product_scale(body.stiffening, cell, gather(cell, u), gather(cell, p));
        });
    add_volume_scales(body, u, &p, sums);
    return sums;
}

std::vector<Matrix3d> hessian_diagonal(const Body& body, std::span<const Vector3d> u) {
    std::vector<Matrix3d> blocks(body.rest.size(), Matrix3d::Zero());
    for (const Spring& s : body.springs) {
        const Matrix3d block = hessian_of(body, s, u);
        blocks[index(s.a)] += block;
        blocks[index(s.b)] += block;
    }
    for_each_cell_hessian(body, u, [&](const std::array<int, 8>& nodes, const Matrix24d& block) {
        for (std::size_t c = 0; c < 8; ++c) {
            blocks[index(nodes[c])] += block_of(block, c, c);
        }
    });
    for_each_volume_block(body, u, [&](int row, int column, const Matrix3d& block) {
        if (row == column) {
            blocks[index(row)] += block;
        }
    });
    return blocks;
}

Eigen::SparseMatrix<double> hessian(const Body& body, std::span<const Vector3d> u) {
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int row_node, int column_node, const Matrix3d& block) {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                entries.emplace_back(3 * row_node + i, 3 * column_node + j, block(i, j));
            }
        }
    };
    for (const Spring& s : body.springs) {
        const Matrix3d block = hessian_of(body, s, u);
        add(s.a, s.a, block);
        add(s.b, s.b, block);
        add(s.a, s.b, -block);
        add(s.b, s.a, -block);
    }
    for_each_cell_hessian(body, u, [&](const std::array<int, 8>& nodes, const Matrix24d& block) {
        for (std::size_t i = 0; i < 8; ++i) {
            for (std::size_t j = 0; j < 8; ++j) {
                add(nodes[i], nodes[j], block_of(block, i, j));
            }
        }
    });
    for_each_volume_block(body, u, add);
    const auto size = static_cast<Eigen::Index>(3 * body.rest.size());
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
}

} // namespace hybmss::reference
