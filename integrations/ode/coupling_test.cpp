// Rigid bodies of ODE and a soft body: what they give each other, and what they rest on.

#include "integrations/ode/coupling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace hybmss::ode {
namespace {

using Point = std::array<double, 3>;

const Material kMaterial{.young_modulus = 1e5, .poisson_ratio = 0.3, .density = 1000};

/// ODE as long as the object lives.
struct World {
    World() {
        dInitODE2(0);
        dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
        world = dWorldCreate();
    }
    World(const World&) = delete;
    World& operator=(const World&) = delete;
    ~World() {
        for (dGeomID geom : geoms) {
            dGeomDestroy(geom);
        }
        dWorldDestroy(world);
        dCloseODE();
    }
    dBodyID put(dGeomID geom, const dMass& mass, const Point& position, const Point& velocity) {
        const dBodyID body = dBodyCreate(world);
        dBodySetMass(body, &mass);
        dGeomSetBody(geom, body);
        dBodySetPosition(body, position[0], position[1], position[2]);
        dBodySetLinearVel(body, velocity[0], velocity[1], velocity[2]);
        geoms.push_back(geom);
        bodies.push_back(body);
        return body;
    }
    dBodyID ball(double radius, double mass, const Point& position, const Point& velocity = {0, 0, 0}) {
        dMass m;
        dMassSetSphereTotal(&m, mass, radius);
        return put(dCreateSphere(nullptr, radius), m, position, velocity);
    }
    dBodyID block(const Point& edges, double mass, const Point& position, const Point& velocity = {0, 0, 0}) {
        dMass m;
        dMassSetBoxTotal(&m, mass, edges[0], edges[1], edges[2]);
        return put(dCreateBox(nullptr, edges[0], edges[1], edges[2]), m, position, velocity);
    }
    dBodyID rod(double radius, double length, double mass, const Point& position, const Point& velocity = {0, 0, 0}) {
        dMass m;
        dMassSetCapsuleTotal(&m, mass, 3, radius, length);
        return put(dCreateCapsule(nullptr, radius, length), m, position, velocity);
    }

    dWorldID world;
    std::vector<dGeomID> geoms;
    std::vector<dBodyID> bodies;
};

struct Momenta {
    Point linear = {0, 0, 0}, angular = {0, 0, 0};
};

void add(Momenta& sum, double mass, const Point& x, const Point& v) {
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t i = (a + 1) % 3, j = (a + 2) % 3;
        sum.linear[a] += mass * v[a];
        sum.angular[a] += mass * (x[i] * v[j] - x[j] * v[i]);
    }
}

Momenta momenta(const World& world, const Lattice& lattice, const ExplicitDynamics<double>& body) {
    Momenta sum;
    const std::size_t n = body.node_count();
    std::vector<double> u(3 * n), v(3 * n);
    body.get_displacements(VectorField<double>::aos(u.data(), n));
    body.get_velocities(VectorField<double>::aos(v.data(), n));
    for (std::size_t i = 0; i < n; ++i) {
        Point x = lattice.rest_position(i);
        for (std::size_t a = 0; a < 3; ++a) {
            x[a] += u[3 * i + a];
        }
        add(sum, body.masses()[i], x, {v[3 * i], v[3 * i + 1], v[3 * i + 2]});
    }
    for (const dBodyID rigid : world.bodies) {
        dMass mass;
        dBodyGetMass(rigid, &mass);
        const dReal *const x = dBodyGetPosition(rigid), *const w = dBodyGetLinearVel(rigid);
        add(sum, mass.mass, {x[0], x[1], x[2]}, {w[0], w[1], w[2]});
        const dReal *const r = dBodyGetRotation(rigid), *const spin = dBodyGetAngularVel(rigid);
        for (std::size_t a = 0; a < 3; ++a) { // R I R^T w
            for (std::size_t k = 0; k < 3; ++k) {
                const double inertia = mass.I[4 * k + k]; // these are diagonal
                double along = 0;
                for (std::size_t b = 0; b < 3; ++b) {
                    along += r[4 * b + k] * spin[b];
                }
                sum.angular[a] += r[4 * a + k] * inertia * along;
            }
        }
    }
    return sum;
}

/// A free cube is struck by a ball, a block and a rod, with friction. Returns by how much linear and angular momentum
/// differ from what they were, at most, by the sum of the magnitudes that there are.
std::pair<double, double> lost(double frame, long steps, bool soft_first) {
    World world;
    const Lattice lattice = Lattice::box(5, 5, 5, 0.1);
    ExplicitDynamics<double> body(lattice, kMaterial);
    Coupling<double> coupling(body, surface_nodes(lattice));
    world.ball(0.2, 30, {-0.21, 0.3, 0.2}, {2, 0.1, 0});
    world.block({0.3, 0.4, 0.3}, 60, {0.2, 0.72, 0.25}, {0, -1.5, 0.2});
    const dBodyID rod = world.rod(0.15, 0.6, 40, {0.68, 0.1, 0.3}, {-1, 0, 0});
    dBodySetAngularVel(rod, 0.5, 1, 0);
    for (dGeomID geom : world.geoms) {
        coupling.add(geom, 0.4);
    }
    const double duration = 0.3, size = 30 * 2 + 60 * 1.5 + 40;
    const Momenta before = momenta(world, lattice, body);
    double linear = 0, angular = 0;
    for (double time = 0; time < duration; time += frame) {
        if (soft_first) {
            coupling.step({.time_step = frame / static_cast<double>(steps)}, steps);
        }
        dWorldStep(world.world, frame);
        if (!soft_first) {
            coupling.step({.time_step = frame / static_cast<double>(steps)}, steps);
        }
        const Momenta now = momenta(world, lattice, body);
        for (std::size_t a = 0; a < 3; ++a) {
            linear = std::max(linear, std::abs(now.linear[a] - before.linear[a]) / size);
            angular = std::max(angular, std::abs(now.angular[a] - before.angular[a]) / size);
        }
    }
    for (const ObstacleReading& reading : coupling.readings()) {
        EXPECT_GT(std::hypot(reading.impulse[0], reading.impulse[1], reading.impulse[2]), 5); // all have struck it
    }
    return {linear, angular};
}

