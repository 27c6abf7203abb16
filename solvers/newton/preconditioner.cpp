#include "solvers/newton/preconditioner.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <type_traits>

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
    const Eigen::Matrix3d matrix = symmetric(block);
    // With the sum of eigenvalues t and their product d > 0 the least is at least 4 d / t^2.
    const double determinant = matrix.determinant(), trace = matrix.trace();
    if (trace > 0 && determinant > 0.25 * smallest * trace * trace * trace && matrix(0, 0) > 0 &&
        matrix(0, 0) * matrix(1, 1) > matrix(0, 1) * matrix(0, 1)) {
        return entries(matrix.inverse());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
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
    potential.diagonal(inverse_, curvature_);
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
template <class Visit>
void BlockJacobi<T>::for_each_place(std::ptrdiff_t stride, const Visit& visit) const {
    constexpr std::size_t kPiece = 2048, kTogether = 8;
    static_assert(kPadding % kTogether == 0);
    const std::size_t places = inverse_[0].size();
    potential_->body().workers().run((places + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        const std::size_t end = std::min((piece + 1) * kPiece, places);
        if (stride == 1) {
            for (std::size_t p = piece * kPiece; p < end; p += kTogether) {
                visit(p, p, std::integral_constant<std::size_t, kTogether>());
            }
        } else {
            for (std::size_t p = piece * kPiece; p < end; ++p) {
                visit(p, p * static_cast<std::size_t>(stride), std::integral_constant<std::size_t, 1>());
            }
        }
    });
}

namespace {

template <class T, class Field>
std::array<T*, 3> components(Field& field) {
    return {component(field, 0).first, component(field, 1).first, component(field, 2).first};
}

/// z = B r at neighbouring places.
template <class T, std::size_t count>
void multiply(const AlignedArray<T> (&inverse)[6], std::size_t place, const T (&r)[3][count], T (&z)[3][count]) {
    constexpr std::size_t kEntry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    for (std::size_t c = 0; c < 3; ++c) {
        const T *x = inverse[kEntry[c][0]].data() + place, *y = inverse[kEntry[c][1]].data() + place,
                *w = inverse[kEntry[c][2]].data() + place;
        for (std::size_t n = 0; n < count; ++n) {
            z[c][n] = x[n] * r[0][n] + y[n] * r[1][n] + w[n] * r[2][n];
        }
    }
}

} // namespace

template <class T>
void BlockJacobi<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    const auto in = components<const T>(r.field);
    const auto out = components<T>(z.field);
    for_each_place(component(r.field, 0).stride, [&]<std::size_t count>(std::size_t place, std::size_t at,
                                                                        std::integral_constant<std::size_t, count>) {
        T from[3][count], to[3][count];
        for (std::size_t c = 0; c < 3; ++c) {
            std::copy_n(in[c] + at, count, from[c]);
        }
        multiply(inverse_, place, from, to);
        for (std::size_t c = 0; c < 3; ++c) {
            std::copy_n(to[c], count, out[c] + at);
        }
    });
}

template <class T>
void BlockJacobi<T>::correct(const NodeVector<T>& from, const NodeVector<T>* product, double keep, double add,
                             NodeVector<T>& r, NodeVector<T>& d, NodeVector<T>& x) {
    const T k = static_cast<T>(keep), a = static_cast<T>(add);
    const auto in = components<const T>(from.field), less = components<const T>((product ? product : &from)->field);
    const auto rest = components<T>(r.field), step = components<T>(d.field), to = components<T>(x.field);
    for_each_place(component(from.field, 0).stride, [&]<std::size_t count>(std::size_t place, std::size_t at,
                                                                           std::integral_constant<std::size_t, count>) {
        T left[3][count], z[3][count];
        for (std::size_t c = 0; c < 3; ++c) {
            std::copy_n(in[c] + at, count, left[c]);
            for (std::size_t n = 0; product && n < count; ++n) {
                left[c][n] -= less[c][at + n];
            }
        }
        multiply(inverse_, place, left, z);
        for (std::size_t c = 0; c < 3; ++c) {
            T by[count], sum[count] = {};
            for (std::size_t n = 0; n < count; ++n) {
                by[n] = a * z[c][n];
            }
            for (std::size_t n = 0; keep != 0 && n < count; ++n) { // else d may hold anything
                by[n] += k * step[c][at + n];
            }
            for (std::size_t n = 0; product && n < count; ++n) {
                sum[n] = to[c][at + n];
            }
            for (std::size_t n = 0; n < count; ++n) {
                sum[n] += by[n];
            }
            std::copy_n(left[c], count, rest[c] + at);
            std::copy_n(by, count, step[c] + at);
            std::copy_n(sum, count, to[c] + at);
        }
    });
}

template class BlockJacobi<float>;
template class BlockJacobi<double>;

double volume_to_shear(const Lattice& lattice, const Material& material) {
    const auto ratio = [](const Material& own) {
        return resolved_volume_energy(own) == VolumeEnergy::none ? 0 : volume_modulus(own) / shear_modulus(own);
    };
    double largest = ratio(material);
    for (std::size_t tissue = 1; tissue <= lattice.tissues().size(); ++tissue) {
        largest = std::max(largest, ratio(material_of(lattice, tissue, material)));
    }
    return largest;
}

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
    const double stiff = std::max(volume_to_shear(lattice, material), 0.0);
    const double length = static_cast<double>(longest) * longest / shortest;
    return {9.2 * std::min(length * std::pow(1 + stiff, 0.44), reach),
            (200 + 83 * std::pow(1 + stiff, 0.62)) * box / filled};
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
