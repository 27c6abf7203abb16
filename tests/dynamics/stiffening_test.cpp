// Springs that stiffen and cells that resist being crushed, the passes beside a body's own: forces, energy and second
// derivatives against the reference, for every layout, instruction set, accuracy and precision; the law itself on one
// spring and on a chain.

#include "hybmss/equilibrium.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/kernels/hessian_plans.hpp"
#include "tests/moving_body.hpp"

#include <gtest/gtest.h>

namespace hybmss {
namespace {

using reference::Matrix3d;
using reference::Vector3d;
using testing::kEpsilon;

constexpr double kCellSize = 0.3;

Material stiffened(double ratio, SpringStiffening law, double nu = 0.25) {
    Material material{1e4, nu, 1000, ratio};
    material.stiffening = law;
    return material;
}

template <class T>
struct Stiffening : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Stiffening, Precisions);

/// J0 is such that random displacements leave cells on both sides of it.
Material resisting(Material material, double ratio = 0.98) {
    material.crush = {20, ratio};
    return material;
}

struct Body {
    std::string name;
    Lattice lattice;
    Material material;
};

std::vector<Body> bodies() {
    testing::Random random(3);
    const Lattice masked = testing::random_lattice(9, 8, 7, kCellSize, random, 0.4);
    return {{"one cell", Lattice::box(1, 1, 1, kCellSize), stiffened(1, {1, 2})},
            {"box 17x4x7", Lattice::box(17, 4, 7, kCellSize), stiffened(0, {-2, 3}, 0.4)},
            {"mask 9x8x7", masked, stiffened(1, {0.5, 0}, 0.1)},
            {"mask 9x8x7", masked, stiffened(0, {0, 40})},
            {"crushed cell", Lattice::box(1, 1, 1, kCellSize), resisting({1e4, 0.25})},
            {"crushed box 17x4x7", Lattice::box(17, 4, 7, kCellSize), resisting({1e4, 0.4, 1000, 0})},
            {"crushed mask 9x8x7", masked, resisting(stiffened(1, {0.5, 0}, 0.1))},
            {"crushed means 9x8x7", masked, testing::with_springs_on(SpringForm::means, resisting({1e4, 0.3}))}};
}

template <class T>
std::vector<Vector3d> forces(const ForcePlan<T>& plan, std::span<const Vector3d> u) {
    const std::vector<T> at = testing::interleaved<T>(u);
    std::vector<T> out(at.size(), T(0));
    plan.add_forces(VectorField<const T>::aos(at.data(), u.size()), VectorField<T>::aos(out.data(), u.size()));
    return testing::vectors(out);
}

// As in hessian_test.cpp; the scales know by how much stiffening passes a strain's rounding on.
TYPED_TEST(Stiffening, AgreesWithTheReference) {
    using T = TypeParam;
    testing::Random random(7);
    for (const Body& c : bodies()) {
        const reference::Body body = reference::assemble(c.lattice, c.material);
        const std::size_t nodes = body.rest.size();
        const auto p = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
        for (double strain : {1e-4, 0.1, 0.5}) {
            const auto u = testing::as_held<T>(testing::random_displacement(nodes, strain * kCellSize, random));
            const std::vector<Vector3d> force = reference::forces(body, u), product = hessian_product(body, u, p);
            const std::vector<Matrix3d> blocks = reference::hessian_diagonal(body, u);
            const reference::Energy energy = reference::energy(body, u);
            const double force_scale = testing::largest(reference::force_scale(body, u));
            const double product_scale = testing::largest(reference::hessian_product_scale(body, u, p));
            testing::for_every_plan<T>(c.lattice, c.material, [&](const ForcePlan<T>& plan, const std::string& label) {
                const double limit = label.starts_with("flat-rows") || sizeof(T) == 4 ? 6 : 25;
                const std::string trace = c.name + ", " + label + ", strain " + std::to_string(strain);
                EXPECT_LE(testing::largest_difference(forces(plan, u), force) / force_scale / kEpsilon<T>, limit)
                    << trace;
                EXPECT_LE(testing::largest_difference(testing::product(plan, u, p), product) / product_scale /
                              kEpsilon<T>,
                          limit)
                    << trace;
                const std::vector<Matrix3d> found = testing::diagonal(plan, u);
                double most = 0;
                for (std::size_t n = 0; n < nodes; ++n) {
                    most = std::max(most, (found[n] - blocks[n]).cwiseAbs().maxCoeff());
                }
                EXPECT_LE(most * kCellSize / product_scale / kEpsilon<T>, limit) << trace;
                const std::vector<T> at = testing::interleaved<T>(u);
                const PotentialEnergy found_energy = plan.energy(VectorField<const T>::aos(at.data(), nodes));
                EXPECT_NEAR(found_energy.springs, energy.springs, 200 * kEpsilon<T> * energy.springs) << trace;
                EXPECT_NEAR(found_energy.volume, energy.volume, 2000 * kEpsilon<T> * energy.total()) << trace;
            });
        }
    }
}

// Ends that meet and pass each other: e = -1 at least, and finite.
TYPED_TEST(Stiffening, CoincidentEndsStayFinite) {
    using T = TypeParam;
    const Lattice lattice = Lattice::box(2, 1, 1, kCellSize);
    const Material material = stiffened(1, {1, 2});
    std::vector<Vector3d> u(12, Vector3d::Zero());
    u[1] = {-kCellSize, 0, 0}; // onto node 0
    u[8] = {-2 * kCellSize, 0, 0};
    testing::for_every_plan<T>(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
        const double most = 1e4 * kCellSize * kCellSize * 100;
        for (const Vector3d& f : forces(plan, u)) {
            EXPECT_TRUE(f.allFinite() && f.norm() < most) << label << " " << f.transpose();
        }
        for (const Vector3d& f : testing::product(plan, u, u)) {
            EXPECT_TRUE(f.allFinite()) << label;
        }
    });
}

