// Prony series: exact histories of a homogeneous deformation, the force as the gradient of what is stored, energy that
// is kept or told as taken out, and that nothing depends on threads.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/instruction_set.hpp"
#include "tests/kernels/hessian_plans.hpp"
#include "tests/moving_body.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

namespace hybmss {
namespace {

using reference::Vector3d;
using Field = std::vector<double>;

constexpr double kCellSize = 0.2;
const std::vector<Relaxation> kBranches = {{0.7, 0.03}, {0.4, 0.5}};

VectorField<double> view(Field& field) {
    return VectorField<double>::aos(field.data(), field.size() / 3);
}

std::vector<Vector3d> rest_of(const Lattice& lattice) {
    std::vector<Vector3d> rest;
    for (const std::uint32_t node : lattice.nodes()) {
        const auto x = lattice.rest_position(node);
        rest.emplace_back(x[0], x[1], x[2]);
    }
    return rest;
}

/// All nodes of a body are led by a homogeneous deformation u = e(t) A X.
template <class T = double>
struct LedBody {
    Lattice lattice = Lattice::box(3, 2, 4, kCellSize);
    std::vector<Vector3d> rest = rest_of(lattice);
    ExplicitDynamics<T> body;
    Eigen::Matrix3d shape;
    double time = 0;

