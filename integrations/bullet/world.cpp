#include "integrations/bullet/world.hpp"

namespace hybmss::bullet {

World::World(const btVector3& gravity, bool implicit)
    : world_(&dispatcher_, &broadphase_, &constraint_solver_, &configuration_, &deformable_solver_), gravity_(gravity) {
    constraint_solver_.setDeformableSolver(&deformable_solver_);
    world_.setGravity(gravity);
    info().m_gravity = gravity;
    info().m_sparsesdf.setDefaultVoxelsz(btScalar(0.1));
    info().m_sparsesdf.Reset();
    world_.setImplicit(implicit);
    world_.setUseProjection(implicit); // the other way, Lagrange multipliers, is not made for implicit worlds
    world_.setLineSearch(false);
}

World::~World() {
    for (const auto& body : rigid_bodies_) {
        world_.removeRigidBody(body.get());
    }
    for (const auto& body : soft_bodies_) {
        world_.removeSoftBody(body.get());
    }
}

void World::add(std::unique_ptr<btSoftBody> body, btDeformableLagrangianForce& force) {
    world_.addSoftBody(body.get());
    world_.addForce(body.get(), &force);
    world_.addForce(body.get(), &gravity_);
    soft_bodies_.push_back(std::move(body));
}

btRigidBody& World::add_box(const btVector3& size, const btVector3& center, btScalar mass) {
    shapes_.push_back(std::make_unique<btBoxShape>(size / 2));
    btVector3 inertia(0, 0, 0);
    if (mass > 0) {
        shapes_.back()->calculateLocalInertia(mass, inertia);
    }
    btRigidBody::btRigidBodyConstructionInfo construction(mass, nullptr, shapes_.back().get(), inertia);
    construction.m_startWorldTransform.setIdentity();
    construction.m_startWorldTransform.setOrigin(center);
    construction.m_friction = 0;
    construction.m_restitution = 0;
    rigid_bodies_.push_back(std::make_unique<btRigidBody>(construction));
    rigid_bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(rigid_bodies_.back().get());
    return *rigid_bodies_.back();
}

void World::add_floor(btScalar height) {
    const btScalar thickness = 2;
    add_box(btVector3(20, thickness, 20), btVector3(0, height - thickness / 2, 0), 0);
}

void World::step(btScalar time_step, long count) {
    for (long i = 0; i < count; ++i) {
        world_.stepSimulation(time_step, 0);
    }
}

std::array<double, 3> center_of_mass(const btSoftBody& body) {
    std::array<double, 3> moment = {0, 0, 0};
    double mass = 0;
    for (int n = 0; n < body.m_nodes.size(); ++n) {
        const double m = 1 / static_cast<double>(body.m_nodes[n].m_im);
        mass += m;
        for (int c = 0; c < 3; ++c) {
            moment[static_cast<std::size_t>(c)] += m * static_cast<double>(body.m_nodes[n].m_x[c]);
        }
    }
    return {moment[0] / mass, moment[1] / mass, moment[2] / mass};
}

double kinetic_energy(const btSoftBody& body) {
    double sum = 0;
    for (int n = 0; n < body.m_nodes.size(); ++n) {
        sum += static_cast<double>(body.m_nodes[n].m_v.length2()) / static_cast<double>(body.m_nodes[n].m_im);
    }
    return sum / 2;
}

} // namespace hybmss::bullet
