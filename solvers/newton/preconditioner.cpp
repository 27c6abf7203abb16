#include "solvers/newton/preconditioner.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

Eigen::Matrix3d symmetric(const std::array<double, 6>& b) {
    Eigen::Matrix3d matrix;
    matrix << b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5];
    return matrix;
}

std::array<double, 6> entries(const Eigen::Matrix3d& m) {
    return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}

/// Eigenvalues of a block below this part of its largest count as that. (A corner node with a single, nearly
/// incompressible cell has a ratio of G / kappa.)
constexpr double kSmallest = 1e-6;

} // namespace

std::array<double, 6> bounded_inverse(const std::array<double, 6>& block, unsigned held, double smallest,
                                      double of_zero) {
    Eigen::Matrix3d matrix = symmetric(block);
    const Eigen::Vector3d free(held & 1 ? 0 : 1, held & 2 ? 0 : 1, held & 4 ? 0 : 1);
    matrix = free.asDiagonal() * matrix * free.asDiagonal();
    if (held == 0) {
        // Most blocks are positive definite (Sylvester's criterion) and far from singular: the adjugate will do.
        const double determinant = matrix.determinant(), trace = matrix.trace();
        if (trace > 0 && determinant > 0.01 * trace * trace * trace / 27 && matrix(0, 0) > 0 &&
            matrix(0, 0) * matrix(1, 1) > matrix(0, 1) * matrix(0, 1)) {
            return entries(matrix.inverse());
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
    const Eigen::Vector3d magnitudes = solver.eigenvalues().cwiseAbs();
    const double largest = magnitudes.maxCoeff();
    Eigen::Vector3d values = Eigen::Vector3d::Constant(of_zero);
    if (largest > 0) {
        values = magnitudes.cwiseMax(smallest * largest).cwiseInverse();
    }
    Eigen::Matrix3d inverse = solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
    inverse = free.asDiagonal() * inverse * free.asDiagonal();
    return entries(inverse);
}

std::array<double, 6> bounded_pseudoinverse(const std::array<double, 6>& block, double smallest) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(symmetric(block));
    const double largest = solver.eigenvalues()[2];
    Eigen::Vector3d values = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
        if (largest > 0 && solver.eigenvalues()[i] > smallest * largest) {
            values[i] = 1 / solver.eigenvalues()[i];
        }
    }
    const Eigen::Matrix3d inverse = solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
    return entries(inverse);
}

template <class T>
void BlockJacobi<T>::update(const Potential<T>& potential) {
    const Body<T>& body = potential.body();
    if (potential_ != &potential) {
        potential_ = &potential;
        places_.resize(body.node_count());
        for (std::size_t n = 0; n < places_.size(); ++n) {
            places_[n] = static_cast<std::uint32_t>(body.index_of(n));
        }
    }
    potential.diagonal(inverse_);
    const std::span<const double> pull = potential.pull_stiffness();
    constexpr std::size_t kPiece = 2048;
    body.workers().run((places_.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, places_.size()); ++n) {
            const std::size_t place = places_[n];
            const auto entry = [&](std::size_t e) { return static_cast<double>(inverse_[e][place]); };
            const double more = pull.empty() ? 0 : pull[n];
            const std::array<double, 6> inverse =
                bounded_inverse({entry(0) + more, entry(3), entry(4), entry(1) + more, entry(5), entry(2) + more},
                                potential.held()[n], kSmallest, 1);
            constexpr std::size_t kOrder[6] = {0, 3, 4, 1, 5, 2};
            for (std::size_t e = 0; e < 6; ++e) {
                inverse_[kOrder[e]][place] = static_cast<T>(inverse[e]);
            }
        }
    });
}

template <class T>
void BlockJacobi<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    const T* b[6];
    for (std::size_t e = 0; e < 6; ++e) {
        b[e] = inverse_[e].data();
    }
    const auto multiply = [&](std::size_t place, const T* in[3], T* out[3], std::size_t at) {
        const T x = in[0][at], y = in[1][at], w = in[2][at];
        out[0][at] = b[0][place] * x + b[3][place] * y + b[4][place] * w;
        out[1][at] = b[3][place] * x + b[1][place] * y + b[5][place] * w;
        out[2][at] = b[4][place] * x + b[5][place] * y + b[2][place] * w;
    };
    const T* in[3];
    T* out[3];
    for (std::size_t c = 0; c < 3; ++c) {
        in[c] = component(r.field, c).first;
        out[c] = component(z.field, c).first;
    }
    const auto stride = static_cast<std::size_t>(component(r.field, 0).stride);
    constexpr std::size_t kPiece = 2048;
    const std::size_t places = inverse_[0].size();
    potential_->body().workers().run((places + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        const std::size_t end = std::min((piece + 1) * kPiece, places);
        if (stride == 1) {
            for (std::size_t p = piece * kPiece; p < end; ++p) {
                multiply(p, in, out, p);
            }
        } else {
            for (std::size_t p = piece * kPiece; p < end; ++p) {
                multiply(p, in, out, p * stride);
            }
        }
    });
}

template class BlockJacobi<float>;
template class BlockJacobi<double>;

namespace {

/// What a static solve may take, in Hessian products.
struct Expected {
    double block_jacobi, multigrid;
};

Expected expected(const Lattice& lattice, const Material& material, double reach) {
    const auto [shortest, longest] = std::minmax({lattice.cells()[0], lattice.cells()[1], lattice.cells()[2]});
    const double filled = static_cast<double>(lattice.cell_count());
    const double box = static_cast<double>(lattice.cell_scales().size());
    if (filled == 0) {
        return {0, 0};
    }
    const bool volume = resolved_volume_energy(material) != VolumeEnergy::none;
    const double stiff = volume ? std::max(volume_modulus(material) / shear_modulus(material), 0.0) : 0.0;
    const double length = static_cast<double>(longest) * longest / shortest;
    return {9.2 * std::min(length * std::pow(1 + stiff, 0.44), reach),
            (300 + 130 * std::pow(1 + stiff, 0.48)) * box / filled};
}

} // namespace

bool multigrid_pays(const Lattice& lattice, const Material& material, double reach) {
    const Expected products = expected(lattice, material, reach);
    return products.block_jacobi > products.multigrid;
}

double expected_products(const Lattice& lattice, const Material& material) {
    const Expected products = expected(lattice, material, std::numeric_limits<double>::infinity());
    return std::min(products.block_jacobi, products.multigrid);
}

} // namespace hybmss
