#include "studies/stability/static_body.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "simulation/geometry/cells.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hybmss::stability {
namespace {

// The solver stops at 1e-8 by its own kernels; the reference rounds in another order.
constexpr double kResidual = 1e-7;
// Of the greatest eigenvalue: softer than that is neutral (a joint, a checkerboard), and may come out on either side.
constexpr double kNeutralCurvature = 1e-9;

std::vector<char> held_components(const Loading& loading, std::size_t nodes) {
    std::vector<char> held(3 * nodes, 0);
    for (const PrescribedNode& p : loading.supports) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            held[3 * p.node + axis] = p.axes >> axis & 1;
        }
    }
    return held;
}

/// The Hessian's rows and columns of the components that nothing holds.
Eigen::MatrixXd free_hessian(const Lattice& lattice, const Material& material, const Loading& loading,
                             const Vectors& u) {
    const Eigen::SparseMatrix<double> hessian = reference::hessian(reference::assemble(lattice, material), u);
    const std::vector<char> held = held_components(loading, u.size());
    std::vector<Eigen::Index> number(held.size(), -1);
    Eigen::Index free = 0;
    for (std::size_t c = 0; c < held.size(); ++c) {
        if (!held[c]) {
            number[c] = free++;
        }
    }
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(free, free);
    for (Eigen::Index column = 0; column < hessian.outerSize(); ++column) {
        for (Eigen::SparseMatrix<double>::InnerIterator it(hessian, column); it; ++it) {
            const Eigen::Index i = number[static_cast<std::size_t>(it.row())],
                               j = number[static_cast<std::size_t>(column)];
            if (i >= 0 && j >= 0) {
                dense(i, j) = it.value();
            }
        }
    }
    return dense;
}

Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& symmetric) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

int count_falling(const Eigen::MatrixXd& hessian) {
    if (hessian.rows() == 0) {
        return 0;
    }
    // Positive definite but for the neutral ones: one factorisation tells, and only where it fails are they counted.
    const double neutral = kNeutralCurvature * hessian.diagonal().cwiseAbs().maxCoeff();
    const Eigen::MatrixXd raised = hessian + neutral * Eigen::MatrixXd::Identity(hessian.rows(), hessian.rows());
    if (Eigen::LLT<Eigen::MatrixXd>(raised).info() == Eigen::Success) {
        return 0;
    }
    return static_cast<int>((eigenvalues(hessian).array() < -neutral).count());
}

} // namespace

std::string_view name(PlateMotion motion) {
    switch (motion) {
    case PlateMotion::compression:
        return "compression";
    case PlateMotion::tension:
        return "tension";
    case PlateMotion::shear:
        return "shear";
    default:
        return "torsion";
    }
}

Loading held_below(const Lattice& lattice) {
    const Vectors rest = rest_positions_of(lattice);
    Loading loading;
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n].y() == 0) {
            PrescribedNode& node = loading.supports.emplace_back();
            node.node = static_cast<std::uint32_t>(n);
        }
    }
    return loading;
}

Loading plates(const Lattice& lattice, PlateMotion motion, double strain) {
    const Vectors rest = rest_positions_of(lattice);
    const double h = lattice.cell_size(), height = lattice.cells()[1] * h, radius = lattice.cells()[0] * h / 2;
    const Vector3d axis(radius, 0, lattice.cells()[2] * h / 2);
    const Eigen::AngleAxisd turn(strain * height / radius, Vector3d::UnitY());
    Loading loading = held_below(lattice);
    for (std::size_t n = 0; n < rest.size(); ++n) {
        if (rest[n].y() > height - h / 2) {
            const Vector3d arm = rest[n] - axis;
            const Vector3d u = motion == PlateMotion::compression ? Vector3d(0, -strain * height, 0)
                               : motion == PlateMotion::tension   ? Vector3d(0, strain * height, 0)
                               : motion == PlateMotion::shear     ? Vector3d(strain * height, 0, 0)
                                                                  : Vector3d(turn * arm - arm);
            PrescribedNode& node = loading.supports.emplace_back();
            node.node = static_cast<std::uint32_t>(n);
            node.displacement = {u.x(), u.y(), u.z()};
        }
    }
    return loading;
}

