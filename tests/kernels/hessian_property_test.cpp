// What must hold of the second derivatives of any body, for every layout, instruction set, accuracy and precision.

#include "tests/kernels/hessian_plans.hpp"

#include "plan/bodies/layout_table.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace hybmss {
namespace {

using reference::Vector3d;
using testing::kEpsilon;

constexpr double kCellSize = 0.25;

template <class T>
struct HessianProperties : ::testing::Test {};
using Precisions = ::testing::Types<float, double>;
TYPED_TEST_SUITE(HessianProperties, Precisions);

const Material kMaterials[] = {{1e4, 0.45, 1000, 1, VolumeEnergy::quadratic},
                               {1e4, 0.0, 1000, 1, VolumeEnergy::mean_stretch},
                               {1e4, 0.25, 1000, 0, VolumeEnergy::automatic},
                               {1e4, 0.45, 1000, 1, VolumeEnergy::quadratic, {}, SpringForm::means}};

/// p . q and the sum of its terms' magnitudes.
struct DotProduct {
    double value = 0, magnitude = 0;
    DotProduct(std::span<const Vector3d> p, std::span<const Vector3d> q) {
        for (std::size_t n = 0; n < p.size(); ++n) {
            value += p[n].dot(q[n]);
            magnitude += p[n].norm() * q[n].norm();
        }
    }
};

TYPED_TEST(HessianProperties, ItIsSymmetric) {
    using T = TypeParam;
    testing::Random random(21);
    const Lattice lattice = testing::random_lattice(7, 6, 5, kCellSize, random);
    const std::size_t nodes = lattice.nodes().size();
    for (const Material& material : kMaterials) {
        const auto u = testing::as_held<T>(testing::random_displacement(nodes, 0.2 * kCellSize, random));
        const auto p = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
        const auto q = testing::as_held<T>(testing::random_displacement(nodes, kCellSize, random));
        testing::for_every_plan<T>(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
            const DotProduct pkq(p, testing::product(plan, u, q)), qkp(q, testing::product(plan, u, p));
            // Errors of random sign: far below one epsilon of the sum of magnitudes.
            EXPECT_LE(std::abs(pkq.value - qkp.value), 2 * kEpsilon<T> * pkq.magnitude) << label;
            EXPECT_GT(pkq.magnitude, 1) << label;
        });
    }
}

// K p = -(f(u + e p) - f(u - e p)) / 2e + O(e^2), with forces in double: e near epsilon^(1/3) leaves about 1e-9.
TEST(HessianProperties, ItIsMinusTheDerivativeOfTheForces) {
    testing::Random random(22);
    const Lattice lattice = testing::random_lattice(6, 5, 4, kCellSize, random);
    const std::size_t nodes = lattice.nodes().size();
    for (const Material& material : kMaterials) {
        for (double strain : {0.0, 1e-3, 0.2}) {
            const auto u = testing::random_displacement(nodes, strain * kCellSize, random);
            const auto p = testing::random_displacement(nodes, kCellSize, random);
            testing::for_every_plan<double>(
                lattice, material, [&](const ForcePlan<double>& plan, const std::string& label) {
                    constexpr double kStep = 1e-5;
                    std::vector<double> difference(3 * nodes, 0.0);
                    for (double sign : {1.0, -1.0}) {
                        std::vector<Vector3d> at(nodes);
                        for (std::size_t n = 0; n < nodes; ++n) {
                            at[n] = u[n] + sign * kStep * p[n];
                        }
                        const std::vector<double> x = testing::interleaved<double>(at);
                        std::vector<double> f(3 * nodes, 0.0);
                        plan.add_forces(VectorField<const double>::aos(x.data(), nodes),
                                        VectorField<double>::aos(f.data(), nodes));
                        for (std::size_t i = 0; i < f.size(); ++i) {
                            difference[i] -= sign * f[i] / (2 * kStep);
                        }
                    }
                    const std::vector<Vector3d> kp = testing::product(plan, u, p);
                    double size = 0;
                    for (const Vector3d& v : kp) {
                        size = std::max(size, v.cwiseAbs().maxCoeff());
                    }
                    EXPECT_LE(testing::largest_difference(kp, testing::vectors(difference)), 3e-8 * size)
                        << label << ", strain " << strain;
                });
        }
    }
}

// At any displacement a translation stretches nothing; at rest a small rotation w x X does not either.
TYPED_TEST(HessianProperties, RigidMotionsAreInItsNullSpace) {
    using T = TypeParam;
    testing::Random random(23);
    const Lattice lattice = testing::random_lattice(6, 5, 4, kCellSize, random);
    for (const Material& material : kMaterials) {
        const reference::Body body = reference::assemble(lattice, material);
        const std::size_t nodes = body.rest.size();
        const auto u = testing::as_held<T>(testing::random_displacement(nodes, 0.3 * kCellSize, random));
        const std::vector<Vector3d> translation(nodes, Vector3d(0.5, -2, 0.25));
        const std::vector<Vector3d> rest(nodes, Vector3d::Zero());
        std::vector<Vector3d> rotation;
        for (const Vector3d& x : body.rest) {
            rotation.push_back(Vector3d(0.3, 0.7, -0.4).cross(x));
        }
        rotation = testing::as_held<T>(rotation);
        const double scale = testing::largest(reference::hessian_product_scale(body, rest, rotation));
        testing::for_every_plan<T>(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
            for (const Vector3d& f : testing::product(plan, u, translation)) {
                ASSERT_EQ(f, Vector3d::Zero()) << label; // differences of equal numbers
            }
            // The rotation is rounded to T: an epsilon of its size at the far end, several cells away.
            EXPECT_LE(testing::largest_difference(testing::product(plan, rest, rotation), rest),
                      20 * kEpsilon<T> * scale)
                << label;
        });
    }
}

