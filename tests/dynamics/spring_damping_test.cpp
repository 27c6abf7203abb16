// Damping along the springs: its forces against the reference in every layout, what it keeps, how fast it takes energy
// out, and up to which step.

#include "hybmss/equilibrium.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "tests/kernels/hessian_plans.hpp"
#include "tests/refusal.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>

namespace hybmss {
namespace {

using reference::Vector3d;
using testing::kEpsilon;

constexpr double kCellSize = 0.3;
const Material kMaterial{1e4, 0.3, 1000, 1};

template <class T>
struct SpringDamping : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(SpringDamping, Precisions);

template <class T>
void set_state(ExplicitDynamics<T>& body, std::span<const Vector3d> u, std::span<const Vector3d> v) {
    const std::vector<T> at = testing::interleaved<T>(u), speed = testing::interleaved<T>(v);
    body.set_displacements(VectorField<const T>::aos(at.data(), u.size()));
    body.set_velocities(VectorField<const T>::aos(speed.data(), v.size()));
}

template <class T, class Get>
std::vector<Vector3d> read(const ExplicitDynamics<T>& body, const Get& get) {
    std::vector<T> out(3 * body.node_count());
    get(VectorField<T>::aos(out.data(), body.node_count()));
    return testing::vectors(out);
}

double dissipated(const std::vector<EffectEnergy>& effects) {
    return effects.empty() ? 0 : effects.at(0).dissipated;
}

// Five epsilon of the largest force that |dv| makes, as for a product with the Hessian, of which this is a part.
TYPED_TEST(SpringDamping, ForcesAgreeWithTheReference) {
    using T = TypeParam;
    testing::Random random(3);
    std::vector<Lattice> lattices = {Lattice::box(1, 1, 1, kCellSize), Lattice::box(17, 4, 7, kCellSize),
                                     testing::random_lattice(9, 8, 7, kCellSize, random, 0.4)};
    for (const Lattice& lattice : lattices) {
        for (const auto& [ratio, form] : {std::pair{0.0, SpringForm::nodes},
                                          {1.0, SpringForm::nodes},
                                          {0.0, SpringForm::means},
                                          {1.0, SpringForm::means}}) {
            const Material material = testing::with_springs_on(form, {1e4, 0.3, 1000, ratio});
            const reference::Body body = reference::assemble(lattice, material);
            const std::size_t nodes = body.rest.size();
            const auto u = testing::as_held<T>(testing::random_displacement(nodes, 0.1 * kCellSize, random));
            const auto v = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
            const std::vector<Vector3d> expected = reference::damping_forces(body, 0.01, u, v);
            const double scale = 0.01 * testing::largest(reference::hessian_product_scale(body, u, v));
            for (const std::string& layout : distinct_lattice_layouts()) {
                for (InstructionSet set : available_instruction_sets()) {
                    for (Accuracy accuracy : {Accuracy::accurate, Accuracy::exact}) {
                        PlanOptions options;
                        options.layout = layout;
                        options.instruction_set = set;
                        options.accuracy = accuracy;
                        ExplicitDynamics<T> dynamics(lattice, material, options);
                        dynamics.damp_springs(0.01);
                        set_state<T>(dynamics, u, v);
                        const auto found = read(dynamics, [&](const auto& out) { dynamics.get_effect_forces(out); });
                        const double limit = layout.starts_with("flat-rows") || sizeof(T) == 4 ? 5 : 25;
                        EXPECT_LE(testing::largest_difference(found, expected) / scale / kEpsilon<T>, limit)
                            << testing::describe(form) << layout << " " << name(set) << " A = " << ratio;
                    }
                }
            }
        }
    }
}

// A step kicks by them: v_1 = v + dt (F + F_damping) / m.
TYPED_TEST(SpringDamping, StepIsThatOfTheSum) {
    using T = TypeParam;
    testing::Random random(4);
    const Lattice lattice = testing::random_lattice(5, 4, 7, kCellSize, random, 0.7);
    const reference::Body body = reference::assemble(lattice, kMaterial);
    const std::size_t nodes = body.rest.size();
    const auto u = testing::as_held<T>(testing::random_displacement(nodes, 0.1 * kCellSize, random));
    const auto v = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
    for (const std::string& layout : distinct_lattice_layouts()) {
        PlanOptions options;
        options.layout = layout;
        ExplicitDynamics<T> dynamics(lattice, kMaterial, options);
        const double beta = 0.1 * dynamics.critical_time_step();
        dynamics.damp_springs(beta);
        set_state<T>(dynamics, u, v);
        const double dt = 0.5 * dynamics.critical_time_step();
        dynamics.step({dt});
        const auto after = read(dynamics, [&](const auto& out) { dynamics.get_velocities(out); });
        const auto f = reference::forces(body, u), damping = reference::damping_forces(body, beta, u, v);
        std::vector<Vector3d> expected = v;
        double most = 0, kinetic = 0, kicked = 0;
        for (std::size_t n = 0; n < nodes; ++n) {
            expected[n] += dt / body.mass[n] * (f[n] + damping[n]);
            most = std::max(most, expected[n].norm());
            kinetic += 0.5 * body.mass[n] * v[n].squaredNorm();
            kicked += 0.5 * body.mass[n] * (v[n] + dt / body.mass[n] * damping[n]).squaredNorm();
        }
        EXPECT_LE(testing::largest_difference(after, expected), 60 * kEpsilon<T> * most) << layout;
        EXPECT_NEAR(dissipated(dynamics.effect_energies()), kinetic - kicked, 100 * kEpsilon<T> * kinetic) << layout;
    }
}

// A free body: linear momentum stays, and angular momentum, r x p about the moving nodes, which a central force between
// two nodes at one moment leaves alone.
TEST(SpringDamping, KeepsLinearAndAngularMomentum) {
    testing::Random random(5);
    const Lattice lattice = testing::random_lattice(6, 5, 7, kCellSize, random, 0.7);
    const reference::Body body = reference::assemble(lattice, kMaterial);
    const std::size_t nodes = body.rest.size();
    ExplicitDynamics<double> dynamics(lattice, kMaterial);
    dynamics.damp_springs(dynamics.critical_time_step());
    set_state<double>(dynamics, testing::random_displacement(nodes, 0.1 * kCellSize, random),
                      testing::random_displacement(nodes, 1, random));
    const auto momenta = [&] {
        const auto u = read(dynamics, [&](const auto& out) { dynamics.get_displacements(out); });
        const auto v = read(dynamics, [&](const auto& out) { dynamics.get_velocities(out); });
        std::array<Vector3d, 2> sums = {Vector3d::Zero(), Vector3d::Zero()};
        for (std::size_t n = 0; n < nodes; ++n) {
            sums[0] += body.mass[n] * v[n];
            sums[1] += body.mass[n] * (body.rest[n] + u[n]).cross(v[n]);
        }
        return sums;
    };
    const auto before = momenta();
    const double kinetic = dynamics.kinetic_energy();
    dynamics.step({0.5 * dynamics.critical_time_step()}, 200);
    const auto after = momenta();
    EXPECT_LT(dynamics.kinetic_energy(), 0.5 * kinetic);
    const double scale = 1000 * 8 * kCellSize * kCellSize * kCellSize * 100;
    EXPECT_LE((after[0] - before[0]).norm(), 1e-12 * scale);
    EXPECT_LE((after[1] - before[1]).norm(), 1e-12 * scale);
    // A rigid motion is not damped at all.
    std::vector<Vector3d> still(nodes, Vector3d::Zero()), turning;
    for (const Vector3d& x : body.rest) {
        turning.push_back(Vector3d(0.3, -0.2, 0.5).cross(x) + Vector3d(1, 2, 3));
    }
    set_state<double>(dynamics, still, turning);
    for (const Vector3d& f : read(dynamics, [&](const auto& out) { dynamics.get_effect_forces(out); })) {
        EXPECT_LE(f.norm(), 1e-9);
    }
}

/// Two masses and a spring.
Network pair() {
    Network network;
    network.rest_positions = {{0, 0, 0}, {0.5, 0, 0}};
    network.masses = {2, 2};
    network.springs = {{0, 1, 100, {0.5, 0, 0}}};
    return network;
}

// x'' + beta omega^2 x' + omega^2 x = 0, omega^2 = 2 k/m: the swing decays as exp(-beta omega^2 t / 2).
TEST(SpringDamping, SwingDecaysAtTheLawsRate) {
    ExplicitDynamics<double> body(pair());
    const double omega2 = 100, beta = 0.01;
    body.damp_springs(beta);
    const std::vector<double> v = {-0.05, 0, 0, 0.05, 0, 0};
    body.set_velocities(VectorField<const double>::aos(v.data(), 2));
    const double start = body.potential_energy().total() + body.kinetic_energy();
    const double dt = 1e-5, period = 2 * M_PI / std::sqrt(omega2 * (1 - beta * beta * omega2 / 4));
    const long steps = std::lround(3 * period / dt);
    body.step({dt}, steps);
    const double rate =
        std::log(start / (body.potential_energy().total() + body.kinetic_energy())) / (static_cast<double>(steps) * dt);
    EXPECT_NEAR(rate, beta * omega2, 1e-3 * beta * omega2);
    // What has gone is what was taken out.
    const double left = body.potential_energy().total() + body.kinetic_energy();
    EXPECT_NEAR(left + dissipated(body.effect_energies()), start, 1e-4 * start);
}

// For the pair the bound is exact: stable just below it, growing just above.
TEST(SpringDamping, CriticalStepIsTheDampedOne) {
    for (double beta : {0.0, 0.02, 0.3}) {
        for (double factor : {0.99, 1.01}) {
            ExplicitDynamics<double> body(pair());
            body.damp_springs(beta);
            const std::vector<double> v = {-1e-8, 0, 0, 1e-8, 0, 0};
            body.set_velocities(VectorField<const double>::aos(v.data(), 2));
            const double start = body.kinetic_energy();
            body.step({factor * body.critical_time_step()}, 600);
            const double end = body.kinetic_energy() + body.potential_energy().total();
            EXPECT_EQ(end < 1e3 * start, factor < 1) << beta << " " << factor << ": " << end / start;
        }
    }
    ExplicitDynamics<double> body(pair());
    const double undamped = body.critical_time_step();
    EXPECT_NEAR(undamped, 0.2, 1e-12); // 2 / omega
    body.damp_springs(0.1);
    EXPECT_NEAR(body.critical_time_step(), 4 / (0.1 * 100 + std::sqrt(100 + 400)), 1e-12);
    body.damp_springs(0);
    EXPECT_EQ(body.critical_time_step(), undamped);
    EXPECT_TRUE(body.effect_energies().empty());
}

// A lattice's bound is one too: at it a damped body that trembles comes to rest.
TEST(SpringDamping, LatticeIsStableAtItsCriticalStep) {
    for (double nu : {-0.3, 0.25, 0.45}) {
        const Lattice lattice = Lattice::box(4, 4, 5, kCellSize);
        ExplicitDynamics<double> body(lattice, {1e4, nu, 1000, 1});
        body.damp_springs(0.5 * body.critical_time_step());
        testing::Random random(6);
        const std::vector<Vector3d> zero(body.node_count(), Vector3d::Zero());
        set_state<double>(body, testing::random_displacement(body.node_count(), 1e-6 * kCellSize, random), zero);
        const double start = body.potential_energy().total();
        body.step({body.critical_time_step()}, 2000);
        EXPECT_LT(body.potential_energy().total(), start) << nu;
    }
}

// Along the spring, q its stretch and m/2 the pair's reduced mass: m/2 q'' = -k q - beta k q', both at the step's end.
TEST(SpringDamping, BackwardEulerHasItImplicitly) {
    const Network network = pair();
    for (double beta : {0.0, 0.05, 2.0}) {
        EquilibriumSolver<double> solver(network);
        solver.damp_springs(beta);
        std::vector<double> u(6, 0.0), v = {-0.05, 0, 0, 0.05, 0, 0};
        EquilibriumOptions options;
        options.tolerance = 1e-7; // of forces that nothing but inertia scales
        Loading loading;
        loading.supports = {{0, 6}, {1, 6}};
        const double dt = 0.05, k = 100, m = 1; // m: the reduced mass
        double q = 0, speed = 0.1, out = 0;
        for (int step = 0; step < 5; ++step) {
            const auto result = solver.step(loading, dt, 0, VectorField<double>::aos(u.data(), 2),
                                            VectorField<double>::aos(v.data(), 2), options);
            ASSERT_EQ(result.status, EquilibriumStatus::converged) << result.message;
            speed = (m * speed - dt * k * q) / (m + dt * dt * k + dt * beta * k);
            q += dt * speed;
            out += dt * beta * k * speed * speed;
            EXPECT_NEAR(u[3] - u[0], q, 1e-7) << beta;
            EXPECT_NEAR(v[3] - v[0], speed, 1e-6) << beta;
        }
        EXPECT_NEAR(dissipated(solver.effect_energies()), out, 1e-6);
    }
}

// No velocity, no damping: a static solve has the bits of one without.
TEST(SpringDamping, StaticSolveLeavesItOut) {
    const Lattice lattice = Lattice::box(3, 3, 4, kCellSize);
    std::vector<double> u[2];
    for (int damped : {0, 1}) {
        EquilibriumSolver<double> solver(lattice, kMaterial);
        solver.damp_springs(damped);
        Loading loading;
        for (std::uint32_t n = 0; n < 16; ++n) {
            loading.supports.push_back({n});
        }
        loading.acceleration = {0.1, 0, -0.3};
        u[damped].assign(3 * solver.node_count(), 0.0);
        const auto field = VectorField<double>::aos(u[damped].data(), solver.node_count());
        ASSERT_EQ(solver.solve(loading, field).status, EquilibriumStatus::converged);
    }
    EXPECT_EQ(u[0], u[1]);
}

TEST(SpringDamping, BadValuesAreRefused) {
    ExplicitDynamics<float> body(pair());
    EquilibriumSolver<float> solver(pair());
    for (double bad : {-1.0, std::nan(""), HUGE_VAL}) {
        testing::expect_refusal([&] { body.damp_springs(bad); }, {"stiffness_damping = ", "at least 0"});
        testing::expect_refusal([&] { solver.damp_springs(bad); }, {"stiffness_damping = ", "at least 0"});
    }
}

} // namespace
} // namespace hybmss
