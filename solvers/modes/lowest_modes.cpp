#include "solvers/modes/lowest_modes.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <random>

namespace hybmss {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Below this part of a stretch's a motion's stiffness is that of rounding.
constexpr double kFree = 1e-7;
/// The pull on a body that moves freely, of a stretch's omega^2: less than that of its first vibration.
constexpr double kPull = 0.01;
/// Bodies with fewer free components are solved densely.
constexpr Index kDense = 60;

/// Orthonormal columns that span those given, the first ones the first.
MatrixXd orthonormal(const MatrixXd& columns) {
    const Eigen::HouseholderQR<MatrixXd> factors(columns);
    return factors.householderQ() * MatrixXd::Identity(columns.rows(), columns.cols());
}

/// y = M^(1/2) x over the free components, in which the problem is that of M^(-1/2) K M^(-1/2).
template <class T>
class Scaled {
public:
    explicit Scaled(Potential<T>& potential)
        : potential_(&potential), in_(potential.space().make()), out_(potential.space().make()),
          values_(3 * potential.body().node_count(), T(0)) {
        const std::span<const double> masses = potential.body().masses();
        std::vector<double> roots;
        for (std::size_t i = 0; i < values_.size(); ++i) {
            if (masses[i / 3] > 0 && (potential.held()[i / 3] >> (i % 3) & 1) == 0) {
                free_.push_back(i);
                roots.push_back(std::sqrt(masses[i / 3]));
            }
        }
        root_ = Eigen::Map<const VectorXd>(roots.data(), static_cast<Index>(roots.size()));
    }

    Index size() const { return root_.size(); }
    /// Of three numbers a node.
    MatrixXd scaled(const MatrixXd& x) const { return root_.asDiagonal() * x(free_, Eigen::all); }
    std::vector<std::array<double, 3>> unscaled(const VectorXd& y) const {
        std::vector<std::array<double, 3>> x(values_.size() / 3, {0, 0, 0});
        for (std::size_t i = 0; i < free_.size(); ++i) {
            const auto at = static_cast<Index>(i);
            x[free_[i] / 3][free_[i] % 3] = y[at] / root_[at];
        }
        return x;
    }

    /// 1/s^2
    MatrixXd stiffness(const MatrixXd& y) {
        MatrixXd products(y.rows(), y.cols());
        for (Index column = 0; column < y.cols(); ++column) {
            write(y.col(column).cwiseQuotient(root_));
            potential_->multiply(in_, out_);
            products.col(column) = read().cwiseQuotient(root_) / potential_->body().length_unit() -
                                   potential_->pull_strength() * y.col(column);
        }
        products_ += y.cols();
        return products;
    }
    MatrixXd preconditioned(Preconditioner<T>& preconditioner, const MatrixXd& y) {
        MatrixXd steps(y.rows(), y.cols());
        for (Index column = 0; column < y.cols(); ++column) {
            write(root_.cwiseProduct(y.col(column)));
            preconditioner.apply(in_, out_);
            steps.col(column) = root_.cwiseProduct(read());
        }
        return steps;
    }
    long products() const { return products_; }

private:
    void write(const VectorXd& x) {
        for (std::size_t i = 0; i < free_.size(); ++i) {
            values_[free_[i]] = static_cast<T>(x[static_cast<Index>(i)]);
        }
        potential_->body().write(VectorField<const T>::aos(values_.data(), values_.size() / 3), 1, in_.field);
    }
    VectorXd read() {
        std::vector<T> all(values_.size());
        potential_->body().read(out_.field, 1, VectorField<T>::aos(all.data(), all.size() / 3));
        VectorXd x(size());
        for (std::size_t i = 0; i < free_.size(); ++i) {
            x[static_cast<Index>(i)] = static_cast<double>(all[free_[i]]);
        }
        return x;
    }