// Ends that meet, planes, points and cells inside out: finite products and diagonals, of the size that the force's
// bounded factor allows.
TYPED_TEST(HessianProperties, CoincidentNodesGiveFiniteProducts) {
    using T = TypeParam;
    testing::Random random(24);
    const Lattice lattice = Lattice::box(3, 3, 3, kCellSize);
    const auto nodes = lattice.nodes();
    std::vector<Vector3d> to_a_point, to_a_plane, inside_out, nearly_a_point;
    for (std::uint32_t n : nodes) {
        const Vector3d x(lattice.rest_position(n).data());
        to_a_point.push_back(-x);
        to_a_plane.push_back({0, -x.y(), 0});
        inside_out.push_back(-2 * x);
        nearly_a_point.push_back((1e-4 - 1) * x);
    }
    const auto p = testing::random_displacement(nodes.size(), kCellSize, random);
    for (const Material& material : kMaterials) {
        // A spring's factor is at most about 2^20, its stiffness that of an edge.
        const double bound =
            0x1p20 * 60 * kCellSize *
            (spring_constants(material, kCellSize).edge + std::abs(volume_modulus(material)) * kCellSize);
        testing::for_every_plan<T>(lattice, material, [&](const ForcePlan<T>& plan, const std::string& label) {
            for (const auto* u : {&to_a_point, &to_a_plane, &inside_out, &nearly_a_point}) {
                for (const Vector3d& f : testing::product(plan, *u, p)) {
                    ASSERT_LT(f.cwiseAbs().maxCoeff(), bound) << label;
                    ASSERT_TRUE(f.allFinite()) << label;
                }
                for (const auto& block : testing::diagonal(plan, *u)) {
                    ASSERT_TRUE(block.allFinite()) << label;
                }
            }
        });
    }
}

/// Products, then a diagonal, as they come.
template <class T>
std::vector<T> values(const Lattice& lattice, const PlanOptions& options) {
    const ForcePlan<T> plan(lattice, kMaterials[0], options);
    EXPECT_EQ(plan.describe().threads, options.threads);
    const std::size_t nodes = plan.node_count();
    testing::Random random(25);
    const auto u = testing::interleaved<T>(testing::random_displacement(nodes, 0.2 * kCellSize, random));
    const auto p = testing::interleaved<T>(testing::random_displacement(nodes, kCellSize, random));
    std::vector<T> out(9 * nodes, T(0));
    const auto at = VectorField<const T>::aos(u.data(), nodes);
    plan.add_hessian_product(at, VectorField<const T>::aos(p.data(), nodes), VectorField<T>::aos(out.data(), nodes));
    plan.hessian_diagonal(at, std::span(out).subspan(3 * nodes));
    return out;
}

TYPED_TEST(HessianProperties, ThreadsDoNotChangeABit) {
    using T = TypeParam;
    struct Subject {
        Lattice lattice;
        std::string layout;
    };
    const Subject subjects[] = {{Lattice::box(20, 20, 32, kCellSize), "flat-rows"},
                                {Lattice::box(9, 16, 120, kCellSize), "flat-rows"}, // planes normal to y
                                {Lattice::box(20, 20, 32, kCellSize), "active-rows"},
                                {Lattice::box(20, 20, 32, kCellSize), "packed-xyzw"},
                                {Lattice::box(20, 20, 32, kCellSize), "coloured-soa"}};
    for (const auto& [lattice, layout] : subjects) {
        PlanOptions options;
        options.layout = layout;
        options.threads = 1;
        const std::vector<T> one = values<T>(lattice, options);
        for (int threads : {2, 3, 8}) {
            options.threads = threads;
            const std::vector<T> many = values<T>(lattice, options);
            EXPECT_EQ(std::memcmp(many.data(), one.data(), one.size() * sizeof(T)), 0) << layout << " " << threads;
        }
    }
}

