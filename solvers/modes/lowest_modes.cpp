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
        products_ += static_cast<long>(y.cols());
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

/// Random shapes, the same on every machine.
MatrixXd random_shapes(Index components, Index count) {
    std::mt19937 random(1);
    MatrixXd shapes(components, count);
    for (Index column = 0; column < count; ++column) {
        for (Index i = 0; i < components; ++i) {
            shapes(i, column) = static_cast<double>(random()) / 4294967296.0 - 0.5;
        }
    }
    return shapes;
}

using OfColumns = std::function<MatrixXd(const MatrixXd&)>;

/// A x = value B x, and what helps to find its lowest eigenvalues.
struct Pencil {
    OfColumns a, b;           ///< times columns; no b: the identity
    MatrixXd known;           ///< orthonormal shapes that are left out
    OfColumns preconditioned; ///< of residuals
    /// Their sizes: of the columns A x - value B x, with B x and the values.
    std::function<VectorXd(const MatrixXd& left, const MatrixXd& b_shapes, const VectorXd& values)> measure;
};

struct Eigenpairs {
    VectorXd values, residuals;
    MatrixXd shapes;
    int iterations = 0;
    bool converged = false;
};

/// Eigenvalues and vectors of a small pencil, the former ascending.
std::pair<VectorXd, MatrixXd> solve_densely(const MatrixXd& a, const MatrixXd* b) {
    if (b) {
        const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solved(a, *b);
        return {solved.eigenvalues(), solved.eigenvectors()};
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(a);
    return {solved.eigenvalues(), solved.eigenvectors()};
}

/// The `count` lowest, and perhaps more. LOBPCG, whose basis is made orthonormal in every iteration.
Eigenpairs lowest(const Pencil& pencil, Index components, Index count, const ModesOptions& options) {
    Eigenpairs found;
    const MatrixXd& known = pencil.known;
    const Index block = std::min(count + 3 + count / 4, components - known.cols());
    if (components <= std::max(kDense, 3 * block + known.cols())) {
        const MatrixXd every = MatrixXd::Identity(components, components);
        const MatrixXd a = pencil.a(every), b = pencil.b ? pencil.b(every) : every;
        // What is known goes to the end.
        const MatrixXd matrix = a + 2 * a.norm() * known * known.transpose();
        const auto [values, mix] = solve_densely(matrix, pencil.b ? &b : nullptr);
        found.values = values.head(count);
        found.shapes = mix.leftCols(count);
        const MatrixXd b_shapes = b * found.shapes;
        found.residuals =
            pencil.measure(a * found.shapes - b_shapes * found.values.asDiagonal(), b_shapes, found.values);
    } else {
        /// Orthonormal to each other and to what is known, which is why that goes first.
        const auto fresh = [&known](const MatrixXd& columns) {
            MatrixXd all(columns.rows(), known.cols() + columns.cols());
            all << known, columns;
            return MatrixXd(orthonormal(all).rightCols(columns.cols()));
        };
        found.shapes = fresh(pencil.preconditioned(random_shapes(components, block)));
        MatrixXd steps(components, 0), before = steps;
        while (true) {
            MatrixXd basis(components, found.shapes.cols() + steps.cols() + before.cols());
            basis << found.shapes, steps, before;
            basis = fresh(basis);
            const MatrixXd a = pencil.a(basis), b = pencil.b ? pencil.b(basis) : MatrixXd();
            const MatrixXd small_a = basis.transpose() * a;
            const MatrixXd small_b = pencil.b ? MatrixXd(basis.transpose() * b) : MatrixXd();
            const auto [values, vectors] = solve_densely(small_a, pencil.b ? &small_b : nullptr);
            const MatrixXd mix = vectors.leftCols(block);
            found.values = values.head(block);
            found.shapes = basis * mix;
            before = basis.rightCols(basis.cols() - block) * mix.bottomRows(basis.cols() - block);
            const MatrixXd b_shapes = pencil.b ? MatrixXd(b * mix) : found.shapes;
            const MatrixXd left = a * mix - b_shapes * found.values.asDiagonal();
            found.residuals = pencil.measure(left, b_shapes, found.values);
            const auto converged = (found.residuals.head(count).array() <= options.tolerance).count();
            if (converged == count || found.iterations >= options.iterations ||
                (options.progress && !options.progress(found.iterations, static_cast<int>(converged)))) {
                break;
            }
            ++found.iterations;
            steps = pencil.preconditioned(left);
            for (Index column = 0; column < steps.cols(); ++column) {
                const double size = steps.col(column).norm();
                steps.col(column) /= size > 0 ? size : 1;
            }
        }
    }
    found.converged =
        found.residuals.size() >= count && (found.residuals.head(count).array() <= options.tolerance).all();
    return found;
}

} // namespace