/// The step kicks by the force of the displacements before it, in every layout: two steps of a free lattice, by hand.
TYPED_TEST(Stiffening, StepsAreThoseOfTheForces) {
    using T = TypeParam;
    const Lattice lattice = Lattice::box(4, 3, 5, kCellSize);
    for (const SpringForm form : testing::kSpringForms) {
        const Material material = testing::with_springs_on(form, stiffened(1, {1, 20}, 0.4));
        const reference::Body body = reference::assemble(lattice, material);
        testing::Random random(5);
        const auto start = testing::as_held<T>(testing::random_displacement(body.rest.size(), 0.2 * kCellSize, random));
        for (const std::string& layout : distinct_lattice_layouts()) {
            PlanOptions options;
            options.layout = layout;
            ExplicitDynamics<T> dynamics(lattice, material, options);
            const std::size_t nodes = dynamics.node_count();
            const std::vector<T> at = testing::interleaved<T>(std::span<const Vector3d>(start));
            dynamics.set_displacements(VectorField<const T>::aos(at.data(), nodes));
            const double dt = 0.3 * dynamics.critical_time_step();
            dynamics.step({dt}, 2);
            std::vector<Vector3d> u = start, v(nodes, Vector3d::Zero());
            for (int step = 0; step < 2; ++step) {
                const std::vector<Vector3d> f = reference::forces(body, u);
                for (std::size_t n = 0; n < nodes; ++n) {
                    v[n] += dt * f[n] / body.mass[n];
                    u[n] += dt * v[n];
                }
            }
            std::vector<T> out(3 * nodes);
            dynamics.get_displacements(VectorField<T>::aos(out.data(), nodes));
            EXPECT_LE(testing::largest_difference(testing::vectors(out), u), 100 * kEpsilon<T> * kCellSize) << layout;
        }
    }
}

