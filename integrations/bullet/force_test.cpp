/// The force as Bullet calls it: in Bullet's arrays and signs, against the same plan in double and its own derivatives.

#include "integrations/bullet/hybmss_force.hpp"
#include "integrations/bullet/world.hpp"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

namespace hybmss::bullet {
namespace {

constexpr unsigned kSeed = 7;
const Material kMaterial{.young_modulus = 1e4, .poisson_ratio = 0.4};

/// Two bodies in one world, so that the second one's nodes do not begin at zero.
struct TwoBodies : testing::Test {
    TwoBodies() {
        for (const int cells : {2, 3}) {
            const auto lattice = Lattice::box(cells, 2, 2, 0.1);
            std::unique_ptr<btSoftBody> body(
                force.make_body(world.info(), lattice, kMaterial, btVector3(btScalar(cells), 0, 0)));
            bodies.push_back(body.get());
            plans.emplace_back(lattice, kMaterial);
            world.add(std::move(body), force);
        }
        world.step(btScalar(1e-6)); // Bullet numbers the nodes in its first step
        std::mt19937 random(kSeed);
        std::uniform_real_distribution<double> strain(-0.01, 0.01);
        for (btSoftBody* body : bodies) {
            for (int n = 0; n < body->m_nodes.size(); ++n) {
                btSoftBody::Node& node = body->m_nodes[n];
                for (int c = 0; c < 3; ++c) {
                    node.m_q[c] = node.m_x[c] + static_cast<btScalar>(strain(random));
                    node.m_v[c] = static_cast<btScalar>(strain(random));
                }
            }
        }
    }

    btDeformableLagrangianForce::TVStack zeros() const {
        btDeformableLagrangianForce::TVStack all;
        all.resize(bodies[0]->m_nodes.size() + bodies[1]->m_nodes.size(), btVector3(0, 0, 0));
        return all;
    }

    HybmssForce force{0.5, 1e-3};
    World world{btVector3(0, 0, 0), true};
    std::vector<btSoftBody*> bodies;
    std::vector<ForcePlan<double>> plans;
};

TEST_F(TwoBodies, forces_are_those_of_the_plan_in_double) {
    auto forces = zeros();
    force.addScaledExplicitForce(btScalar(0.25), forces);
    for (std::size_t b = 0; b < 2; ++b) {
        const btSoftBody& body = *bodies[b];
        const auto lattice = Lattice::box(b == 0 ? 2 : 3, 2, 2, 0.1);
        std::vector<double> u, expected(3 * plans[b].node_count());
        for (int n = 0; n < body.m_nodes.size(); ++n) {
            for (int c = 0; c < 3; ++c) {
                const double rest = lattice.rest_position(static_cast<std::size_t>(n))[static_cast<std::size_t>(c)];
                const double origin = c == 0 ? (b == 0 ? 2 : 3) : 0;
                u.push_back(static_cast<double>(body.m_nodes[n].m_q[c]) - origin - rest);
            }
        }
        plans[b].add_forces(VectorField<const double>::aos(u.data(), plans[b].node_count()),
                            VectorField<double>::aos(expected.data(), plans[b].node_count()));
        for (int n = 0; n < body.m_nodes.size(); ++n) {
            for (int c = 0; c < 3; ++c) {
                // Positions near 3 m are known to 2e-7 m; a node's springs together have some 3e4 N/m... of 1e3 N/m.
                EXPECT_NEAR(forces[body.m_nodes[n].index][c],
                            0.25 * expected[3 * static_cast<std::size_t>(n) + static_cast<std::size_t>(c)], 2e-3)
                    << "body " << b << ", node " << n << ", seed " << kSeed;
            }
        }
    }
}

TEST_F(TwoBodies, forces_and_differentials_are_derivatives) {
    auto forces = zeros(), direction = zeros(), differential = zeros();
    force.addScaledExplicitForce(1, forces);
    std::mt19937 random(kSeed + 1);
    std::uniform_real_distribution<double> any(-1, 1);
    for (int n = 0; n < direction.size(); ++n) {
        direction[n] = btVector3(btScalar(any(random)), btScalar(any(random)), btScalar(any(random)));
    }
    force.addScaledElasticForceDifferential(1, direction, differential);

    const btScalar step = btScalar(2e-4); // truncation, and rounding of energies and forces, both below 1e-3
    const auto moved = [&](btScalar by) {
        for (btSoftBody* body : bodies) {
            for (int n = 0; n < body->m_nodes.size(); ++n) {
                body->m_nodes[n].m_q += by * direction[body->m_nodes[n].index];
            }
        }
    };
    auto high = zeros(), low = zeros();
    moved(step);
    const double high_energy = force.totalElasticEnergy(0);
    force.addScaledExplicitForce(1, high);
    moved(-2 * step);
    const double low_energy = force.totalElasticEnergy(0);
    force.addScaledExplicitForce(1, low);
    moved(step);

    double work = 0, difference = 0, size = 0;
    for (int n = 0; n < direction.size(); ++n) {
        work += static_cast<double>(forces[n].dot(direction[n]));
        difference += static_cast<double>(((high[n] - low[n]) / (2 * step) - differential[n]).length2());
        size += static_cast<double>(differential[n].length2());
    }
    const double slope = (high_energy - low_energy) / (2 * static_cast<double>(step));
    EXPECT_NEAR(work, -slope, 5e-3 * std::abs(slope)) << "seed " << kSeed;
    EXPECT_LT(std::sqrt(difference / size), 5e-3) << "seed " << kSeed;
}

TEST_F(TwoBodies, damping_takes_energy_and_its_differential_is_linear_in_the_velocity) {
    auto damping = zeros(), velocity = zeros(), differential = zeros();
    force.addScaledDampingForce(1, damping);
    for (const btSoftBody* body : bodies) {
        for (int n = 0; n < body->m_nodes.size(); ++n) {
            velocity[body->m_nodes[n].index] = body->m_nodes[n].m_v;
        }
    }
    force.addScaledDampingForceDifferential(1, velocity, differential);
    double power = 0;
    for (int n = 0; n < damping.size(); ++n) {
        power += static_cast<double>(damping[n].dot(velocity[n]));
        for (int c = 0; c < 3; ++c) {
            EXPECT_FLOAT_EQ(damping[n][c], differential[n][c]);
        }
    }
    EXPECT_LT(power, 0);
}

TEST(HybmssForce, refuses_bodies_that_it_did_not_make_and_negative_damping) {
    HybmssForce force;
    World world(btVector3(0, 0, 0), false);
    const btVector3 point(0, 0, 0);
    btSoftBody foreign(&world.info(), 1, &point, nullptr);
    EXPECT_THROW(force.addSoftBody(&foreign), std::invalid_argument);
    EXPECT_THROW(HybmssForce(-1), std::invalid_argument);
    EXPECT_THROW(force.describe(foreign), std::invalid_argument);
}

} // namespace
} // namespace hybmss::bullet