EquilibriumCheck check_equilibrium(const Lattice& lattice, const Material& material, const Loading& loading,
                                   const Vectors& u) {
    const reference::Body body = reference::assemble(lattice, material);
    const Vectors force = reference::forces(body, u);
    const std::vector<char> held = held_components(loading, u.size());
    double unbalanced = 0, carried = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double sum = force[n][static_cast<Eigen::Index>(axis)] + body.mass[n] * loading.acceleration[axis];
            if (!loading.forces.empty()) {
                sum += loading.forces[n][axis];
                carried = std::max(carried, std::abs(loading.forces[n][axis]));
            }
            carried = std::max(carried, body.mass[n] * std::abs(loading.acceleration[axis]));
            double& greatest = held[3 * n + axis] ? carried : unbalanced;
            greatest = std::isnan(sum) ? sum : std::max(greatest, std::abs(sum));
        }
    }
    // A body that nothing drives has no force to compare with; a strain of a hundredth stands for it.
    const double modulus = material.young_modulus + std::abs(volume_modulus(material));
    carried = std::max(carried, 1e-2 * modulus * lattice.cell_size() * lattice.cell_size());
    return {unbalanced / carried, count_falling(free_hessian(lattice, material, loading, u))};
}

VectorField<double> view(Vectors& vectors) {
    return VectorField<double>::aos(vectors.empty() ? nullptr : vectors.front().data(), vectors.size());
}

double least_curvature(const Lattice& lattice, const Material& material, const Loading& loading, const Vectors& u) {
    const Vectors rest(u.size(), Vector3d::Zero());
    return eigenvalues(free_hessian(lattice, material, loading, u))[0] /
           eigenvalues(free_hessian(lattice, material, loading, rest))[0];
}

double least_volume_ratio(const Lattice& lattice, const Vectors& u) {
    double least = HUGE_VAL;
    for (const auto& corners : cell_corners(lattice)) {
        std::vector<std::array<double, 3>> nodes;
        for (const std::uint32_t n : corners) {
            nodes.push_back({u[n].x(), u[n].y(), u[n].z()});
        }
        least = std::min(least, 1 + volume_ratio_minus_one(nodes, {0, 1, 2, 3, 4, 5, 6, 7}, lattice.cell_size()));
    }
    return least;
}

StaticSolve solve(const Lattice& lattice, const Material& material, const Loading& loading, Vectors start,
                  const EquilibriumOptions& options) {
    EquilibriumSolver<double> solver(lattice, material, one_thread());
    StaticSolve solve{std::move(start), {}, {}};
    solve.result = solver.solve(loading, view(solve.displacements), options);
    if (solve.converged()) {
        solve.check = check_equilibrium(lattice, material, loading, solve.displacements);
        require(solve.check.residual < kResidual,
                fmt::format("said to be converged, but the reference's residual is {:.1e}", solve.check.residual));
    } else {
        require(!solve.result.message.empty(), "not converged, and no message");
    }
    return solve;
}

Outcome unsolved(const StaticSolve& solve, const Lattice& lattice) {
    Outcome outcome = error(solve.result.message);
    outcome.iterations = solve.result.cg_iterations;
    outcome.residual = std::isfinite(solve.result.residual) ? std::optional(solve.result.residual) : std::nullopt;
    outcome.min_cell_volume_ratio = least_volume_ratio(lattice, solve.displacements);
    return outcome;
}

Outcome solved(const StaticSolve& solve, std::string how) {
    Outcome outcome = right(std::move(how));
    outcome.iterations = solve.result.cg_iterations;
    outcome.residual = solve.check.residual;
    outcome.min_cell_volume_ratio = solve.result.min_cell_volume_ratio;
    return outcome;
}

} // namespace hybmss::stability
