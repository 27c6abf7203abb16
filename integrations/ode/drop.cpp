// Balls, blocks and rods of ODE fall on a soft block and on each other:
//   ode_drop
// prints how deep nodes are in them, what the block bears, and what lies above its middle: once all is at rest the
// same, but for what leans on the floor beside it.

#include "integrations/ode/coupling.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

using namespace hybmss;

namespace {

struct Scene {
    dWorldID world;
    dSpaceID space;
    dJointGroupID contacts;
};

/// Rigid bodies touch each other as ODE has it.
void touch(void* data, dGeomID a, dGeomID b) {
    const auto* const scene = static_cast<const Scene*>(data);
    dContactGeom points[4];
    const int count = dCollide(a, b, 4, points, sizeof points[0]);
    for (int p = 0; p < count; ++p) {
        dContact contact{};
        contact.surface.mode = dContactApprox1;
        contact.surface.mu = 0.5;
        contact.geom = points[p];
        dJointAttach(dJointCreateContact(scene->world, scene->contacts, &contact), dGeomGetBody(a), dGeomGetBody(b));
    }
}

std::vector<PrescribedNode> foot_of(const Lattice& lattice, const ExplicitDynamics<float>& block) {
    std::vector<PrescribedNode> held;
    for (std::uint32_t n = 0; n < block.node_count(); ++n) {
        if (lattice.rest_position(n)[1] == 0) {
            held.push_back({n});
        }
    }
    return held;
}

void drop() {
    Scene scene{dWorldCreate(), dSimpleSpaceCreate(nullptr), dJointGroupCreate(0)};
    dWorldSetGravity(scene.world, 0, -9.81, 0);
    dWorldSetDamping(scene.world, 0.005, 0.02);
    dCreatePlane(scene.space, 0, 1, 0, 0); // for what rolls off

    const Lattice lattice = Lattice::box(16, 6, 16, 0.1);
    ExplicitDynamics<float> block(lattice, Material{.young_modulus = 1e5, .poisson_ratio = 0.4, .density = 1000});
    block.prescribe(foot_of(lattice, block));
    ode::Coupling<float> coupling(block, surface_nodes(lattice));
    std::vector<dBodyID> bodies;
    for (int i = 0; i < 13; ++i) {
        const dBodyID body = dBodyCreate(scene.world);
        dMass mass;
        dGeomID geom = nullptr;
        if (i % 3 == 0) {
            dMassSetSphereTotal(&mass, 15, 0.15);
            geom = dCreateSphere(scene.space, 0.15);
        } else if (i % 3 == 1) {
            dMassSetBoxTotal(&mass, 20, 0.3, 0.25, 0.3);
            geom = dCreateBox(scene.space, 0.3, 0.25, 0.3);
        } else {
            dMassSetCapsuleTotal(&mass, 15, 3, 0.12, 0.3);
            geom = dCreateCapsule(scene.space, 0.12, 0.3);
        }
        dBodySetMass(body, &mass);
        dGeomSetBody(geom, body);
        const int low = i % 9; // nine beside each other, then four in the gaps between them
        const double x = i < 9 ? 0.4 + 0.4 * (low % 3) : 0.6 + 0.4 * (low % 2);
        const double z = i < 9 ? 0.4 + 0.4 * (low / 3) : 0.6 + 0.4 * (low / 2);
        dBodySetPosition(body, x, i < 9 ? 0.9 : 1.4, z);
        coupling.add(geom, 0.5);
        bodies.push_back(body);
    }
    const double frame = 1.0 / 240;
    const long steps = 1 + static_cast<long>(frame / (0.7 * block.critical_time_step()));
    std::printf("%zu cells of 0.1 m, %zu rigid bodies, %ld steps a frame\n", lattice.cell_count(), bodies.size(),
                steps);
    std::printf("%6s %12s %12s %18s\n", "s", "depth m", "borne N", "weight above N");
    for (int i = 1; i <= 240 * 5; ++i) {
        dSpaceCollide(scene.space, &scene, touch);
        dWorldStep(scene.world, frame);
        dJointGroupEmpty(scene.contacts);
        coupling.step(
            {.time_step = frame / static_cast<double>(steps), .acceleration = {0, -9.81, 0}, .mass_damping = 3}, steps);
        if (i % 240 == 0) {
            double depth = 0, borne = 0, above = 0;
            for (const dBodyID body : bodies) {
                dMass mass;
                dBodyGetMass(body, &mass);
                above += dBodyGetPosition(body)[1] > 0.5 ? 9.81 * static_cast<double>(mass.mass) : 0;
            }
            for (const ObstacleReading& reading : coupling.readings()) {
                depth = std::max(depth, reading.depth);
                borne -= reading.force[1];
            }
            std::printf("%6.2f %12.5f %12.1f %18.1f\n", i * frame, depth, borne, above);
        }
    }
    dJointGroupDestroy(scene.contacts);
    dSpaceDestroy(scene.space);
    dWorldDestroy(scene.world);
}

/// How far a ball that should be at rest on a block still moves up and down.
void rest() {
    const Lattice lattice = Lattice::box(8, 4, 8, 0.1);
    const double node = 1000 * 0.1 * 0.1 * 0.1 / 2; // kg, of one on the surface
    std::printf("m by which a ball moves in the fourth second on a block, by steps a frame\n%10s %10s %10s %10s\n",
                "nodes", "1", "2", "8");
    for (const double nodes : {100.0, 10.0, 3.0, 1.0, 0.1}) {
        std::printf("%10.1f", nodes);
        for (const long steps : {1L, 2L, 8L}) {
            const dWorldID world = dWorldCreate();
            dWorldSetGravity(world, 0, -9.81, 0);
            dWorldSetDamping(world, 0.02, 0.02);
            ExplicitDynamics<float> block(lattice,
                                          Material{.young_modulus = 1e5, .poisson_ratio = 0.3, .density = 1000});
            block.prescribe(foot_of(lattice, block));
            const dBodyID ball = dBodyCreate(world);
            dMass mass;
            dMassSetSphereTotal(&mass, nodes * node, 0.15);
            dBodySetMass(ball, &mass);
            const dGeomID geom = dCreateSphere(nullptr, 0.15);
            dGeomSetBody(geom, ball);
            dBodySetPosition(ball, 0.4, 0.55, 0.4);
            ode::Coupling<float> coupling(block, surface_nodes(lattice));
            coupling.add(geom, 0.3);
            const double step = 0.5 * block.critical_time_step(), frame = step * static_cast<double>(steps);
            double high = -1e9, low = 1e9;
            for (double time = 0; time < 4; time += frame) {
                dWorldStep(world, frame);
                coupling.step({.time_step = step, .acceleration = {0, -9.81, 0}, .mass_damping = 10}, steps);
                if (time > 3) {
                    high = std::max(high, static_cast<double>(dBodyGetPosition(ball)[1]));
                    low = std::min(low, static_cast<double>(dBodyGetPosition(ball)[1]));
                }
            }
            std::printf(" %10.2g", high - low);
            dGeomDestroy(geom);
            dWorldDestroy(world);
        }
        std::printf("\n");
    }
}

} // namespace

int main() {
    dInitODE2(0);
    dAllocateODEDataForThread(static_cast<unsigned>(dAllocateMaskAll));
    drop();
    rest();
    dCloseODE();
}