    LedBody(const Material& material, const Eigen::Matrix3d& given, const std::vector<Relaxation>& branches = kBranches)
        : body(lattice, material), shape(given) {
        body.relax(lattice, material, branches);
        lead(0);
    }
    void lead(double part) {
        std::vector<PrescribedNode> nodes;
        for (std::uint32_t n = 0; n < rest.size(); ++n) {
            const Vector3d u = part * (shape * rest[n]);
            nodes.push_back({n, 7, {u[0], u[1], u[2]}, {0, 0, 0}});
        }
        body.prescribe(nodes);
    }
    /// So many steps on the way from one part to another.
    void ramp(double from, double to, double seconds, int steps) {
        for (int s = 1; s <= steps; ++s) {
            body.step({.time_step = seconds / steps});
            lead(from + (to - from) * s / steps);
        }
        time += seconds;
    }
    /// The stress (Pa) that the branches' forces on the face x-max make.
    Vector3d traction() {
        std::vector<T> forces(3 * rest.size());
        body.get_effect_forces(VectorField<T>::aos(forces.data(), rest.size()));
        Vector3d sum = Vector3d::Zero();
        for (std::size_t n = 0; n < rest.size(); ++n) {
            if (rest[n].x() > 3 * kCellSize - 1e-9) {
                sum -= Eigen::Map<const Eigen::Matrix<T, 3, 1>>(&forces[3 * n]).template cast<double>();
            }
        }
        return sum / (8 * kCellSize * kCellSize);
    }
};

/// Of a strain that grows steadily to 1 within `over` and stays.
double prony(double t, double over) {
    double sum = 0;
    for (const auto& [part, time] : kBranches) {
        sum += t <= over ? part * time / over * (1 - std::exp(-t / time))
                         : part * time / over * (1 - std::exp(-over / time)) * std::exp(-(t - over) / time);
    }
    return sum;
}

TEST(StressRelaxation, FollowsItsPronySeriesWhateverTheStep) {
    constexpr double kStrain = 1e-7, kOver = 0.1; // small: the law is linear then
    for (const double nu : {-0.3, 0.25, 0.45}) {
        const Material material{.young_modulus = 1e4, .poisson_ratio = nu};
        const double G = shear_modulus(material), lambda = 2 * G * nu / (1 - 2 * nu);
        for (const int steps : {1, 7}) { // exact for both: the step is no approximation
            Eigen::Matrix3d stretch = Eigen::Matrix3d::Zero();
            stretch(0, 0) = 1;
            stretch(1, 0) = 0.5;
            LedBody<> led(material, kStrain * stretch);
            led.ramp(0, 1, kOver, steps);
            EXPECT_NEAR(led.traction()[0], (lambda + 2 * G) * kStrain * prony(kOver, kOver),
                        1e-6 * (lambda + 2 * G) * kStrain);
            EXPECT_NEAR(led.traction()[1], 0.5 * G * kStrain * prony(kOver, kOver), 1e-6 * (lambda + 2 * G) * kStrain);
            led.ramp(1, 1, 0.4, 3 * steps);
            EXPECT_NEAR(led.traction()[0], (lambda + 2 * G) * kStrain * prony(0.5, kOver),
                        1e-6 * (lambda + 2 * G) * kStrain);
        }
    }
}

/// A step of a millionth of the branch's time changes float strains by some ten units of their last place.
TEST(StressRelaxation, LosesNothingInFloatToStepsThatAreShort) {
    constexpr double kStrain = 1e-3, kTime = 10, kStep = 1e-6 * kTime;
    constexpr int kSteps = 40000;
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    Eigen::Matrix3d stretch = Eigen::Matrix3d::Zero();
    stretch(0, 0) = 1;
    LedBody<float> led(material, kStrain * stretch, {{1, kTime}});
    led.lead(1);
    const double before = led.traction()[0];
    led.body.step({.time_step = kStep}, kSteps);
    EXPECT_NEAR(led.traction()[0] / before, std::exp(-kSteps * kStep / kTime), 3e-6);
    const EffectEnergy energy = led.body.effect_energies().at(0);
    const double all = energy.stored / std::exp(-2 * kSteps * kStep / kTime);
    EXPECT_NEAR(energy.dissipated, all - energy.stored, 1e-4 * all);
}

TEST(StressRelaxation, StoresAndTakesOutWhatTheWayPutsIn) {
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.4};
    Eigen::Matrix3d stretch = Eigen::Matrix3d::Zero();
    stretch(0, 0) = 1;
    for (const double over : {1e-5, 0.05, 3.0}) {
        LedBody<> led(material, 1e-6 * stretch);
        // The work of a steady way, by the closed form of its stress, many steps or one: all of it is told.
        led.ramp(0, 1, over, 1);
        const double G = shear_modulus(material), modulus = G * 2 * (1 - 0.4) / (1 - 0.8);
        double work = 0;
        for (const auto& [part, time] : kBranches) {
            const double x = over / time;
            work += part * (x - 1 + std::exp(-x)) / (x * x);
        }
        if (over < 1e-4) {
            work = 0.5 * (0.7 + 0.4); // where that cancels
        }
        work *= modulus * 1e-12 * 24 * std::pow(kCellSize, 3);
        const EffectEnergy energy = led.body.effect_energies().at(0);
        EXPECT_EQ(energy.name, "relaxation");
        EXPECT_NEAR(energy.stored + energy.dissipated, work, 2e-4 * work) << over; // x of 1e-5 / 0.03 is left out above
        EXPECT_GT(energy.dissipated, 0);
        EXPECT_GT(energy.stored, 0);
        led.ramp(1, 1, 50, 5);
        const EffectEnergy end = led.body.effect_energies().at(0);
        EXPECT_NEAR(end.dissipated, work, 2e-4 * work);
        EXPECT_LT(end.stored, 1e-12 * work);
    }
}

Lattice odd_body() {
    Lattice lattice = Lattice::box(4, 3, 3, kCellSize);
    lattice.set_cell_scale(1, 1, 1, 0);
    lattice.set_cell_scale(2, 0, 0, 3);
    lattice.set_cell_scale(3, 2, 2, 0);
    return lattice;
}

TEST(StressRelaxation, ForceIsTheGradientAndNeitherPushesNorTurns) {
    const Lattice lattice = odd_body();
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    const std::vector<Vector3d> rest = rest_of(lattice);
    ExplicitDynamics<double> body(lattice, material);
    body.relax(lattice, material, kBranches);
    Field old = testing::random_field<double>(rest.size(), 0.1 * kCellSize, 3);
    body.set_displacements(view(old));
    body.step({.time_step = 1e-9}); // the strains that it remembers
    Field u = testing::random_field<double>(rest.size(), 0.15 * kCellSize, 4), f(u.size());
    const auto stored = [&] {
        body.set_displacements(view(u));
        return body.effect_energies().at(0).stored;
    };
    stored();
    body.get_effect_forces(view(f));
    double largest = 0;
    for (const double x : f) {
        largest = std::max(largest, std::abs(x));
    }
    EXPECT_GT(largest, 1);
    for (const std::size_t i : {0u, 5u, 31u, 64u, 100u}) {
        constexpr double kStep = 1e-6 * kCellSize;
        const double before = u[i];
        u[i] = before + kStep;
        const double high = stored();
        u[i] = before - kStep;
        const double low = stored();
        u[i] = before;
        EXPECT_NEAR(f[i], -(high - low) / (2 * kStep), 1e-6 * largest) << i;
    }
    Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
    for (std::size_t n = 0; n < rest.size(); ++n) {
        const Vector3d own(&f[3 * n]);
        force += own;
        torque += (rest[n] + Vector3d(&u[3 * n])).cross(own);
    }
    EXPECT_LT(force.norm(), 1e-11 * largest);
    EXPECT_LT(torque.norm(), 1e-11 * largest);
}

TEST(StressRelaxation, KeepsItsEnergyAndTellsWhatItTakesOut) {
    const Lattice lattice = odd_body();
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    const auto imbalance = [&](double fraction) {
        ExplicitDynamics<double> body(lattice, material);
        body.relax(lattice, material, {{{0.5, 0.02}, {0.3, 0.3}}});
        Field u = testing::random_field<double>(body.node_count(), 0.02 * kCellSize, 5);
        body.set_displacements(view(u));
        const auto total = [&] {
            const EffectEnergy own = body.effect_energies().at(0);
            return body.kinetic_energy() + body.potential_energy().total() + own.stored + own.dissipated;
        };
        const double before = total(), step = 0.02 * fraction;
        body.step({.time_step = step, .integrator = Integrator::leapfrog}, std::lround(1 / step));
        EXPECT_GT(body.effect_energies().at(0).dissipated, 0.2 * before);
        return std::abs(total() / before - 1);
    };
    const double coarse = imbalance(0.25), fine = imbalance(0.0625);
    EXPECT_LT(coarse, 0.02);
    EXPECT_LT(fine, coarse / 8); // of the second order: a sixteenth
}

template <class T>
std::uint64_t bits(const Lattice& lattice, const Material& material, PlanOptions options,
                   std::span<const Relaxation> branches) {
    ExplicitDynamics<T> body(lattice, material, options);
    if (!branches.empty()) {
        body.relax(lattice, material, branches);
    }
    return testing::bits_after(body, kCellSize, {.time_step = 0.5 * body.critical_time_step()}, 20);
}

TEST(StressRelaxation, IsTheSameForAnyThreadsAndInEveryLayoutAndNothingWithoutBranches) {
    const Lattice lattice = Lattice::box(9, 6, 7, kCellSize);
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    PlanOptions one, four;
    one.threads = 1;
    four.threads = 4;
    EXPECT_EQ(bits<double>(lattice, material, one, kBranches), bits<double>(lattice, material, four, kBranches));
    EXPECT_EQ(bits<float>(lattice, material, one, kBranches), bits<float>(lattice, material, four, kBranches));
    EXPECT_NE(bits<float>(lattice, material, one, kBranches), bits<float>(lattice, material, one, {}));

    // At `exact` on every instruction set too, what has been taken out as well.
    std::vector<std::pair<std::uint64_t, double>> sets;
    for (const InstructionSet set : available_instruction_sets()) {
        PlanOptions options = one;
        options.accuracy = Accuracy::exact;
        options.instruction_set = set;
        ExplicitDynamics<float> body(lattice, material, options);
        body.relax(lattice, material, kBranches);
        sets.emplace_back(testing::bits_after(body, kCellSize, {.time_step = 2e-3}, 20),
                          body.effect_energies().at(0).dissipated);
        EXPECT_EQ(sets.back(), sets.front()) << name(set);
    }

    std::vector<Field> ends;
    for (const std::string& layout : distinct_lattice_layouts()) {
        PlanOptions options;
        options.layout = layout;
        ExplicitDynamics<double> body(lattice, material, options);
        body.relax(lattice, material, kBranches);
        Field u = testing::random_field<double>(body.node_count(), 0.02 * kCellSize, 5);
        body.set_displacements(view(u));
        body.step({.time_step = 0.002}, 20); // well below every layout's own bound
        body.get_displacements(view(u));
        ends.push_back(u);
        for (std::size_t i = 0; i < u.size(); ++i) {
            ASSERT_NEAR(u[i], ends[0][i], 1e-12 * kCellSize) << layout;
        }
    }
    // Taken away again: as if it had never been there.
    ExplicitDynamics<double> body(lattice, material, one);
    body.relax(lattice, material, kBranches);
    EXPECT_LT(body.critical_time_step(), ExplicitDynamics<double>(lattice, material, one).critical_time_step() / 1.44);
    body.relax(lattice, material, {});
    EXPECT_TRUE(body.effect_energies().empty());
    EXPECT_EQ(testing::bits_after(body, kCellSize, {.time_step = 0.5 * body.critical_time_step()}, 20),
              bits<double>(lattice, material, one, {}));
}

TEST(StressRelaxation, GoesOnWithItsMemoryAndWithoutCellsThatAreCut) {
    Lattice lattice = Lattice::box(4, 3, 3, kCellSize);
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3};
    const auto make = [&] {
        auto body = std::make_unique<ExplicitDynamics<double>>(lattice, material);
        body->relax(lattice, material, kBranches);
        return body;
    };
    const auto first = make(), second = make();
    const StepParameters step{.time_step = 0.5 * first->critical_time_step(), .integrator = Integrator::leapfrog};
    Field u = testing::random_field<double>(first->node_count(), 0.05 * kCellSize, 6);
    first->set_displacements(view(u));
    first->step(step, 11);
    second->set_exact_state(first->exact_state());
    second->set_effect_memory(first->effect_memory());
    first->step(step, 11);
    second->step(step, 11);
    EXPECT_EQ(first->exact_state(), second->exact_state());