// Squeezed and sheared at random, cells turned over: there the whole curves downwards, what multigrid is made of never.
TYPED_TEST(HessianProperties, ItsConvexPartNeverCurvesDownwards) {
    using T = TypeParam;
    testing::Random random(27);
    const Lattice lattice = testing::random_lattice(6, 7, 5, kCellSize, random);
    const std::size_t nodes = lattice.nodes().size();
    Material crushed = kMaterials[0];
    crushed.crush = {.stiffness = 20, .ratio = 0.9};
    int downwards = 0;
    for (const Material& material : {kMaterials[0], kMaterials[2], kMaterials[3], crushed}) {
        for (const std::string& layout : distinct_lattice_layouts()) {
            if (material.crush.any() && !layout.ends_with("-rows")) {
                continue; // networks have none
            }
            PlanOptions options;
            options.layout = layout;
            const auto body = make_body<T>(lattice, material, options);
            State<T> state = body->make_state(false);
            NodeField<T> direction, product;
            Body<T>::allocate_like(state.displacement, direction);
            std::vector<Vector3d> p(nodes), q(nodes);
            const auto set = [&](NodeField<T>& field, const std::vector<Vector3d>& values) {
                const std::vector<T> flat = testing::interleaved<T>(values);
                body->write(VectorField<const T>::aos(flat.data(), nodes), 1, field);
            };
            const auto multiplied = [&](Curvature curvature) {
                set(direction, p);
                body->hessian_product(state, direction, product, curvature);
                std::vector<T> flat(3 * nodes);
                body->read(product, 1, VectorField<T>::aos(flat.data(), nodes));
                for (std::size_t n = 0; n < nodes; ++n) {
                    for (int c = 0; c < 3; ++c) {
                        q[n][c] = static_cast<double>(flat[3 * n + static_cast<std::size_t>(c)]);
                    }
                }
                return DotProduct(p, q);
            };
            for (int draw = 0; draw < 20; ++draw) {
                const double bound = 0.5 * kCellSize / body->length_unit();
                set(state.displacement, testing::random_displacement(nodes, bound, random));
                p = testing::random_displacement(nodes, 1, random);
                // A few times in the direction that the whole curves downwards most along.
                for (int power = 0; power < 5; ++power) {
                    const double whole = multiplied(Curvature::whole).value;
                    downwards += whole < 0;
                    const DotProduct convex = multiplied(Curvature::convex);
                    ASSERT_GE(convex.value, -8 * kEpsilon<T> * convex.magnitude) << layout;
                    multiplied(Curvature::whole);
                    double largest = 0;
                    for (const Vector3d& force : q) {
                        largest = std::max(largest, force.norm());
                    }
                    for (std::size_t n = 0; n < nodes; ++n) {
                        p[n] = (p[n] - 0.7 * q[n] / largest).eval();
                    }
                }
            }
            AlignedArray<T> blocks[6];
            body->hessian_diagonal(state, blocks, Curvature::convex);
            const std::size_t node = nodes / 2;
            p.assign(nodes, Vector3d::Zero());
            p[node][0] = 1;
            multiplied(Curvature::convex);
            EXPECT_NEAR(q[node][0], static_cast<double>(blocks[0][body->index_of(node)]),
                        100 * kEpsilon<T> * q[node].norm())
                << layout;
        }
    }
    EXPECT_GT(downwards, 0) << "the states are not hard enough";
}

// Solvers sum over whole arrays: what is no node must be zero, and the sum of all entries that of the nodes.
TYPED_TEST(HessianProperties, PlacesWithoutANodeStayZero) {
    using T = TypeParam;
    testing::Random random(26);
    const Lattice lattice = testing::random_lattice(9, 6, 7, kCellSize, random, 0.7);
    for (const Material& material : {kMaterials[1], kMaterials[3]}) {
        for (const std::string& layout : distinct_lattice_layouts()) {
            PlanOptions options;
            options.layout = layout;
            const auto body = make_body<T>(lattice, material, options);
            const std::size_t nodes = body->node_count();
            const auto u = testing::interleaved<T>(testing::random_displacement(nodes, 0.2 * kCellSize, random));
            const auto p = testing::interleaved<T>(testing::random_displacement(nodes, kCellSize, random));
            State<T> state = body->make_state(false);
            NodeField<T> direction, product;
            AlignedArray<T> blocks[6];
            Body<T>::allocate_like(state.displacement, direction);
            body->write(VectorField<const T>::aos(u.data(), nodes), 1 / body->length_unit(), state.displacement);
            body->write(VectorField<const T>::aos(p.data(), nodes), 1 / body->length_unit(), direction);
            body->hessian_product(state, direction, product);
            body->hessian_diagonal(state, blocks);
            std::vector<bool> is_node(blocks[0].size(), false);
            for (std::size_t n = 0; n < nodes; ++n) {
                is_node[body->index_of(n)] = true;
            }
            std::size_t nonzero = 0;
            for (std::size_t i = 0; i < is_node.size(); ++i) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const Component<const T> values = component(std::as_const(product), c);
                    const T value = values.first[static_cast<std::ptrdiff_t>(i) * values.stride];
                    nonzero += value != T(0);
                    ASSERT_TRUE(is_node[i] || value == T(0)) << layout << " " << i;
                }
                for (const AlignedArray<T>& entry : blocks) {
                    ASSERT_TRUE(is_node[i] || entry[i] == T(0)) << layout << " " << i;
                }
            }
            EXPECT_EQ(nonzero, 3 * nodes) << layout;
        }
    }
}

} // namespace
} // namespace hybmss
