// A network's numbering is the caller's business: any numbering gives the same forces and the same motion.

#include "tests/moving_body.hpp"

#include "hybmss/force_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace hybmss {
namespace {

struct Renumbered {
    Network network;
    std::vector<std::size_t> number; ///< new number of each node
};

/// The same body with nodes, springs and cells in random order.
Renumbered renumbered(const Network& old, unsigned seed) {
    std::mt19937 random(seed);
    Renumbered made{old, std::vector<std::size_t>(old.masses.size())};
    std::iota(made.number.begin(), made.number.end(), std::size_t{0});
    std::shuffle(made.number.begin(), made.number.end(), random);
    for (std::size_t n = 0; n < made.number.size(); ++n) {
        made.network.rest_positions[made.number[n]] = old.rest_positions[n];
        made.network.masses[made.number[n]] = old.masses[n];
    }
    const auto apply = [&](std::int32_t& n) {
        n = static_cast<std::int32_t>(made.number[static_cast<std::size_t>(n)]);
    };
    for (auto& s : made.network.springs) {
        apply(s.a);
        apply(s.b);
    }
    for (auto& c : made.network.cells) {
        std::for_each(c.nodes.begin(), c.nodes.end(), apply);
    }
    std::shuffle(made.network.springs.begin(), made.network.springs.end(), random);
    std::shuffle(made.network.cells.begin(), made.network.cells.end(), random);
    return made;
}

Network body(SpringForm form) {
    Material material;
    material.poisson_ratio = 0.4;
    material.springs = form;
    Network network = Network::from_lattice(Lattice::box(14, 11, 9, 0.25), material);
    for (std::size_t n = 0; n < network.masses.size(); ++n) {
        network.masses[n] *= 1 + 0.5 * static_cast<double>(n % 7);
    }
    return network;
}
/// Springs between nodes, and cells; cells with springs on means alone.
const Network kBodies[] = {body(SpringForm::nodes), body(SpringForm::means)};

template <class T>
std::vector<T> permuted(const std::vector<T>& values, const std::vector<std::size_t>& number) {
    std::vector<T> out(values.size());
    for (std::size_t n = 0; n < number.size(); ++n) {
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(3 * n), 3,
                    out.begin() + static_cast<std::ptrdiff_t>(3 * number[n]));
    }
    return out;
}

template <class T>
double greatest_difference(const std::vector<T>& a, const std::vector<T>& b) {
    double greatest = 0, scale = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        greatest = std::max(greatest, static_cast<double>(std::abs(a[i] - b[i])));
        scale = std::max(scale, static_cast<double>(std::abs(a[i])));
    }
    return greatest / scale;
}

template <class T>
struct NetworkOrder : ::testing::Test {
    // The order of some thirty additions a node differs.
    static constexpr double kTolerance = 30 * static_cast<double>(std::numeric_limits<T>::epsilon());
};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(NetworkOrder, Precisions);

TYPED_TEST(NetworkOrder, ARandomNumberingGivesTheSameForcesAndEnergy) {
    using T = TypeParam;
    for (const Network& ordered : kBodies) {
        const Renumbered random = renumbered(ordered, 11);
        const std::size_t n = ordered.masses.size();
        const std::vector<T> u = testing::random_field<T>(n, 0.02, 3), v = permuted(u, random.number);
        for (const std::string& layout : network_layouts()) {
            for (InstructionSet set : available_instruction_sets()) {
                PlanOptions options;
                options.layout = layout;
                options.instruction_set = set;
                const ForcePlan<T> a(ordered, options), b(random.network, options);
                std::vector<T> fa(3 * n, T(0)), fb(3 * n, T(0));
                a.add_forces(VectorField<const T>::aos(u.data(), n), VectorField<T>::aos(fa.data(), n));
                b.add_forces(VectorField<const T>::aos(v.data(), n), VectorField<T>::aos(fb.data(), n));
                EXPECT_LT(greatest_difference(permuted(fa, random.number), fb), this->kTolerance) << layout;
                const double energy = a.energy(VectorField<const T>::aos(u.data(), n)).total();
                // Twenty thousand terms summed in another order: a random walk of the last bit.
                EXPECT_NEAR(b.energy(VectorField<const T>::aos(v.data(), n)).total(), energy,
                            5 * this->kTolerance * std::abs(energy))
                    << layout;
            }
        }
    }
}

/// State that is set and read, prescribed nodes, masses and both energies under a numbering that the plan changes.
TYPED_TEST(NetworkOrder, ARandomNumberingGivesTheSameMotion) {
    using T = TypeParam;
    for (const Network& ordered : kBodies) {
        const Renumbered random = renumbered(ordered, 12);
        const std::size_t n = ordered.masses.size();
        const std::vector<T> u = testing::random_field<T>(n, 0.01, 4);
        for (const std::string& layout : network_layouts()) {
            PlanOptions options;
            options.layout = layout;
            ExplicitDynamics<T> a(ordered, options), b(random.network, options);
            const auto prescribe = [](ExplicitDynamics<T>& dynamics, std::size_t node) {
                PrescribedNode p;
                p.node = static_cast<std::uint32_t>(node);
                p.axes = 5;
                p.displacement = {0.02, 0, -0.01};
                p.velocity = {0.5, 0, 0};
                dynamics.prescribe({&p, 1});
            };
            const auto v = permuted(u, random.number);
            a.set_displacements(VectorField<const T>::aos(u.data(), n));
            b.set_displacements(VectorField<const T>::aos(v.data(), n));
            a.set_velocities(VectorField<const T>::aos(u.data(), n));
            b.set_velocities(VectorField<const T>::aos(v.data(), n));
            prescribe(a, 100);
            prescribe(b, random.number[100]);
            const StepParameters step{0.3 * a.critical_time_step(), {0, -9.81, 1}, 0.2};
            a.step(step, 20);
            b.step(step, 20);
            std::vector<T> ua(3 * n), ub(3 * n);
            a.get_displacements(VectorField<T>::aos(ua.data(), n));
            b.get_displacements(VectorField<T>::aos(ub.data(), n));
            EXPECT_LT(greatest_difference(permuted(ua, random.number), ub), this->kTolerance) << layout;
            EXPECT_EQ(ub[3 * random.number[100]], static_cast<T>(0.02)) << layout;
            EXPECT_NEAR(b.kinetic_energy(), a.kinetic_energy(), this->kTolerance * a.kinetic_energy()) << layout;
        }
    }
}

} // namespace
} // namespace hybmss
