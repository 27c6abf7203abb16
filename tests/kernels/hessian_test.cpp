// K(u) p and the diagonal of K against the reference, for every layout, instruction set, accuracy and precision.

#include "tests/kernels/hessian_plans.hpp"

#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <gtest/gtest.h>

namespace hybmss {
namespace {

using reference::Matrix3d;
using reference::Vector3d;
using testing::kEpsilon;

constexpr double kCellSize = 0.3;

template <class T>
struct Hessian : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Hessian, Precisions);

struct Case {
    std::string name;
    Lattice lattice;
};

std::vector<Case> cases() {
    testing::Random random(3);
    std::vector<Case> all;
    all.push_back({"one cell", Lattice::box(1, 1, 1, kCellSize)});
    all.push_back({"box 1x1x5", Lattice::box(1, 1, 5, kCellSize)});
    all.push_back({"box 3x2x5", Lattice::box(3, 2, 5, kCellSize)});
    all.push_back({"box 17x4x7", Lattice::box(17, 4, 7, kCellSize)});
    all.push_back({"mask 9x8x7", testing::random_lattice(9, 8, 7, kCellSize, random, 0.4)});
    all.push_back({"mask 5x24x4", testing::random_lattice(5, 24, 4, kCellSize, random, 0.6)}); // planes normal to y
    return all;
}

/// Every pair of kernels by face diagonals and volume energy.
std::vector<Material> materials() {
    std::vector<Material> all;
    for (double ratio : {0.0, 1.0}) {
        all.push_back({1e4, 0.45, 1000, ratio, VolumeEnergy::quadratic});
        all.push_back({1e4, 0.0, 1000, ratio, VolumeEnergy::mean_stretch});
        all.push_back({1e4, 0.25, 1000, ratio, VolumeEnergy::automatic});
    }
    return all;
}

// Relative to the greatest reference::hessian_product_scale: what rounding u and d once may change K p by. Five epsilon
// pay for the constants and some thirty additions a node, at any strain: t and J - 1 have no cancellation, and the
// scale knows how ill-conditioned a crushed spring is. (Networks in double: their rest edges are differences of rounded
// positions, some ten epsilon of an edge at these bodies' sizes.)
TYPED_TEST(Hessian, ProductAgreesWithTheReference) {
    using T = TypeParam;
    testing::Random random(7);
    for (const Case& c : cases()) {
        for (const Material& material : materials()) {
            const reference::Body body = reference::assemble(c.lattice, material);
            const std::size_t nodes = body.rest.size();
            const auto p = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
            struct Expected {
                double strain, scale;
                std::vector<Vector3d> u, product;
            };
            std::vector<Expected> expected;
            for (double strain : {1e-6, 1e-3, 0.1, 0.5}) {
                const auto u = testing::as_held<T>(testing::random_displacement(nodes, strain * kCellSize, random));
                expected.push_back({strain, testing::largest(reference::hessian_product_scale(body, u, p)), u,
                                    reference::hessian_product(body, u, p)});
            }
            testing::for_every_plan<T>(c.lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
                const double limit = label.starts_with("flat-rows") || sizeof(T) == 4 ? 5 : 25;
                for (const Expected& e : expected) {
                    const double error = testing::largest_difference(testing::product(plan, e.u, p), e.product);
                    EXPECT_LE(error / e.scale / kEpsilon<T>, limit)
                        << c.name << ", " << testing::describe(material) << ", " << label << ", strain " << e.strain;
                }
            });
        }
    }
}

