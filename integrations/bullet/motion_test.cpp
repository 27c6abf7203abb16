/// A body in Bullet's world beside the same scene in our simulator: in free flight, fallen and at rest, under a plate.

#include "integrations/bullet/hybmss_force.hpp"
#include "integrations/bullet/world.hpp"

#include "hybmss/simulation/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace hybmss::bullet {
namespace {

constexpr double kEdge = 0.3; // of the cube of drop.toml, m
constexpr int kCells = 6;
constexpr double kGravity = 9.81;

Scene drop() {
    return load_scene(std::string(HYBMSS_SOURCE_DIR) + "/examples/bullet/drop.toml");
}

Lattice lattice_of(const Scene& scene) {
    const auto& n = scene.body.cells;
    return Lattice::box(static_cast<int>(n[0]), static_cast<int>(n[1]), static_cast<int>(n[2]), scene.body.cell_size);
}

/// The scene's body in a world of Bullet; the floor is the scene's.
struct BulletScene {
    BulletScene(const Scene& scene, bool implicit, bool falls)
        : lattice(lattice_of(scene)), force(falls ? scene.damping.mass : 0),
          world(btVector3(0, falls ? btScalar(-kGravity) : 0, 0), implicit) {
        std::unique_ptr<btSoftBody> made(force.make_body(world.info(), lattice, scene.material, btVector3(0, 0, 0)));
        made->getCollisionShape()->setMargin(btScalar(kMargin));
        body = made.get();
        world.add(std::move(made), force);
        if (falls) {
            world.add_floor(static_cast<btScalar>(floor(scene)));
        }
    }

    static double floor(const Scene& scene) { return scene.obstacles.at(0).position[1]; }

    /// The mean displacement along y of the nodes of the layer j, m.
    double layer_displacement(int j) const {
        double sum = 0;
        for (int k = 0; k <= kCells; ++k) {
            for (int i = 0; i <= kCells; ++i) {
                const std::size_t n = lattice.grid_node_index(i, j, k);
                sum += static_cast<double>(body->m_nodes[static_cast<int>(n)].m_x[1]) - lattice.rest_position(n)[1];
            }
        }
        return sum / ((kCells + 1) * (kCells + 1));
    }

    static constexpr double kMargin = 0.002; // Bullet begins contacts at this distance, m
    Lattice lattice;
    HybmssForce force;
    World world;
    btSoftBody* body = nullptr;
};

double probe(const Simulation& simulation, const std::string& name) {
    for (const ProbeReading& reading : simulation.probes()) {
        if (reading.name == name) {
            return reading.mean_displacement[1];
        }
    }
    ADD_FAILURE() << "no probe " << name;
    return 0;
}

class BulletMotion : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Worlds, BulletMotion, testing::Bool(), [](const auto& world) {
    return std::string(world.param ? "implicit_world" : "explicit_world");
});

TEST_P(BulletMotion, falls_as_semi_implicit_euler_and_stays_unstrained) {
    Scene scene = drop();
    scene.damping.mass = 0;
    BulletScene bullet(scene, GetParam(), true);
    const double dt = 1e-3, start = center_of_mass(*bullet.body)[1];
    const int steps = 100;
    bullet.world.step(btScalar(dt), steps);
    // v_n = -n g dt, so y_n = y_0 - g dt^2 n (n + 1) / 2; positions of 0.3 m are rounded to 3e-8 in every step.
    EXPECT_NEAR(center_of_mass(*bullet.body)[1] - start, -kGravity * dt * dt * steps * (steps + 1) / 2, 1e-5);
    const double weight = 1000 * std::pow(kEdge, 3) * kGravity;
    EXPECT_LT(bullet.force.totalElasticEnergy(0), 1e-6 * weight * kEdge);
}

TEST_P(BulletMotion, comes_to_rest_as_in_our_simulator) {
    const Scene scene = drop();
    Simulation ours(scene);
    ASSERT_EQ(ours.run().failure, "");
    BulletScene bullet(scene, GetParam(), true);
    const double dt = GetParam() ? 4e-3 : 0.5 * ours.time_step();
    bullet.world.step(btScalar(dt), std::lround(2 / dt));

    // Shortening of the cube by its own weight: rho g H / (2 E) of its height would be 0.0088 m, were it not for
    // the coarse grid.
    const double ours_shorter = probe(ours, "bottom") - probe(ours, "top");
    const double bullet_shorter = bullet.layer_displacement(0) - bullet.layer_displacement(kCells);
    EXPECT_NEAR(ours_shorter, 1000 * kGravity * kEdge / 2 / 5e4 * kEdge, 0.1 * ours_shorter);
    EXPECT_NEAR(bullet_shorter, ours_shorter, 0.02 * ours_shorter);
    // Bullet holds nodes at most its margin above the floor, our contact lets them sink in by g / stiffness.
    EXPECT_NEAR(bullet.layer_displacement(0), BulletScene::floor(scene), 1.5 * BulletScene::kMargin);
    EXPECT_NEAR(probe(ours, "bottom"), BulletScene::floor(scene), 1.5 * BulletScene::kMargin);

    const double elastic = ours.energies().springs + ours.energies().volume;
    EXPECT_NEAR(bullet.force.totalElasticEnergy(0), elastic, 0.04 * elastic);
    EXPECT_LT(kinetic_energy(*bullet.body), 1e-2 * elastic);
}

