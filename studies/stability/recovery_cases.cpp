/// Bodies let go from states far from rest, with damping: where do they settle?
///
/// The energy does not forbid inverted cells. Springs cannot tell a body from its mirror image, and kappa > 0 only
/// makes an inverted cell dearer; so there are stable equilibria besides rest. What must hold: a damped body settles,
/// its energy has not risen, and where it settles is rest or an equilibrium that the Hessian proves to be stable. Below
/// nu = 1/4 kappa < 0 rewards the falling volume of an inverted cell without bound, so from an inverted state the body
/// must be found to diverge, or come back.

#include "studies/stability/body_motion.hpp"
#include "studies/stability/hard_case.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hybmss::stability {
namespace {

constexpr int kCells = 4;
// Springs pressed to nothing and cells blown up are stiffer than at rest.
constexpr double kTimeStepFraction = 0.02;
constexpr long kStepsBetweenChecks = 500, kMostSteps = 400'000;
constexpr double kDamping = 3; // 1/s, about the slowest shear wave's frequency
constexpr double kResidual = 1e-7;
// Without face diagonals some ways to move cost energy of the fourth order only: they settle like 1/time, not like
// e^-time.
constexpr double kResidualWithoutFaceDiagonals = 1e-5;

enum class Shape { random, plane, line, point, mirrored, turned };
struct Start {
    Shape shape;
    const char* name;
    bool disturbed; ///< every node moved by up to a thousandth of a cell edge besides, which breaks the symmetry
};
constexpr Start kStarts[] = {
    {Shape::random, "random by 2 edges", false},    {Shape::plane, "flat", true},
    {Shape::plane, "exactly flat", false},          {Shape::line, "on a line", true},
    {Shape::point, "at 1e-6 of its size", true},    {Shape::mirrored, "mirror image", true},
    {Shape::mirrored, "exact mirror image", false}, {Shape::turned, "turned inside out (x -> -x)", true},
};

/// The displacements that make the shape.
Vectors displacements(const Start& start, const Vectors& rest) {
    if (start.shape == Shape::random) {
        return random_vectors(rest.size(), 2 * kCellSize, 11);
    }
    const Vector3d center = Vector3d::Constant(kCells * kCellSize / 2);
    const Vector3d factor = start.shape == Shape::plane      ? Vector3d(1, 1, 0)
                            : start.shape == Shape::line     ? Vector3d(1, 0, 0)
                            : start.shape == Shape::point    ? Vector3d(1e-6, 1e-6, 1e-6)
                            : start.shape == Shape::mirrored ? Vector3d(1, 1, -1)
                                                             : Vector3d(-1, -1, -1);
    // A point must stay small: its disturbance is a part of its own size.
    const double bound = start.shape == Shape::point ? 1e-6 * kCellSize : 1e-3 * kCellSize;
    Vectors u = random_vectors(rest.size(), start.disturbed ? bound : 0, 12);
    for (std::size_t n = 0; n < rest.size(); ++n) {
        u[n] += factor.cwiseProduct(rest[n] - center) + center - rest[n];
    }
    return u;
}

/// The least eigenvalue of the Hessian over the greatest.
double least_curvature(const Lattice& lattice, const Material& material, const Vectors& u) {
    const reference::Body body = reference::assemble(lattice, material);
    const Eigen::MatrixXd hessian = reference::hessian(body, u);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(hessian, Eigen::EigenvaluesOnly);
    return solver.eigenvalues().minCoeff() / solver.eigenvalues().maxCoeff();
}

struct Settled {
    bool settled = false, diverged = false;
    long steps = 0;
    double residual = 0; ///< largest nodal force over E h^2
    double speed = 0;    ///< sqrt of the kinetic energy over E h^3
};

Settled settle(BodyMotion<double>& motion, const Material& material, double start_energy) {
    StepParameters parameters;
    parameters.time_step = kTimeStepFraction * motion.critical_time_step();
    parameters.mass_damping = kDamping;
    const double force_scale = material.young_modulus * kCellSize * kCellSize;
    const double tolerance = material.face_diagonal_ratio > 0 ? kResidual : kResidualWithoutFaceDiagonals;
    Settled result;
    while (result.steps < kMostSteps && !result.settled && !result.diverged) {
        motion.step(parameters, kStepsBetweenChecks);
        result.steps += kStepsBetweenChecks;
        const double energy = motion.elastic_energy(), kinetic = motion.kinetic_energy();
        result.diverged = !(std::abs(energy) + kinetic < 1e3 * (start_energy + force_scale * kCellSize));
        result.residual = greatest_length(motion.forces()) / force_scale;
        result.speed = std::sqrt(kinetic / (force_scale * kCellSize));
        result.settled = result.residual < tolerance && result.speed < tolerance;
    }
    return result;
}

Outcome recover(const Start& start, const Material& material) {
    const Lattice lattice = Lattice::box(kCells, kCells, kCells, kCellSize);
    BodyMotion<double> motion(lattice, material);
    const Vectors from = displacements(start, motion.rest());
    motion.set_displacements(from);
    const double start_energy = motion.elastic_energy();
    const Settled end = settle(motion, material, start_energy);
    if (end.diverged) {
        require(material.poisson_ratio < 0.25, "diverged, though the energy is bounded below");
        Outcome outcome = error(
            fmt::format("diverged by step {}: kappa < 0 gives the energy of inverted cells no lower bound", end.steps));
        outcome.iterations = end.steps;
        return outcome;
    }
    require(end.settled, fmt::format("not settled after {} steps: residual {:.1e}, speed {:.1e}", end.steps,
                                     end.residual, end.speed));

    const double energy = motion.elastic_energy();
    const VolumeChange volume = motion.volume_change();
    const double scale = material.young_modulus * std::pow(kCells * kCellSize, 3);
    const bool unstressed = energy < 1e-12 * scale;
    std::string how;
    if (unstressed && volume.min_cell_volume_ratio > 0.9999) {
        how = "back at rest, up to a rigid motion";
    } else if (unstressed && volume.max_cell_volume_ratio < -0.9999) {
        how = "the mirror image of rest, which springs alone cannot tell from it";
    } else {
        const double curvature = least_curvature(lattice, material, motion.displacements());
        // A body that starts exactly symmetric stays so: the forces have no component that could break the symmetry.
        const bool kept_symmetry = !start.disturbed && start.shape != Shape::random;
        const double neutral = material.face_diagonal_ratio > 0 ? 1e-9 : 1e-6;
        require(curvature > -neutral || kept_symmetry,
                fmt::format("settled at a saddle (curvature {:.1e})", curvature));
        how = fmt::format("{} equilibrium with {}cells of ratio {:.2f} to {:.2f}, energy {:.1e} of the start's",
                          curvature > -neutral ? "another stable" : "the symmetric, unstable",
                          volume.min_cell_volume_ratio < 0 ? "inverted " : "", volume.min_cell_volume_ratio,
                          volume.max_cell_volume_ratio, energy / start_energy);
    }
    require(energy <= start_energy * (1 + 1e-9) + 1e-12 * scale, "the energy has risen: " + how);
    Outcome outcome = right(how);
    outcome.min_cell_volume_ratio = volume.min_cell_volume_ratio;
    outcome.residual = end.residual;
    outcome.iterations = end.steps;
    return outcome;
}

} // namespace

void append_recovery_cases(std::vector<HardCase>& cases, SpringForm springs) {
    struct Choice {
        double poisson_ratio, face_diagonal_ratio;
    };
    for (const Choice& choice : {Choice{0.25, 1}, Choice{0.25, 0}, Choice{0.4, 1}, Choice{0.49, 1}, Choice{0, 1}}) {
        for (const Start& start : kStarts) {
            const Material material = case_material(springs, choice.poisson_ratio, choice.face_diagonal_ratio);
            const bool bounded = choice.poisson_ratio >= 0.25;
            cases.push_back({fmt::format("recovery: {}, nu = {:g}, A = {:g}", start.name, choice.poisson_ratio,
                                         choice.face_diagonal_ratio),
                             bounded ? "settles at rest or in a proven equilibrium, energy not risen"
                                     : "comes back, or is found to diverge",
                             bounded ? Wanted::answer : Wanted::answer_or_error,
                             start.shape == Shape::random && choice.face_diagonal_ratio == 1,
                             [start, material] { return recover(start, material); }});
        }
    }
}

} // namespace hybmss::stability