TEST(OdeCoupling, keeps_linear_momentum_in_frames_of_any_number_of_steps_in_either_order) {
    const double dt = 0.5 * ForcePlan<double>(Lattice::box(5, 5, 5, 0.1), kMaterial).critical_time_step();
    for (const long steps : {1L, 2L, 7L, 20L}) {
        for (const bool soft_first : {false, true}) {
            EXPECT_LT(lost(dt * static_cast<double>(steps), steps, soft_first).first, 1e-12) << steps << soft_first;
        }
    }
}

/// Half the frame, about half the error: what ODE itself loses of a body's spin as it turns is among it.
TEST(OdeCoupling, keeps_angular_momentum_to_the_first_order_of_the_frame) {
    const double dt = 0.5 * ForcePlan<double>(Lattice::box(5, 5, 5, 0.1), kMaterial).critical_time_step();
    const double coarse = lost(16 * dt, 16, false).second, fine = lost(4 * dt, 4, false).second;
    EXPECT_LT(coarse, 0.02);
    EXPECT_LT(fine, 0.5 * coarse);
}

/// A ball and a block on a soft block that stands on a floor of ODE's: all their weights come down.
TEST(OdeCoupling, rigid_bodies_rest_on_a_soft_one) {
    World world;
    dWorldSetGravity(world.world, 0, -9.81, 0);
    dWorldSetDamping(world.world, 0.02, 0.02); // a frame
    const Lattice lattice = Lattice::box(8, 4, 8, 0.1);
    ExplicitDynamics<double> body(lattice, kMaterial);
    Coupling<double> coupling(body, surface_nodes(lattice));
    const dGeomID floor = dCreatePlane(nullptr, 0, 1, 0, 0);
    world.block({0.3, 0.2, 0.3}, 20, {0.2, 0.505, 0.4});
    world.rod(0.12, 0.3, 30, {0.6, 0.525, 0.4});
    for (dGeomID geom : world.geoms) {
        coupling.add(geom, 0.5);
    }
    coupling.add(floor, 0.5);
    world.geoms.push_back(floor);
    const double frame = 1.0 / 240;
    const long steps = 1 + static_cast<long>(frame / (0.7 * body.critical_time_step()));
    for (int i = 0; i < 240 * 6; ++i) {
        dWorldStep(world.world, frame);
        coupling.step(
            {.time_step = frame / static_cast<double>(steps), .acceleration = {0, -9.81, 0}, .mass_damping = 5}, steps);
    }
    const std::vector<ObstacleReading> start = coupling.readings();
    for (int i = 0; i < 60; ++i) {
        dWorldStep(world.world, frame);
        coupling.step(
            {.time_step = frame / static_cast<double>(steps), .acceleration = {0, -9.81, 0}, .mass_damping = 5}, steps);
    }
    const std::vector<ObstacleReading> end = coupling.readings();
    const auto mean_force = [&](std::size_t r) { return (end[r].impulse[1] - start[r].impulse[1]) / (60 * frame); };
    const double soft = 0.8 * 0.4 * 0.8 * 1000;
    EXPECT_NEAR(-mean_force(0), 20 * 9.81, 5e-3 * 20 * 9.81);
    EXPECT_NEAR(-mean_force(1), 30 * 9.81, 5e-3 * 30 * 9.81);
    EXPECT_NEAR(end[2].force[1], (soft + 50) * 9.81, 5e-3 * (soft + 50) * 9.81);
    for (const dBodyID rigid : world.bodies) {
        EXPECT_NEAR(dBodyGetLinearVel(rigid)[1], 9.81 * frame, 0.01); // what gravity takes next
        EXPECT_GT(dBodyGetPosition(rigid)[1], 0.3);
    }
}

TEST(OdeCoupling, other_geoms_are_refused) {
    World world;
    const dGeomID cylinder = dCreateCylinder(nullptr, 1, 1);
    EXPECT_THROW(obstacle_of(cylinder), std::invalid_argument);
    world.geoms.push_back(cylinder);
    const Lattice lattice = Lattice::box(1, 1, 1, 0.1);
    ExplicitDynamics<float> body(lattice, kMaterial);
    Coupling<float> coupling(body, surface_nodes(lattice));
    EXPECT_THROW(coupling.add(cylinder), std::invalid_argument);
    EXPECT_THROW(coupling.step({.time_step = 1e-4}, 0), std::invalid_argument);
    EXPECT_NO_THROW(coupling.step({.time_step = 1e-4}, 1));
}

} // namespace
} // namespace hybmss::ode
