#include "plan/bodies/critical_time_step.hpp"

#include "layouts/network/network_geometry.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace hybmss {
namespace {

using Matrix24 = Eigen::Matrix<double, 24, 24>;
using Eigen::Vector3d;

Vector3d corner_position(int corner) {
    return {static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1), static_cast<double>(corner >> 2)};
}

struct CellStiffness {
    Matrix24 body = Matrix24::Zero(), springs = Matrix24::Zero();
};

/// Of a cell's springs on its means, and of what its patterns store: at rest these are p_ij = g_i . e_j.
Matrix24 mean_stiffness(const SpringConstants& constants, const PatternConstants& patterns) {
    const double stiffness_of[3] = {constants.edge, constants.face_diagonal, constants.cube_diagonal};
    Matrix24 stiffness = Matrix24::Zero();
    for (int code = 0; code < 27; ++code) {
        const Vector3d signs(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
        const double length2 = signs.squaredNorm();
        const double first = signs[0] != 0 ? signs[0] : signs[1] != 0 ? signs[1] : signs[2];
        if (first <= 0) {
            continue; // the opposite of another
        }
        Eigen::Matrix<double, 24, 1> along;
        for (int corner = 0; corner < 8; ++corner) {
            along.segment<3>(3 * corner) =
                signs.dot(2 * corner_position(corner) - Vector3d::Ones()) / 4 * signs.normalized();
        }
        stiffness += stiffness_of[static_cast<std::size_t>(length2) - 1] * along * along.transpose();
    }
    Eigen::Matrix<double, 24, 1> p[3][3];
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            p[i][j].setZero();
            for (int corner = 0; corner < 8; ++corner) {
                const Vector3d side = 2 * corner_position(corner) - Vector3d::Ones();
                p[i][j][3 * corner + j] = side[(i + 1) % 3] * side[(i + 2) % 3] / 8;
            }
        }
    }
    const Eigen::Matrix<double, 24, 1> together = p[0][0] + p[1][1] + p[2][2];
    stiffness += patterns.joint_twist * together * together.transpose();
    for (int axis = 0; axis < 3; ++axis) {
        Eigen::Matrix<double, 24, 1> fourth = Eigen::Matrix<double, 24, 1>::Zero();
        for (int corner = 0; corner < 8; ++corner) {
            fourth[3 * corner + axis] = (2 * corner_position(corner) - Vector3d::Ones()).prod() / 8;
        }
        stiffness += patterns.fourth * fourth * fourth.transpose();
    }
    for (int i = 0; i < 3; ++i) {
        stiffness += patterns.twist * p[i][i] * p[i][i].transpose();
        for (int j = 0; j < 3; ++j) {
            if (j != i) {
                stiffness += patterns.bending * p[i][j] * (p[i][j] + patterns.coupling * p[j][i]).transpose();
            }
        }
    }
    return stiffness;
}

/// How a cube of the edge 1 changes its volume with its corners: 1/4 (+-1, +-1, +-1) each.
Eigen::Matrix<double, 24, 1> volume_gradient() {
    Eigen::Matrix<double, 24, 1> gradient;
    for (int a = 0; a < 8; ++a) {
        gradient.segment<3>(3 * a) = (2 * corner_position(a) - Vector3d::Ones()) / 4;
    }
    return gradient;
}

/// The stiffness matrix at rest of the springs between a cell's corners: k n n^T for each, k by the number of axes
/// along which its ends differ.
Matrix24 spring_stiffness(const std::array<double, 3>& stiffness_of) {
    Matrix24 stiffness = Matrix24::Zero();
    for (int a = 0; a < 8; ++a) {
        for (int b = a + 1; b < 8; ++b) {
            const Vector3d r = corner_position(b) - corner_position(a);
            const double length2 = r.squaredNorm(), k = stiffness_of[static_cast<std::size_t>(length2) - 1];
            const Eigen::Matrix3d block = k / length2 * r * r.transpose();
            stiffness.block<3, 3>(3 * a, 3 * a) += block;
            stiffness.block<3, 3>(3 * b, 3 * b) += block;
            stiffness.block<3, 3>(3 * a, 3 * b) -= block;
            stiffness.block<3, 3>(3 * b, 3 * a) -= block;
        }
    }
    return stiffness;
}

