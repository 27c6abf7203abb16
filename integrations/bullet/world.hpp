#pragma once

// A deformable world of Bullet with all that it needs to live.

#include "integrations/bullet/hybmss_force.hpp"

#include <array>
#include <memory>
#include <vector>

namespace hybmss::bullet {

class World {
public:
    /// gravity in m/s^2; `implicit` as Bullet means it: elastic forces at the end of the step, by Newton's method.
    World(const btVector3& gravity, bool implicit);
    ~World();

    /// Takes ownership of the body. The force stays the caller's and must outlive the world's steps.
    void add(std::unique_ptr<btSoftBody> body, btDeformableLagrangianForce& force);
    /// The solid half-space under the height y (m): a static box, as Bullet's own examples of deformable bodies have
    /// it.
    void add_floor(btScalar height);
    /// A rigid box of edges `size` (m) about `center`.
    btRigidBody& add_box(const btVector3& size, const btVector3& center, btScalar mass);

    /// Takes steps of exactly this length, s.
    void step(btScalar time_step, long count = 1);

    btSoftBodyWorldInfo& info() { return world_.getWorldInfo(); }
    btDeformableMultiBodyDynamicsWorld& dynamics() { return world_; }

private:
    btSoftBodyRigidBodyCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btDeformableBodySolver deformable_solver_; ///< before the world, which deletes nothing of all this
    btDeformableMultiBodyConstraintSolver constraint_solver_;
    btDeformableMultiBodyDynamicsWorld world_;
    btDeformableGravityForce gravity_;
    std::vector<std::unique_ptr<btSoftBody>> soft_bodies_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> rigid_bodies_;
};

/// The mean of the nodes, by mass; m.
std::array<double, 3> center_of_mass(const btSoftBody& body);
/// J.
double kinetic_energy(const btSoftBody& body);

} // namespace hybmss::bullet