    // A cut body has no force on a node that nothing touches, and the sum of all stays zero.
    const std::uint32_t cells[] = {static_cast<std::uint32_t>(lattice.cell_index(0, 0, 0)),
                                   static_cast<std::uint32_t>(lattice.cell_index(1, 1, 1))};
    EXPECT_EQ(first->remove_cells(lattice, cells), 2u);
    first->step(step, 3);
    Field f(u.size());
    first->get_effect_forces(view(f));
    Vector3d sum = Vector3d::Zero();
    for (std::size_t n = 0; n < f.size() / 3; ++n) {
        sum += Vector3d(&f[3 * n]);
    }
    EXPECT_EQ(Vector3d(f.data()), Vector3d::Zero());
    EXPECT_LT(sum.norm(), 1e-9);
    EXPECT_TRUE(first->finite());
}

/// The step that it says is stable is; a tenth more is not.
TEST(StressRelaxation, NarrowsTheStableStep) {
    const Lattice lattice = Lattice::box(1, 1, 1, kCellSize);
    const Material material{.young_modulus = 1e4, .poisson_ratio = 0.3, .springs = SpringForm::means};
    const auto grows = [&](double fraction) {
        ExplicitDynamics<double> body(lattice, material);
        body.relax(lattice, material, {{{2, 1e6}}});
        Field u = testing::random_field<double>(8, 1e-6 * kCellSize, 5);
        body.set_displacements(view(u));
        body.step({.time_step = fraction * body.critical_time_step()}, 2000);
        return !(body.kinetic_energy() < 1e-6);
    };
    EXPECT_FALSE(grows(0.99));
    EXPECT_TRUE(grows(1.1));
}

TEST(StressRelaxation, RefusesWhatIsNotAllowed) {
    const Lattice lattice = Lattice::box(2, 1, 1, kCellSize);
    ExplicitDynamics<float> body(lattice, {});
    for (const Relaxation& bad : {Relaxation{0, 1}, {-1, 1}, {1, 0}, {1, INFINITY}, {NAN, 1}, {2e6, 1}}) {
        EXPECT_THROW(body.relax(lattice, {}, {{bad}}), std::invalid_argument);
    }
    EXPECT_THROW(body.relax(lattice, {}, std::vector<Relaxation>(5, {1, 1})), std::invalid_argument);
    EXPECT_THROW(body.relax(Lattice::box(2, 2, 1, kCellSize), {}, kBranches), std::invalid_argument);
    EXPECT_TRUE(body.effect_energies().empty());
}

} // namespace
} // namespace hybmss
