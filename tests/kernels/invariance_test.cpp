// What must hold of any force on a free body, for every layout, instruction set and precision.

#include "tests/moving_body.hpp"
#include "tests/random_bodies.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace hybmss {
namespace {

using reference::Matrix3d;
using reference::Vector3d;

template <class T>
struct Invariance : ::testing::Test {
    static constexpr double kEpsilon = static_cast<double>(std::numeric_limits<T>::epsilon());

    /// Calls check(plan, label) for every layout, instruction set and accuracy.
    template <class Check>
    static void for_every_plan(const Lattice& lattice, const Material& material, const Check& check) {
        for (const std::string& layout : lattice_layouts()) {
            for (InstructionSet set : available_instruction_sets()) {
                for (Accuracy accuracy : {Accuracy::fast, Accuracy::accurate, Accuracy::exact}) {
                    PlanOptions options;
                    options.layout = layout;
                    options.instruction_set = set;
                    options.accuracy = accuracy;
                    const ForcePlan<T> plan(lattice, material, options);
                    const std::string label = layout + " " + std::string(name(set)) + " " + std::string(name(accuracy));
                    EXPECT_EQ(plan.describe().instruction_set, set) << label;
                    check(plan, label);
                }
            }
        }
    }

    static std::vector<T> forces(const ForcePlan<T>& plan, const std::vector<T>& u) {
        std::vector<T> f(u.size(), T(0));
        plan.add_forces(VectorField<const T>::aos(u.data(), plan.node_count()),
                        VectorField<T>::aos(f.data(), plan.node_count()));
        return f;
    }
};

using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Invariance, Precisions);

Vector3d node(const auto& field, std::size_t n) {
    return {static_cast<double>(field[3 * n]), static_cast<double>(field[3 * n + 1]),
            static_cast<double>(field[3 * n + 2])};
}

Material nearly_incompressible() {
    Material material;
    material.poisson_ratio = 0.45;
    return material;
}

// Springs and cells act and react in pairs: what is left is rounding, a few epsilon of the sum of magnitudes.
TYPED_TEST(Invariance, NoTotalForceOrTorque) {
    using T = TypeParam;
    testing::Random random(11);
    const double h = 0.3;
    const Lattice lattice = testing::random_lattice(7, 5, 6, h, random);
    const auto nodes = lattice.nodes();
    const std::vector<T> u = testing::random_field<T>(nodes.size(), 0.2 * h, 5);
    this->for_every_plan(lattice, nearly_incompressible(), [&](const ForcePlan<T>& plan, const std::string& label) {
        const std::vector<T> f = this->forces(plan, u);
        Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
        double magnitudes = 0, moments = 0;
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            const Vector3d x = Vector3d(lattice.rest_position(nodes[n]).data()) + node(u, n);
            force += node(f, n);
            torque += x.cross(node(f, n));
            magnitudes += node(f, n).norm();
            moments += x.norm() * node(f, n).norm();
        }
        EXPECT_GT(magnitudes, 1.0) << label;
        EXPECT_LE(force.norm(), 4 * this->kEpsilon * magnitudes) << label;
        EXPECT_LE(torque.norm(), 4 * this->kEpsilon * moments) << label;
    });
}

// A rigid motion stretches nothing. The rotated positions are rounded to T: each spring's strain errs by about
// epsilon |u| / h, which the stiffness turns into a force.
TYPED_TEST(Invariance, RigidMotionsGiveNoForce) {
    using T = TypeParam;
    const double h = 0.5;
    const Lattice lattice = Lattice::box(5, 4, 3, h);
    const Material material = nearly_incompressible();
    const auto nodes = lattice.nodes();
    const double stiffness = 26 * spring_constants(material, h).edge + 8 * volume_modulus(material) * h;
    for (double angle : {0.0, M_PI / 2, M_PI, 0.7}) {
        const Matrix3d rotation = Eigen::AngleAxisd(angle, Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
        std::vector<T> u;
        double largest = 0;
        for (std::uint32_t n : nodes) {
            const Vector3d x(lattice.rest_position(n).data());
            const Vector3d moved = rotation * x - x + Vector3d(3, -2, 1);
            for (int c = 0; c < 3; ++c) {
                u.push_back(static_cast<T>(moved[c]));
                largest = std::max(largest, std::abs(moved[c]));
            }
        }
        this->for_every_plan(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
            for (T f : this->forces(plan, u)) {
                ASSERT_LE(std::abs(static_cast<double>(f)), 2 * this->kEpsilon * stiffness * largest)
                    << label << " angle " << angle;
            }
        });
    }
}

// Displacements relative to rest: a body far away has the same displacement differences, so the same forces, to
// rounding.
TYPED_TEST(Invariance, CoincidentNodesGiveFiniteForces) {
    using T = TypeParam;
    const double h = 0.1;
    const Lattice lattice = Lattice::box(3, 3, 3, h);
    const auto nodes = lattice.nodes();
    std::vector<T> to_a_point, to_a_plane, inside_out;
    for (std::uint32_t n : nodes) {
        const auto x = lattice.rest_position(n);
        for (std::size_t c = 0; c < 3; ++c) {
            to_a_point.push_back(static_cast<T>(-x[c]));
            to_a_plane.push_back(static_cast<T>(c == 1 ? -x[c] : 0.0));
            inside_out.push_back(static_cast<T>(-2 * x[c]));
        }
    }
    for (double nu : {0.0, 0.25, 0.45}) {
        Material material;
        material.poisson_ratio = nu;
        // Every spring at its largest compression, every cell at its largest volume slope.
        const double bound = 100 * h * (spring_constants(material, h).edge + std::abs(volume_modulus(material)) * h);
        this->for_every_plan(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
            for (const auto* u : {&to_a_point, &to_a_plane, &inside_out}) {
                for (T f : this->forces(plan, *u)) {
                    ASSERT_TRUE(std::abs(static_cast<double>(f)) < bound) << label << " " << f;
                }
                const PotentialEnergy energy = plan.energy(VectorField<const T>::aos(u->data(), plan.node_count()));
                ASSERT_TRUE(std::isfinite(energy.springs) && std::isfinite(energy.volume)) << label;
            }
        });
    }
}

} // namespace
} // namespace hybmss