TEST(BulletMotionAlone, carries_a_plate_with_the_force_that_our_obstacle_finds_there) {
    // A rigid plate of twice the cube's mass, larger than its top. Where Bullet brings it to rest, the lower side of
    // our obstacle must be pushed with the plate's weight.
    Scene scene = drop();
    scene.damping.mass = 60; // of the body alone, which must damp the plate on it too
    BulletScene bullet(scene, false, true);
    const double mass = 2 * 1000 * std::pow(kEdge, 3), thickness = 0.4, floor = BulletScene::floor(scene);
    Simulation ours_alone(scene);
    const double dt = 0.5 * ours_alone.time_step();
    bullet.world.step(btScalar(dt), std::lround(0.5 / dt));
    const double top = kEdge + bullet.layer_displacement(kCells);
    btRigidBody& plate = bullet.world.add_box(
        btVector3(btScalar(0.5), btScalar(thickness), btScalar(0.5)),
        btVector3(btScalar(kEdge / 2), btScalar(top + thickness / 2 + 0.005), btScalar(kEdge / 2)), btScalar(mass));
    plate.setAngularFactor(btVector3(0, 0, 0));
    bullet.world.step(btScalar(dt), std::lround(2 / dt));
    EXPECT_LT(std::abs(static_cast<double>(plate.getLinearVelocity().y())), 0.01);
    const double plate_bottom = static_cast<double>(plate.getCenterOfMassPosition().y()) - thickness / 2;
    EXPECT_NEAR(plate_bottom, kEdge + bullet.layer_displacement(kCells), 1.5 * BulletScene::kMargin);

    // The same strain of the body between our floor and our plate: as much as its outermost layers have in Bullet.
    SceneObstacle ours_plate;
    ours_plate.name = "plate";
    ours_plate.shape = PlaneShape{.normal = {0, -1, 0}};
    ours_plate.position = {0, floor + kEdge, 0};
    const double height = kEdge + bullet.layer_displacement(kCells) - bullet.layer_displacement(0);
    scene.obstacles.push_back(ours_plate);
    // Both obstacles are springs: how far nodes sink into them is measured, and given back to the height.
    double sunk = 0;
    ObstacleReading reading;
    for (int correction = 0; correction < 3; ++correction) {
        Scene again = scene;
        again.body.origin = {0, 0, 0};
        again.obstacles[0].position[1] = 0;
        again.obstacles[1].position[1] = kEdge;
        again.obstacles[1].translate = std::array<double, 3>{0, height - sunk - kEdge, 0};
        again.obstacles[1].over = 0.5;
        Simulation ours(again);
        ASSERT_EQ(ours.run().failure, "");
        reading = ours.obstacles().at(1).reading;
        sunk += kEdge + probe(ours, "top") - probe(ours, "bottom") - height;
    }
    EXPECT_NEAR(-reading.force[1], mass * kGravity, 0.05 * mass * kGravity);
}

TEST(BulletMotionAlone, keeps_energy_without_damping) {
    // A stretched cube let go: springs and inertia pass energy to and fro. Bullet's explicit world and ours take the
    // same semi-implicit steps, whose energy error stays bounded.
    Scene scene = drop();
    scene.damping.mass = 0;
    BulletScene bullet(scene, false, false);
    ExplicitDynamics<double> ours(bullet.lattice, scene.material);
    const auto nodes = bullet.lattice.nodes();
    std::vector<double> u;
    for (const std::uint32_t node : nodes) {
        const auto x = bullet.lattice.rest_position(node);
        u.insert(u.end(), {0.1 * (x[0] - kEdge / 2), 0, 0});
        btSoftBody::Node& n = bullet.body->m_nodes[static_cast<int>(node)];
        n.m_x += btVector3(static_cast<btScalar>(u[u.size() - 3]), 0, 0);
        n.m_q = n.m_x;
    }
    ours.set_displacements(VectorField<const double>::aos(u.data(), nodes.size()));
    const double start = ours.potential_energy().total(), dt = 0.3 * ours.critical_time_step();
    EXPECT_NEAR(bullet.force.totalElasticEnergy(0), start, 1e-4 * start);

    double lowest = start, highest = start, apart = 0;
    for (int checks = 0; checks < 40; ++checks) {
        bullet.world.step(btScalar(dt), 25);
        ours.step({.time_step = dt}, 25);
        const double energy = bullet.force.totalElasticEnergy(0) + kinetic_energy(*bullet.body);
        lowest = std::min(lowest, energy);
        highest = std::max(highest, energy);
        ours.get_displacements(VectorField<double>::aos(u.data(), nodes.size()));
        for (const std::uint32_t node : nodes) {
            const double x = static_cast<double>(bullet.body->m_nodes[static_cast<int>(node)].m_x[0]) -
                             bullet.lattice.rest_position(node)[0];
            apart = std::max(apart, std::abs(x - u[3 * node]));
        }
    }
    EXPECT_GT(lowest, 0.95 * start);
    EXPECT_LT(highest, 1.05 * start);
    EXPECT_LT(apart, 1e-3 * kEdge); // 1000 steps in float beside double
}

} // namespace
} // namespace hybmss::bullet
