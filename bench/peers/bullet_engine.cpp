#include "bench/peers/engines.hpp"

#include <btBulletDynamicsCommon.h>

#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <cmath>
#include <memory>
#include <utility>

namespace hybmss::bench {
namespace {

btVector3 to_bullet(const Vector3& x) {
    return {static_cast<btScalar>(x.x), static_cast<btScalar>(x.y), static_cast<btScalar>(x.z)};
}

/// The body's nodes and a link for each spring, in the springs' order, with their rest lengths.
std::unique_ptr<btSoftBody> make_body(const Task& task, btSoftBodyWorldInfo* info) {
    std::vector<btVector3> positions;
    std::vector<btScalar> masses;
    for (std::size_t n = 0; n < task.positions.size(); ++n) {
        positions.push_back(to_bullet(task.positions[n]));
        masses.push_back(static_cast<btScalar>(task.springs.masses[n]));
    }
    auto body = std::make_unique<btSoftBody>(info, static_cast<int>(positions.size()), positions.data(), masses.data());
    for (const Network::Spring& spring : task.springs.springs) {
        body->appendLink(spring.a, spring.b);
        const auto& r = spring.rest_vector;
        btSoftBody::Link& link = body->m_links[body->m_links.size() - 1];
        link.m_rl = static_cast<btScalar>(std::hypot(r[0], r[1], r[2]));
        link.m_c1 = link.m_rl * link.m_rl;
    }
    body->m_cfg.piterations = 1;
    body->m_cfg.collisions = 0;
    return body;
}

/// A world of deformable bodies with one that feels its springs alone.
struct DeformableWorld {
    DeformableWorld() {
        solver.setDeformableSolver(&deformable_solver);
        world.setGravity(btVector3(0, 0, 0));
        world.setImplicit(false);
        world.setLineSearch(false);
    }
    ~DeformableWorld() { world.removeSoftBody(body.get()); }
    DeformableWorld(const DeformableWorld&) = delete;
    DeformableWorld& operator=(const DeformableWorld&) = delete;

    void add(std::unique_ptr<btSoftBody> given, std::unique_ptr<btDeformableMassSpringForce> its) {
        body = std::move(given);
        force = std::move(its);
        world.addSoftBody(body.get());
        world.addForce(body.get(), force.get());
        body->setActivationState(DISABLE_DEACTIVATION);
    }

    std::unique_ptr<btSoftBody> body;
    std::unique_ptr<btDeformableMassSpringForce> force;
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btDeformableBodySolver deformable_solver;
    btDeformableMultiBodyConstraintSolver solver;
    btDeformableMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration, &deformable_solver};
};

/// Bullet has one stiffness for all links: that of the first spring.
Network alike(const Network& springs) {
    Network result = springs;
    for (Network::Spring& spring : result.springs) {
        spring.stiffness = springs.springs.front().stiffness;
    }
    return result;
}

} // namespace

void add_bullet(const Task& task, Field& field) {
    const auto add = [&](const char* engine, const char* unit, const btSoftBody& body, Work steps) {
        field.contenders.push_back(
            {engine, "float", "springs", unit, static_cast<std::size_t>(body.m_links.size()), std::move(steps)});
    };
    const auto time_step = static_cast<btScalar>(task.time_step);

    // Projection. A body of its own for each: reordered links are for these alone. A step is what a world does for a
    // body, without the world.
    struct Projected {
        btSoftBodyWorldInfo info;
        std::unique_ptr<btSoftBody> body;
    };
    for (const bool reordered : {false, true}) {
        const auto own = std::make_shared<Projected>();
        own->info.m_gravity = btVector3(0, 0, 0);
        own->body = make_body(task, &own->info);
        if (reordered) {
            btSoftBodyHelpers::ReoptimizeLinkOrder(own->body.get());
        }
        btSoftBody* body = own->body.get();
        body->predictMotion(time_step); // which sets the links up
        add(reordered ? "Bullet, links projected, in its best order" : "Bullet, links projected, in our order",
            "iteration", *body, [own, body](long steps) {
                for (long s = 0; s < steps; ++s) {
                    btSoftBody::PSolve_Links(body, 1, 0);
                }
            });
    }
    const auto whole = std::make_shared<Projected>();
    whole->info.m_gravity = btVector3(0, 0, 0);
    whole->body = make_body(task, &whole->info);
    add("Bullet, btSoftBody, one iteration", "step", *whole->body, [whole, time_step](long steps) {
        for (long s = 0; s < steps; ++s) {
            whole->body->predictMotion(time_step);
            whole->body->solveConstraints();
            whole->body->integrateMotion();
        }
    });

    // Forces.
    const auto deformable = std::make_shared<DeformableWorld>();
    const Network equal = alike(task.springs);
    deformable->add(make_body(task, &deformable->world.getWorldInfo()),
                    std::make_unique<btDeformableMassSpringForce>(
                        static_cast<btScalar>(equal.springs.front().stiffness), btScalar(0), true));
    btSoftBody* body = deformable->body.get();
    for (int n = 0; n < body->m_nodes.size(); ++n) {
        body->m_nodes[n].index = n;
        body->m_nodes[n].m_q = body->m_nodes[n].m_x;
    }
    btDeformableLagrangianForce::TVStack sums;
    sums.resize(body->m_nodes.size(), btVector3(0, 0, 0));
    deformable->force->addScaledElasticForce(1, sums);
    std::vector<Vector3> found;
    for (int n = 0; n < sums.size(); ++n) {
        const btVector3& f = sums[n];
        found.push_back({static_cast<double>(f.x()), static_cast<double>(f.y()), static_cast<double>(f.z())});
    }
    // Positions in float: on the far side of 20 cells a strain of 1e-2 is known to some 1e-4 of itself.
    field.checks.push_back({"Bullet's forces of alike springs beside the plain loops'",
                            difference(plain_forces(equal, task.positions), found), 2e-4});
    add("Bullet, btDeformableMassSpringForce", "forces", *body, [deformable, sums](long steps) mutable {
        for (long s = 0; s < steps; ++s) {
            deformable->force->addScaledElasticForce(1, sums);
        }
    });
    add("Bullet, deformable world, explicit", "step", *body, [deformable, time_step](long steps) {
        for (long s = 0; s < steps; ++s) {
            deformable->world.stepSimulation(time_step, 0);
        }
    });
}

} // namespace hybmss::bench
