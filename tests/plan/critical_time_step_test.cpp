/// The estimated critical time step: against dense eigenvalues, and by what motions do on either side of it.

#include "hybmss/explicit_dynamics.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <cmath>
#include <random>

namespace hybmss {
namespace {

Material material(double nu, double ratio) {
    return {.young_modulus = 1e4, .poisson_ratio = nu, .density = 1000, .face_diagonal_ratio = ratio};
}

Lattice masked() {
    std::vector<float> scales(3 * 2 * 4, 1.0f);
    scales[5] = 0;
    scales[9] = 0.01f;
    scales[17] = 40;
    return Lattice::from_cells(3, 2, 4, 0.25, scales);
}

/// A light and stiff tissue, and one that is nearly incompressible, beside the material.
Lattice of_tissues() {
    Lattice lattice = Lattice::box(3, 2, 4, 0.25);
    std::vector<std::uint8_t> of_cells(3 * 2 * 4, 0);
    of_cells[7] = of_cells[8] = 1;
    of_cells[20] = 2;
    lattice.set_tissues({{0.1, 50}, {0.499, 3000}}, of_cells);
    return lattice;
}

double dense_step(const Lattice& lattice, const Material& of, std::span<const Eigen::Vector3d> u) {
    const reference::Body body = reference::assemble(lattice, of);
    Eigen::MatrixXd k = reference::hessian(body, u);
    for (Eigen::Index i = 0; i < k.rows(); ++i) {
        for (Eigen::Index j = 0; j < k.cols(); ++j) {
            k(i, j) /=
                std::sqrt(body.mass[static_cast<std::size_t>(i / 3)] * body.mass[static_cast<std::size_t>(j / 3)]);
        }
    }
    return 2 / std::sqrt(
                   Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

TEST(CriticalTimeStep, EstimateMeetsTheDenseEigenvalue) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> shift(-0.03, 0.03);
    for (const Lattice& lattice : {Lattice::box(1, 1, 1, 0.5), Lattice::box(4, 3, 2, 0.5), masked(), of_tissues()}) {
        for (const Material& of : {material(0.25, 1), material(0.49, 1), material(-0.3, 0.1)}) {
            const ForcePlan<double> plan(lattice, of);
            std::vector<double> flat(3 * plan.node_count(), 0.0);
            std::vector<Eigen::Vector3d> u(plan.node_count(), Eigen::Vector3d::Zero());
            for (const bool deformed : {false, true}) {
                for (std::size_t i = 0; deformed && i < flat.size(); ++i) {
                    flat[i] = u[i / 3][static_cast<Eigen::Index>(i % 3)] = shift(random);
                }
                const double expected = dense_step(lattice, of, u);
                const double estimate =
                    plan.estimate_critical_time_step(VectorField<const double>::aos(flat.data(), plan.node_count()));
                EXPECT_NEAR(estimate, expected, 1e-3 * expected);
                EXPECT_GE(estimate, (1 - 1e-9) * expected);
                if (!deformed) {
                    EXPECT_LE(plan.critical_time_step(), (1 + 1e-9) * expected);
                }
            }
        }
    }
}

/// As networks, whose cells share no springs: what is largest of one cell decides likewise.
TEST(CriticalTimeStep, OfSpringsOnMeansIsTheLattices) {
    for (const Lattice& lattice : {Lattice::box(4, 3, 2, 0.5), masked()}) {
        for (Material of : {material(0.25, 1), material(0.49, 0), material(-0.3, 0.1)}) {
            of.springs = SpringForm::means;
            const ForcePlan<double> network(Network::from_lattice(lattice, of));
            const double of_lattice = ForcePlan<double>(lattice, of).critical_time_step();
            const std::vector<Eigen::Vector3d> rest(network.node_count(), Eigen::Vector3d::Zero());
            EXPECT_LE(network.critical_time_step(), (1 + 1e-9) * dense_step(lattice, of, rest));
            EXPECT_GE(network.critical_time_step(), (1 - 1e-9) * of_lattice);
        }
    }
    Material of = material(0.49, 0);
    of.springs = SpringForm::means;
    const Lattice box = Lattice::box(4, 3, 2, 0.5);
    EXPECT_NEAR(ForcePlan<double>(Network::from_lattice(box, of)).critical_time_step() /
                    ForcePlan<double>(box, of).critical_time_step(),
                1, 1e-9);
}

/// The largest speed after many steps, by that at the start.
double growth(const Lattice& lattice, double time_step) {
    ExplicitDynamics<double> body(lattice, material(0.3, 1));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> speed(-1e-9, 1e-9);
    std::vector<double> v(3 * body.node_count());
    for (double& component : v) {
        component = speed(random);
    }
    body.set_velocities(VectorField<const double>::aos(v.data(), body.node_count()));
    body.step({.time_step = time_step}, 1000);
    body.get_velocities(VectorField<double>::aos(v.data(), body.node_count()));
    double most = 0;
    for (const double component : v) {
        most = std::abs(component) <= most ? most : std::abs(component); // a NaN counts
    }
    return most / 1e-9;
}

TEST(CriticalTimeStep, MotionsAreBoundedBelowItAndGrowAboveIt) {
    const Lattice lattice = Lattice::box(4, 3, 5, 0.5);
    const ForcePlan<float> plan(lattice, material(0.3, 1));
    const std::vector<float> rest(3 * plan.node_count(), 0.0f);
    const double step = plan.estimate_critical_time_step(VectorField<const float>::aos(rest.data(), plan.node_count()));
    EXPECT_LT(growth(lattice, 0.99 * step), 100);
    EXPECT_FALSE(growth(lattice, 1.01 * step) < 1e4); // or not a number
}

TEST(CriticalTimeStep, WrongSizeIsRefused) {
    const ForcePlan<double> plan(Lattice::box(1, 1, 1, 0.5), material(0.3, 1));
    EXPECT_THROW(plan.estimate_critical_time_step({}), std::invalid_argument);
}

} // namespace
} // namespace hybmss