/// Of one cell with its shares of the springs, and kappa/V0 (dV'/dx)(dV'/dx)^T.
CellStiffness cell_stiffness(const Material& material, double h) {
    const SpringConstants k = spring_constants(material, h);
    CellStiffness cell;
    cell.springs = material.springs == SpringForm::means
                       ? mean_stiffness(k, pattern_constants(material, h))
                       : spring_stiffness({k.edge / 4, k.face_diagonal / 2, k.cube_diagonal});
    cell.body = cell.springs;
    if (resolved_volume_energy(material) != VolumeEnergy::none) {
        const Eigen::Matrix<double, 24, 1> gradient = h * h * volume_gradient();
        cell.body += volume_modulus(material) / (h * h * h) * gradient * gradient.transpose();
    }
    return cell;
}

double largest_eigenvalue(const Matrix24& matrix) {
    return Eigen::SelfAdjointEigenSolver<Matrix24>(matrix, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

/// Different on every component, so that no eigenvector is left out by a symmetry of the body.
Eigen::VectorXd start_vector(Eigen::Index size) {
    Eigen::VectorXd v(size);
    std::uint64_t state = 1;
    for (double& component : v) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        component = static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
    }
    return v.normalized();
}

/// Of the symmetric tridiagonal matrix.
double largest_of(const std::vector<double>& diagonal, const std::vector<double>& beside) {
    const auto size = static_cast<Eigen::Index>(diagonal.size());
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(Eigen::Map<const Eigen::VectorXd>(diagonal.data(), size),
                                  Eigen::Map<const Eigen::VectorXd>(beside.data(), size - 1), Eigen::EigenvaluesOnly);
    return solver.eigenvalues()[size - 1];
}

} // namespace

// dt = (-beta s + sqrt((beta s)^2 + 4 o)) / o for o dt^2 + 2 beta s dt = 4, without cancellation
double FrequencyBounds::critical_time_step(double stiffness_damping, double further) const {
    const double omega2 = body + further, damping = stiffness_damping * springs;
    const double inverse = damping + std::sqrt(damping * damping + 4 * omega2);
    return inverse > 0 ? 4 / inverse : std::numeric_limits<double>::infinity();
}

FrequencyBounds lattice_frequencies(const Lattice& lattice, const Material& material) {
    const double h = lattice.cell_size();
    const auto scales = lattice.cell_scales();
    std::vector<float> largest_scales(1 + lattice.tissues().size(), 0.0f); // by tissue, over the fill
    for (std::size_t cell = 0; cell < scales.size(); ++cell) {
        float& largest = largest_scales[lattice.cell_tissue(cell)];
        largest = std::max(largest, scales[cell] > 0 ? scales[cell] / lattice.cell_fill(cell) : 0.0f);
    }
    // The body's energy is the sum of its cells', its mass likewise: no mode is faster than the fastest cell by itself.
    FrequencyBounds bounds;
    for (std::size_t tissue = 0; tissue < largest_scales.size(); ++tissue) {
        const Material own = material_of(lattice, tissue, material);
        const CellStiffness cell = cell_stiffness(own, h);
        const double by_mass = static_cast<double>(largest_scales[tissue]) / (own.density * h * h * h / 8);
        // The second derivative by J there, times |grad J|^2 at rest, 3/2 / h^2.
        const double crushed = crush_modulus(own) * own.crush.ratio * 1.5 * h;
        bounds.body = std::max(bounds.body, by_mass * largest_eigenvalue(cell.body));
        bounds.springs = std::max(bounds.springs, by_mass * largest_eigenvalue(cell.springs));
        bounds.crushed = std::max(bounds.crushed, by_mass * crushed);
    }
    return bounds;
}