template <class T>
ModesResult lowest_modes(Potential<T>& potential, State<T>& state,
                         const std::function<Preconditioner<T>&(bool)>& choose, const ModesOptions& options) {
    ModesResult result;
    potential.release();
    potential.linearise(state, false);
    Scaled<T> scaled(potential);
    if (scaled.size() == 0) { // nothing can move
        result.converged = true;
        return result;
    }
    const RigidMotions rigid = rigid_motions(scaled, potential.held(), places(potential, state));
    const Index free_motions = rigid.shapes.cols();
    if (free_motions > 0) {
        std::vector<T> rest(3 * potential.body().node_count(), T(0)); // where it pulls to is no matter
        potential.pull(kPull * rigid.stretch, VectorField<T>::aos(rest.data(), rest.size() / 3));
    }
    Preconditioner<T>& preconditioner = choose(free_motions > 0);
    preconditioner.update(potential);

    result.rigid_motions = static_cast<int>(free_motions);
    result.preconditioner = preconditioner.name();
    const Index count = std::min<Index>(options.count, scaled.size() - free_motions);
    if (count == 0) {
        result.converged = true;
        return result;
    }
    const Eigenpairs found =
        lowest({[&](const MatrixXd& y) { return scaled.stiffness(y); },
                {},
                rigid.shapes,
                [&](const MatrixXd& y) { return scaled.preconditioned(preconditioner, y); },
                [count](const MatrixXd& left, const MatrixXd&, const VectorXd& values) -> VectorXd {
                    const double least = 1e-3 * values.head(count).cwiseAbs().maxCoeff();
                    return left.colwise().norm().transpose().cwiseQuotient(values.cwiseAbs().cwiseMax(least));
                }},
               scaled.size(), count, options);
    result.converged = found.converged;
    result.iterations = found.iterations;
    result.products = scaled.products();
    for (Index i = 0; i < count; ++i) {
        Mode& mode = result.modes.emplace_back();
        mode.eigenvalue = found.values[i];
        mode.residual = found.residuals[i];
        mode.shape = scaled.unscaled(found.shapes.col(i));
    }
    potential.release();
    return result;
}

template <class T>
BucklingResult buckling_loads(Potential<T>& potential, State<T>& rest, State<T>& reversed, State<T>& loaded,
                              double part, const std::function<void(double part)>& set,
                              Preconditioner<T>& preconditioner, const ModesOptions& options) {
    BucklingResult result;
    potential.release();
    set(0);
    potential.linearise(rest, false);
    Scaled<T> scaled(potential);
    if (scaled.size() == 0) { // nothing can move
        result.converged = true;
        return result;
    }
    if (rigid_motions(scaled, potential.held(), places(potential, rest)).shapes.cols() > 0) {
        result.message = "the body may move as a whole: it has no buckling loads";
        return result;
    }
    preconditioner.update(potential);
    result.preconditioner = preconditioner.name();
    const auto at = [&](State<T>& state, double of_loading, const MatrixXd& y) {
        set(of_loading);
        potential.linearise(state, false);
        return scaled.stiffness(y);
    };
    const Index count = std::min<Index>(options.count, scaled.size());
    const Eigenpairs found = lowest(
        {[&](const MatrixXd& y) { return MatrixXd((at(loaded, part, y) - at(reversed, -part, y)) / (2 * part)); },
         [&](const MatrixXd& y) { return at(rest, 0, y); }, MatrixXd(scaled.size(), 0),
         [&](const MatrixXd& y) { return scaled.preconditioned(preconditioner, y); },
         [](const MatrixXd& left, const MatrixXd& b_shapes, const VectorXd& values) -> VectorXd {
             const VectorXd sizes = b_shapes.colwise().norm().transpose().cwiseProduct(values.cwiseAbs());
             return left.colwise().norm().transpose().cwiseQuotient(sizes);
         }},
        scaled.size(), count, options);
    result.converged = found.converged;
    result.iterations = found.iterations;
    result.products = scaled.products();
    for (Index i = 0; i < count && found.values[i] < 0; ++i) {
        BucklingLoad& load = result.loads.emplace_back();
        load.factor = -1 / found.values[i];
        load.residual = found.residuals[i];
        load.shape = scaled.unscaled(found.shapes.col(i));
        double greatest = 0;
        for (const std::array<double, 3>& u : load.shape) {
            greatest = std::max(greatest, std::hypot(u[0], u[1], u[2]));
        }
        for (std::array<double, 3>& u : load.shape) {
            for (double& x : u) {
                x /= greatest;
            }
        }
    }
    if (result.loads.size() < static_cast<std::size_t>(count)) {
        // Values at zero, of shapes that the loading does nothing to, have no residual to speak of.
        result.converged = std::all_of(result.loads.begin(), result.loads.end(),
                                       [&](const BucklingLoad& load) { return load.residual <= options.tolerance; });
        result.message = result.loads.empty() ? "the loading makes the body buckle at no factor"
                                              : "the loading makes the body buckle in so many shapes only";
    }
    return result;
}

template BucklingResult buckling_loads(Potential<float>&, State<float>&, State<float>&, State<float>&, double,
                                       const std::function<void(double)>&, Preconditioner<float>&, const ModesOptions&);
template BucklingResult buckling_loads(Potential<double>&, State<double>&, State<double>&, State<double>&, double,
                                       const std::function<void(double)>&, Preconditioner<double>&,
                                       const ModesOptions&);
template ModesResult lowest_modes(Potential<float>&, State<float>&, const std::function<Preconditioner<float>&(bool)>&,
                                  const ModesOptions&);
template ModesResult lowest_modes(Potential<double>&, State<double>&,
                                  const std::function<Preconditioner<double>&(bool)>&, const ModesOptions&);

} // namespace hybmss