// The same limit; the scale is that of a product with a random direction of components up to 1.
TYPED_TEST(Hessian, DiagonalAgreesWithTheReference) {
    using T = TypeParam;
    testing::Random random(8);
    for (const Case& c : cases()) {
        for (const Material& material : materials()) {
            const reference::Body body = reference::assemble(c.lattice, material);
            const auto unit = testing::random_displacement(body.rest.size(), 1, random);
            for (double strain : {1e-6, 0.1, 0.5}) {
                const auto u =
                    testing::as_held<T>(testing::random_displacement(body.rest.size(), strain * kCellSize, random));
                const std::vector<Matrix3d> expected = reference::hessian_diagonal(body, u);
                const double scale = testing::largest(reference::hessian_product_scale(body, u, unit));
                testing::for_every_plan<T>(
                    c.lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
                        const double limit = label.starts_with("flat-rows") || sizeof(T) == 4 ? 5 : 25;
                        const std::vector<Matrix3d> blocks = testing::diagonal(plan, u);
                        for (std::size_t n = 0; n < blocks.size(); ++n) {
                            ASSERT_LE((blocks[n] - expected[n]).cwiseAbs().maxCoeff() / scale / kEpsilon<T>, limit)
                                << c.name << ", " << testing::describe(material) << ", " << label << ", strain "
                                << strain << ", node " << n;
                        }
                    });
            }
        }
    }
}

// The columns of the very operator: K e_i of each axis at a node, at that node.
TYPED_TEST(Hessian, DiagonalIsTheProductsWithUnitVectors) {
    using T = TypeParam;
    testing::Random random(9);
    const Lattice lattice = testing::random_lattice(4, 3, 5, kCellSize, random);
    for (const Material& material : materials()) {
        const std::size_t nodes = lattice.nodes().size();
        const auto u = testing::as_held<T>(testing::random_displacement(nodes, 0.2 * kCellSize, random));
        testing::for_every_plan<T>(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
            const std::vector<Matrix3d> blocks = testing::diagonal(plan, u);
            for (std::size_t n = 0; n < nodes; n += 7) {
                for (int axis = 0; axis < 3; ++axis) {
                    std::vector<Vector3d> e(nodes, Vector3d::Zero());
                    e[n][axis] = 1;
                    const Vector3d column = testing::product(plan, u, e)[n];
                    ASSERT_LE((column - blocks[n].col(axis)).norm(), 20 * kEpsilon<T> * blocks[n].norm())
                        << label << ", node " << n << ", axis " << axis;
                }
            }
        });
    }
}

// The product is added to what is there, in any arrangement of memory.
TYPED_TEST(Hessian, ProductIsAddedInEveryArrangement) {
    using T = TypeParam;
    testing::Random random(10);
    const Lattice lattice = Lattice::box(3, 4, 5, kCellSize);
    const ForcePlan<T> plan(lattice, {});
    const std::size_t nodes = plan.node_count();
    const auto u = testing::as_held<T>(testing::random_displacement(nodes, 0.1 * kCellSize, random));
    const auto p = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
    const std::vector<Vector3d> expected = testing::product(plan, u, p);
    std::vector<T> at(4 * nodes, T(7)), along(3 * nodes), out(3 * nodes, T(1));
    for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            at[4 * n + c] = static_cast<T>(u[n][static_cast<int>(c)]);
            along[c * nodes + n] = static_cast<T>(p[n][static_cast<int>(c)]);
        }
    }
    plan.add_hessian_product(
        VectorField<const T>::aos(at.data(), nodes, 4),
        VectorField<const T>::soa(along.data(), along.data() + nodes, along.data() + 2 * nodes, nodes),
        VectorField<T>::aos(out.data(), nodes));
    for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_EQ(out[3 * n + c], T(1) + static_cast<T>(expected[n][static_cast<int>(c)]));
        }
    }
}

TEST(HessianArguments, WrongSizesAreRefused) {
    const ForcePlan<double> plan(Lattice::box(1, 1, 1, 1), {});
    std::vector<double> a(24), b(24), blocks(47);
    const auto u = VectorField<const double>::aos(a.data(), 8), too_few = VectorField<const double>::aos(a.data(), 7);
    const auto out = VectorField<double>::aos(b.data(), 8), out_too_few = VectorField<double>::aos(b.data(), 7);
    EXPECT_THROW(plan.add_hessian_product(too_few, u, out), std::invalid_argument);
    EXPECT_THROW(plan.add_hessian_product(u, too_few, out), std::invalid_argument);
    EXPECT_THROW(plan.add_hessian_product(u, u, out_too_few), std::invalid_argument);
    EXPECT_THROW(plan.hessian_diagonal(u, blocks), std::invalid_argument);
}

} // namespace
} // namespace hybmss