TYPED_TEST(Stiffening, ThreadsDoNotChangeABit) {
    using T = TypeParam;
    const Lattice lattice = Lattice::box(20, 20, 26, kCellSize);
    const Material material = stiffened(1, {1, 2});
    for (const std::string& layout : {std::string("flat-rows"), std::string("packed-xyzw")}) {
        std::uint64_t one = 0;
        for (int threads : {1, 2, 3}) {
            PlanOptions options;
            options.layout = layout;
            options.threads = threads;
            ExplicitDynamics<T> body(lattice, material, options);
            body.damp_springs(1e-4);
            const std::uint64_t bits =
                testing::bits_after(body, kCellSize, {0.3 * body.critical_time_step(), {0, -10, 0}}, 20);
            one = threads == 1 ? bits : one;
            EXPECT_EQ(bits, one) << layout << " " << threads;
        }
    }
}

/// `links` springs in a row, its first node held, all free along x alone.
Network chain(int links, const SpringStiffening& law) {
    Network network;
    for (int n = 0; n <= links; ++n) {
        network.rest_positions.push_back({0.5 * n, 0, 0});
        network.masses.push_back(2);
        if (n > 0) {
            network.springs.push_back({n - 1, n, 100, {0.5, 0, 0}});
        }
    }
    network.stiffening = law;
    return network;
}

// Every link carries the load: k l (e + a e^2 + b e^3) = F.
TEST(Stiffening, ChainUnderALoadHasTheLawsStrain) {
    for (int links : {1, 6}) {
        for (double e : {-0.4, 0.05, 0.3, 1.5}) {
            const SpringStiffening law{0.8, 1.5};
            const Network network = chain(links, law);
            EquilibriumSolver<double> solver(network);
            Loading loading;
            loading.forces.assign(network.masses.size(), {0, 0, 0});
            loading.forces.back()[0] = 100 * 0.5 * (e + law.quadratic * e * e + law.cubic * e * e * e);
            for (std::uint32_t n = 0; n < network.masses.size(); ++n) {
                loading.supports.push_back({n, static_cast<std::uint8_t>(n == 0 ? 7 : 6)});
            }
            std::vector<double> u(3 * network.masses.size(), 0.0);
            EquilibriumOptions options;
            options.tolerance = 1e-11;
            const auto result =
                solver.solve(loading, VectorField<double>::aos(u.data(), network.masses.size()), options);
            ASSERT_EQ(result.status, EquilibriumStatus::converged) << links << " " << e << " " << result.message;
            EXPECT_NEAR(u[3 * static_cast<std::size_t>(links)], 0.5 * e * links, 1e-9 * links);
        }
    }
}

// Where no cell is crushed, the resistance adds zero: forces and steps keep their bits.
TYPED_TEST(Stiffening, UncrushedCellsAreLeftAlone) {
    using T = TypeParam;
    const Lattice lattice = Lattice::box(9, 8, 7, kCellSize);
    testing::Random random(21);
    const auto u = testing::as_held<T>(testing::random_displacement(lattice.nodes().size(), 0.1 * kCellSize, random));
    for (const SpringForm form : testing::kSpringForms) {
        const Material plain = testing::with_springs_on(form, {1e4, 0.4});
        std::vector<Vector3d> force[2], product[2];
        std::uint64_t bits[2] = {};
        for (const bool resists : {false, true}) {
            const Material material = resists ? resisting(plain, 0.3) : plain;
            const ForcePlan<T> plan(lattice, material);
            force[resists] = forces(plan, u);
            product[resists] = testing::product(plan, u, u);
            ExplicitDynamics<T> body(lattice, material);
            bits[resists] = testing::bits_after(body, kCellSize, {0.3 * body.critical_time_step(), {0, -10, 0}}, 20);
        }
        EXPECT_EQ(force[0], force[1]);
        EXPECT_EQ(product[0], product[1]);
        EXPECT_EQ(bits[0], bits[1]);
    }
}

