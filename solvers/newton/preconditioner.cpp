#include "solvers/newton/preconditioner.hpp"

#include "kernels/grid_arguments.hpp"

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

namespace {

/// The kernel's formula for memory in which the components of a node lie side by side.
template <class T>
void pass_strided(kernels::BlockUse use, const kernels::NodeBlocks<T>& nodes, std::ptrdiff_t stride,
                  std::ptrdiff_t begin, std::ptrdiff_t end) {
    constexpr std::size_t kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    const bool less = use == kernels::BlockUse::restart || use == kernels::BlockUse::next;
    for (std::ptrdiff_t place = begin; place < end; ++place) {
        const std::ptrdiff_t n = place * stride;
        T rest[3];
        for (std::size_t c = 0; c < 3; ++c) {
            rest[c] = nodes.from[c][n];
            if (less) {
                rest[c] -= nodes.product[c][n];
            }
            if (less && nodes.weight[c]) {
                rest[c] -=
                    nodes.weight[c][n] * (use == kernels::BlockUse::next ? nodes.direction : nodes.solution)[c][n];
            }
            if (use != kernels::BlockUse::multiply) {
                nodes.rest[c][n] = rest[c];
            }
        }
        for (std::size_t c = 0; c < 3; ++c) {
            const T z = nodes.inverse[kEntry[c][0]][place] * rest[0] + nodes.inverse[kEntry[c][1]][place] * rest[1] +
                        nodes.inverse[kEntry[c][2]][place] * rest[2];
            if (use == kernels::BlockUse::multiply) {
                nodes.solution[c][n] = z;
                continue;
            }
            T& step = nodes.direction[c][n];
            step = use == kernels::BlockUse::next ? nodes.keep * step + nodes.add * z : nodes.add * z;
            nodes.solution[c][n] = use == kernels::BlockUse::first ? step : nodes.solution[c][n] + step;
        }
    }
}

} // namespace

template <class T>
void BlockJacobi<T>::pass(kernels::BlockUse use, const NodeVector<T>& from, const NodeVector<T>* product, double keep,
                          double add, NodeVector<T>& r, NodeVector<T>& d, NodeVector<T>& x) const {
    constexpr std::size_t kOrder[6] = {0, 3, 4, 1, 5, 2};
    const NodeVector<T>* const weight = potential_->pull_weight();
    kernels::NodeBlocks<T> nodes{};
    for (std::size_t e = 0; e < 6; ++e) {
        nodes.inverse[e] = inverse_[kOrder[e]].data();
    }
    for (std::size_t c = 0; c < 3; ++c) {
        nodes.from[c] = component(from.field, c).first;
        nodes.product[c] = product ? component(product->field, c).first : nullptr;
        nodes.weight[c] = weight ? component(weight->field, c).first : nullptr;
        nodes.rest[c] = component(r.field, c).first;
        nodes.direction[c] = component(d.field, c).first;
        nodes.solution[c] = component(x.field, c).first;
    }
    nodes.keep = static_cast<T>(keep);
    nodes.add = static_cast<T>(add);
    const Body<T>& body = potential_->body();
    const auto kernel = body.kernel_table().node_blocks(use, weight != nullptr);
    const std::ptrdiff_t stride = component(from.field, 0).stride;
    constexpr std::size_t kPiece = 2048;
    const std::size_t places = inverse_[0].size();
    body.workers().run((places + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
        const auto begin = static_cast<std::ptrdiff_t>(piece * kPiece);
        const auto end = static_cast<std::ptrdiff_t>(std::min((piece + 1) * kPiece, places));
        if (stride == 1) {
            kernel(nodes, begin, end);
        } else {
            pass_strided(use, nodes, stride, begin, end);
        }
    });
}

template <class T>
void BlockJacobi<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    pass(kernels::BlockUse::multiply, r, nullptr, 0, 0, z, z, z);
}

template <class T>
void BlockJacobi<T>::correct(const NodeVector<T>& from, const NodeVector<T>* product, double keep, double add,
                             NodeVector<T>& r, NodeVector<T>& d, NodeVector<T>& x) {
    pass(!product    ? kernels::BlockUse::first
         : keep == 0 ? kernels::BlockUse::restart
                     : kernels::BlockUse::next,
         from, product, keep, add, r, d, x);
}

template class BlockJacobi<float>;
template class BlockJacobi<double>;

namespace {

double volume_to_shear(const Material& material) {
    return resolved_volume_energy(material) == VolumeEnergy::none ? 0
                                                                  : volume_modulus(material) / shear_modulus(material);
}

} // namespace

double volume_to_shear(const Lattice& lattice, const Material& material) {
    double largest = volume_to_shear(material);
    for (std::size_t tissue = 1; tissue <= lattice.tissues().size(); ++tissue) {
        largest = std::max(largest, volume_to_shear(material_of(lattice, tissue, material)));
    }
    return largest;
}

namespace {

/// What the rules of preconditioner.hpp go by.
struct Proportions {
    double length;    ///< n
    double stiffness; ///< r
    double emptiness; ///< cells of the bounding box over those of the body
    int shortest;
};

Proportions measured(const std::array<int, 3>& cells, double present, double volume_to_shear) {
    const auto [shortest, longest] = std::minmax({cells[0], cells[1], cells[2]});
    const double all = static_cast<double>(cells[0]) * cells[1] * cells[2];
    return {static_cast<double>(longest) * longest / shortest, 1 + std::max(volume_to_shear, 0.0), all / present,
            shortest};
}
Proportions measured(const Lattice& lattice, const Material& material) {
    return measured(lattice.cells(), static_cast<double>(lattice.cell_count()), volume_to_shear(lattice, material));
}

double block_jacobi_products(const Proportions& body) {
    return 9.2 * body.length * std::pow(body.stiffness, 0.44);
}
double multigrid_products(const Proportions& body) {
    return (200 + 83 * std::pow(body.stiffness, 0.62)) * body.emptiness;
}
bool multigrid_pays(const Proportions& body) {
    return block_jacobi_products(body) > multigrid_products(body);
}

} // namespace

bool multigrid_pays(const Lattice& lattice, const Material& material) {
    return lattice.cell_count() > 0 && multigrid_pays(measured(lattice, material));
}
bool multigrid_pays(const std::array<int, 3>& cells, double present, const Material& material) {
    return present > 0 && multigrid_pays(measured(cells, present, volume_to_shear(material)));
}

bool multigrid_pays_in_step(const Lattice& lattice, const Material& material, double reach) {
    const Proportions body = measured(lattice, material);
    const double stiff = std::pow(body.stiffness, 0.44);
    const double thin = std::max(1.0, 8.0 / (body.shortest * body.shortest));
    return lattice.cell_count() > 0 &&
           10 * std::min(reach, 1.65 * body.length * stiff) > (30 + 7 * stiff) * body.emptiness * thin;
}

double expected_products(const Lattice& lattice, const Material& material) {
    const Proportions body = measured(lattice, material);
    return lattice.cell_count() > 0 ? std::min(block_jacobi_products(body), multigrid_products(body)) : 0;
}

} // namespace hybmss