    Potential<T>* potential_;
    NodeVector<T> in_, out_;
    std::vector<T> values_; ///< zero on held components
    std::vector<std::size_t> free_;
    VectorXd root_;
    long products_ = 0;
};

/// Where the nodes are, from the middle, in units of their greatest distance.
template <class T>
MatrixXd places(const Potential<T>& potential, const State<T>& state) {
    const Body<T>& body = potential.body();
    std::vector<T> u(3 * body.node_count());
    body.read(state.displacement, body.length_unit(), VectorField<T>::aos(u.data(), body.node_count()));
    MatrixXd x(3, static_cast<Index>(body.node_count()));
    for (Index n = 0; n < x.cols(); ++n) {
        const auto rest = potential.sections().rest_position(static_cast<std::size_t>(n));
        for (Index c = 0; c < 3; ++c) {
            x(c, n) = rest[static_cast<std::size_t>(c)] + static_cast<double>(u[static_cast<std::size_t>(3 * n + c)]);
        }
    }
    x.colwise() -= x.rowwise().mean().eval();
    const double size = x.colwise().norm().maxCoeff();
    return size > 0 ? MatrixXd(x / size) : x;
}

struct RigidMotions {
    MatrixXd shapes; ///< orthonormal
    double stretch;  ///< omega^2 of a stretch of the whole body
};

/// The motions of the whole body that neither supports nor forces resist.
template <class T>
RigidMotions rigid_motions(Scaled<T>& scaled, std::span<const std::uint8_t> held, const MatrixXd& x) {
    MatrixXd motions = MatrixXd::Zero(x.size(), 6);
    VectorXd stretch(x.size()), is_held(x.size());
    for (Index n = 0; n < x.cols(); ++n) {
        motions.block<3, 3>(3 * n, 0).setIdentity();
        motions.block<3, 3>(3 * n, 3) << 0, x(2, n), -x(1, n), -x(2, n), 0, x(0, n), x(1, n), -x(0, n), 0;
        stretch.segment<3>(3 * n) << x(0, n), -x(1, n) / 2, -x(2, n) / 2;
        const unsigned axes = held[static_cast<std::size_t>(n)];
        is_held.segment<3>(3 * n) << (axes & 1), (axes >> 1 & 1), (axes >> 2 & 1);
    }
    // Of those that leave every held component where it is, as far as rounding tells.
    const MatrixXd at_supports = is_held.asDiagonal() * motions;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> moved(at_supports.transpose() * at_supports);
    const Index left = (moved.eigenvalues().array() < 1e-12 * static_cast<double>(x.cols())).count();

    const VectorXd pulled = scaled.scaled(stretch);
    RigidMotions found{MatrixXd(scaled.size(), 0), 0};
    if (left == 0 || pulled.squaredNorm() == 0) {
        return found;
    }
    found.stretch = pulled.dot(scaled.stiffness(pulled).col(0)) / pulled.squaredNorm();
    MatrixXd candidates = scaled.scaled(motions * moved.eigenvectors().leftCols(left));
    // Nodes on a line or all in one place have fewer.
    const Eigen::SelfAdjointEigenSolver<MatrixXd> sizes(candidates.transpose() * candidates);
    const Index independent = (sizes.eigenvalues().array() > 1e-10 * sizes.eigenvalues().maxCoeff()).count();
    candidates = orthonormal(candidates * sizes.eigenvectors().rightCols(independent));
    const MatrixXd forces = scaled.stiffness(candidates);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> resisted(forces.transpose() * forces);
    const Index costless = (resisted.eigenvalues().array() <= std::pow(kFree * found.stretch, 2)).count();
    found.shapes = candidates * resisted.eigenvectors().leftCols(costless);
    return found;
}

/// Random shapes that the preconditioner has smoothed: the same on every machine, but for rounding.
template <class T>
MatrixXd start(Scaled<T>& scaled, Preconditioner<T>& preconditioner, Index count) {
    std::mt19937 random(1);
    MatrixXd shapes(scaled.size(), count);
    for (Index column = 0; column < count; ++column) {
        for (Index i = 0; i < shapes.rows(); ++i) {
            shapes(i, column) = static_cast<double>(random()) / 4294967296.0 - 0.5;
        }
    }
    return scaled.preconditioned(preconditioner, shapes);
}

} // namespace