// A free body, pressed together, comes back without energy from nowhere.
TYPED_TEST(Stiffening, CrushedBodiesKeepTheirEnergy) {
    using T = TypeParam;
    const Lattice lattice = Lattice::box(5, 4, 6, kCellSize);
    const Material material = resisting({1e4, 0.25}, 0.7);
    ExplicitDynamics<T> body(lattice, material);
    const std::size_t nodes = body.node_count();
    std::vector<Vector3d> pressed;
    for (const std::uint32_t node : lattice.nodes()) {
        const auto x = lattice.rest_position(node);
        pressed.emplace_back(-0.3 * x[0], -0.2 * x[1], -0.3 * x[2]);
    }
    const std::vector<T> at = testing::interleaved<T>(std::span<const Vector3d>(pressed));
    body.set_displacements(VectorField<const T>::aos(at.data(), nodes));
    const auto total = [&] {
        const PotentialEnergy stored = body.potential_energy();
        return stored.springs + stored.volume + body.kinetic_energy();
    };
    const double before = total();
    EXPECT_GT(body.potential_energy().volume, 0);
    body.step({0.02 * body.critical_time_step()}, 2000);
    EXPECT_GT(body.kinetic_energy(), 0.1 * before);
    EXPECT_NEAR(total(), before, 0.01 * before);
}

// Off by default, and then not there: the same kernel and bytes as ever.
TEST(Stiffening, CostsNothingWhereItIsNotCalledFor) {
    const Lattice lattice = Lattice::box(5, 5, 5, kCellSize);
    const Material plain;
    const ExplicitDynamics<float> without(lattice, plain);
    EXPECT_EQ(without.describe().kernel.find("stiffening"), std::string::npos);
    EXPECT_EQ(without.describe().kernel.find("crush"), std::string::npos);
    Material law = plain;
    law.stiffening = {0.1, 0};
    for (const auto& [material, name] : {std::pair(law, "stiffening"), std::pair(resisting(plain), "crush")}) {
        const ExplicitDynamics<float> with(lattice, material);
        EXPECT_NE(with.describe().kernel.find(name), std::string::npos);
        EXPECT_LT(without.describe().bytes, with.describe().bytes);
    }
}

// nu = 1/4 has neither a volume kernel nor, with A = 0, kernels or arrays of face diagonals.
TEST(DerivedCases, LeaveOutWhatTheyMakeZero) {
    const Lattice lattice = Lattice::box(5, 5, 5, kCellSize);
    for (const char* layout : {"flat-rows", "active-rows"}) {
        PlanOptions options;
        options.layout = layout;
        const PlanDescription full = ForcePlan<float>(lattice, {1e4, 0.4, 1000, 1}, options).describe();
        const PlanDescription quarter = ForcePlan<float>(lattice, {1e4, 0.25, 1000, 1}, options).describe();
        const PlanDescription bare = ForcePlan<float>(lattice, {1e4, 0.25, 1000, 0}, options).describe();
        EXPECT_NE(full.kernel, quarter.kernel);
        EXPECT_NE(quarter.kernel, bare.kernel);
        EXPECT_EQ(quarter.kernel.find("quadratic"), std::string::npos) << quarter.kernel;
        EXPECT_EQ(full.bytes, quarter.bytes); // the volume force has no array of its own
        // flat-rows holds three of the six planes once.
        EXPECT_LE(bare.bytes + 3 * sizeof(float) * lattice.grid_node_count() / 2, quarter.bytes);
    }
    const PlanDescription network = ForcePlan<float>(Network::from_lattice(lattice, {1e4, 0.25, 1000, 0})).describe();
    EXPECT_EQ(network.springs, lattice.merged_springs(false).total());
    EXPECT_EQ(network.cells, 0u);
    const Material means = testing::with_springs_on(SpringForm::means, {1e4, 0.25, 1000, 0});
    const PlanDescription on_means = ForcePlan<float>(Network::from_lattice(lattice, means)).describe();
    EXPECT_EQ(on_means.kernel.rfind("network_means<no face diagonals, no volume, ", 0), 0u) << on_means.kernel;
    EXPECT_EQ(on_means.springs, springs_of(lattice, means).total());
}

} // namespace
} // namespace hybmss