FrequencyBounds network_frequencies(const Network& network) {
    std::vector<double> row_sum(network.masses.size(), 0.0);
    for (const Network::Spring& s : network.springs) {
        row_sum[static_cast<std::size_t>(s.a)] += 2 * s.stiffness;
        row_sum[static_cast<std::size_t>(s.b)] += 2 * s.stiffness;
    }
    // A cell with springs on means adds no more than its largest eigenvalue to the diagonals of its corners. By
    // symmetry the change of its volume is an eigenvector by itself.
    const Matrix24 of_means = mean_stiffness(network.means.springs, network.means.patterns);
    const Eigen::Matrix<double, 24, 1> dilation = volume_gradient();
    const double square = dilation.squaredNorm(), dilating = dilation.dot(of_means * dilation) / square;
    const double others = largest_eigenvalue(of_means - dilating / square * dilation * dilation.transpose());
    const double largest_of_means = std::max(dilating, others);
    for (const Network::Cell& cell : network.cells) {
        for (const std::int32_t node : cell.nodes) {
            row_sum[static_cast<std::size_t>(node)] += cell.scale * largest_of_means;
        }
    }
    const std::vector<double> spring_sum = row_sum;
    for (const Network::Cell& cell : network.cells) {
        const RestShape rest = rest_shape(network, cell);
        const Vector3d a(&rest.edges[0]), b(&rest.edges[3]), c(&rest.edges[6]);
        const double volume = a.dot(b.cross(c));
        if (cell.scale > 0) {
            const double all = std::max(cell.scale * others, cell.scale * dilating + cell.kappa * a[0] * square);
            for (const std::int32_t node : cell.nodes) {
                row_sum[static_cast<std::size_t>(node)] += all - cell.scale * largest_of_means;
            }
            continue;
        }
        double sum = 0;
        double norm[8];
        for (int corner = 0; corner < 8; ++corner) {
            const Vector3d sign = 2 * corner_position(corner) - Vector3d::Ones();
            norm[corner] = (sign[0] * b.cross(c) + sign[1] * c.cross(a) + sign[2] * a.cross(b)).norm() / 4;
            sum += norm[corner];
        }
        for (int corner = 0; corner < 8; ++corner) {
            const auto node = static_cast<std::size_t>(cell.nodes[static_cast<std::size_t>(corner)]);
            row_sum[node] += std::abs(cell.kappa) / volume * norm[corner] * sum;
        }
    }
    // Volumes of nodes resist no more than those of polyhedra with the largest of their nodes' kappas would: a square
    // of a mean is at most the mean of the squares.
    const NodalVolumes nodal = network.nodal_volumes ? nodal_volumes(network) : NodalVolumes{};
    for (const Network::Polyhedron& polyhedron : network.polyhedra) {
        std::array<std::array<double, 3>, 6> corners{};
        double kappa = network.nodal_volumes ? 0 : std::abs(polyhedron.kappa);
        for (std::size_t c = 0; c < polyhedron.node_count(); ++c) {
            const auto node = static_cast<std::size_t>(polyhedron.nodes[c]);
            corners[c] = network.rest_positions[node];
            kappa = std::max(kappa, network.nodal_volumes ? std::abs(nodal.kappas[node]) : 0);
        }
        const auto gradient = volume_gradient(polyhedron.shape, corners);
        double sum = 0;
        for (const auto& g : gradient) {
            sum += std::hypot(g[0], g[1], g[2]);
        }
        const double by = kappa / polyhedron_vectors(polyhedron.shape, corners).volume * sum;
        for (std::size_t c = 0; c < polyhedron.node_count(); ++c) {
            row_sum[static_cast<std::size_t>(polyhedron.nodes[c])] +=
                by * std::hypot(gradient[c][0], gradient[c][1], gradient[c][2]);
        }
    }
    FrequencyBounds largest;
    for (std::size_t n = 0; n < row_sum.size(); ++n) {
        largest.body = std::max(largest.body, row_sum[n] / network.masses[n]);
        largest.springs = std::max(largest.springs, spring_sum[n] / network.masses[n]);
    }
    return largest;
}

double largest_eigenvalue(std::size_t size,
                          const std::function<void(std::span<const double> in, std::span<double> out)>& multiply,
                          int most_products, double tolerance) {
    const auto rows = static_cast<Eigen::Index>(size);
    Eigen::VectorXd v = start_vector(rows), before = Eigen::VectorXd::Zero(rows), w(rows);
    std::vector<double> diagonal, beside;
    double found = 0, coupling = 0;
    constexpr int kBetweenChecks = 5;
    for (int product = 1; product <= most_products; ++product) {
        multiply({v.data(), size}, {w.data(), size});
        const double alpha = v.dot(w);
        w -= alpha * v + coupling * before;
        diagonal.push_back(alpha);
        coupling = w.norm();
        const bool exhausted = !(coupling > 1e-14 * std::abs(alpha)) || product == most_products;
        if (exhausted || product % kBetweenChecks == 0) {
            const double last = found;
            found = largest_of(diagonal, beside);
            if (exhausted || found - last <= tolerance * found) {
                break;
            }
        }
        beside.push_back(coupling);
        before.swap(v);
        v = w / coupling;
    }
    return std::max(found, 0.0);
}

} // namespace hybmss