template <class T>
ModesResult lowest_modes(Potential<T>& potential, State<T>& state,
                         const std::function<Preconditioner<T>&(bool)>& choose, const ModesOptions& options) {
    ModesResult result;
    potential.release();
    potential.linearise(state);
    Scaled<T> scaled(potential);
    if (scaled.size() == 0) { // nothing can move
        result.converged = true;
        return result;
    }
    const RigidMotions rigid = rigid_motions(scaled, potential.held(), places(potential, state));
    const MatrixXd& known = rigid.shapes;
    const bool moves = known.cols() > 0;
    if (moves) {
        std::vector<T> rest(3 * potential.body().node_count(), T(0)); // where it pulls to is no matter
        potential.pull(kPull * rigid.stretch, VectorField<T>::aos(rest.data(), rest.size() / 3));
    }
    Preconditioner<T>& preconditioner = choose(moves);
    preconditioner.update(potential);

    result.rigid_motions = static_cast<int>(known.cols());
    result.preconditioner = preconditioner.name();
    /// Orthonormal to each other and to what is known, which is why that goes first.
    const auto fresh = [&known](const MatrixXd& columns) {
        MatrixXd all(columns.rows(), known.cols() + columns.cols());
        all << known, columns;
        return MatrixXd(orthonormal(all).rightCols(columns.cols()));
    };
    const Index components = scaled.size(), most = components - known.cols(),
                count = std::min<Index>(options.count, most), block = std::min(count + 3 + count / 4, most);
    if (count == 0) {
        result.converged = true;
        return result;
    }
    VectorXd values, residuals;
    MatrixXd shapes;
    const auto measure = [&](const MatrixXd& left) {
        residuals = left.colwise().norm().transpose();
        const double least = 1e-3 * values.head(count).cwiseAbs().maxCoeff();
        for (Index i = 0; i < residuals.size(); ++i) {
            residuals[i] /= std::max(std::abs(values[i]), least);
        }
    };
    if (components <= std::max(kDense, 3 * block + known.cols())) {
        // What is known goes to the end.
        const MatrixXd products = scaled.stiffness(MatrixXd::Identity(components, components));
        const MatrixXd matrix = products + 2 * products.norm() * known * known.transpose();
        const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(matrix);
        values = solved.eigenvalues().head(count);
        shapes = solved.eigenvectors().leftCols(count);
        measure(products * shapes - shapes * values.asDiagonal());
    } else {
        shapes = fresh(start(scaled, preconditioner, block));
        MatrixXd steps(scaled.size(), 0), before = steps;
        while (true) {
            MatrixXd basis(scaled.size(), shapes.cols() + steps.cols() + before.cols());
            basis << shapes, steps, before;
            basis = fresh(basis);
            const MatrixXd products = scaled.stiffness(basis);
            const MatrixXd matrix = basis.transpose() * products;
            const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(matrix);
            const MatrixXd mix = solved.eigenvectors().leftCols(block);
            values = solved.eigenvalues().head(block);
            shapes = basis * mix;
            before = basis.rightCols(basis.cols() - block) * mix.bottomRows(basis.cols() - block);
            const MatrixXd left = products * mix - shapes * values.asDiagonal();
            measure(left);
            const auto converged = (residuals.head(count).array() <= options.tolerance).count();
            if (converged == count || result.iterations >= options.iterations ||
                (options.progress && !options.progress(result.iterations, static_cast<int>(converged)))) {
                break;
            }
            ++result.iterations;
            steps = scaled.preconditioned(preconditioner, left);
            for (Index column = 0; column < steps.cols(); ++column) {
                const double size = steps.col(column).norm();
                steps.col(column) /= size > 0 ? size : 1;
            }
        }
    }
    result.converged = residuals.size() >= count && (residuals.head(count).array() <= options.tolerance).all();
    result.products = scaled.products();
    for (Index i = 0; i < count; ++i) {
        Mode& mode = result.modes.emplace_back();
        mode.eigenvalue = values[i];
        mode.residual = residuals[i];
        mode.shape = scaled.unscaled(shapes.col(i));
    }
    potential.release();
    return result;
}

template ModesResult lowest_modes(Potential<float>&, State<float>&, const std::function<Preconditioner<float>&(bool)>&,
                                  const ModesOptions&);
template ModesResult lowest_modes(Potential<double>&, State<double>&,
                                  const std::function<Preconditioner<double>&(bool)>&, const ModesOptions&);

} // namespace hybmss
