#pragma once

/// \file
/// HybMSS bodies in a btDeformableMultiBodyDynamicsWorld, through Bullet's own interface for forces of deformable
/// bodies.

#include "hybmss/force_plan.hpp"

// Bullet's headers do not compile without warnings, so they come in as system headers (CMakeLists.txt).
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableLagrangianForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

namespace hybmss::bullet {

/// The force of all HybMSS bodies of one world: Bullet keeps one object a kind of force. Make the bodies with
/// make_body() and give each to the world, and to world.addForce(body, &force). The world must not outlive this object,
/// nor this object's bodies the worldInfo that they were made with.
///
/// Bullet integrates and resolves contacts; this gives forces, second derivatives (implicit worlds), energy, and the
/// damping -c m v - d K v. Bullet's memory (x y z w of each node) is read and written as it lies.
class HybmssForce final : public btDeformableLagrangianForce {
public:
    using Plan = ForcePlan<btScalar>;

    /// `mass_damping` c in 1/s, `stiffness_damping` d in s, both >= 0. Throws std::invalid_argument.
    explicit HybmssForce(double mass_damping = 0, double stiffness_damping = 0);
    ~HybmssForce() override;

    /// A deformable body with a node for each of the lattice's, in its order, at rest where its low corner is at
    /// `origin` (m). Its nodes collide with rigid bodies. Owned by the caller, as Bullet wants it.
    btSoftBody* make_body(btSoftBodyWorldInfo& world, const Lattice& lattice, const Material& material,
                          const btVector3& origin);

    void addSoftBody(btSoftBody* body) override;
    void addScaledForces(btScalar scale, TVStack& force) override;
    void addScaledExplicitForce(btScalar scale, TVStack& force) override;
    void addScaledDampingForce(btScalar scale, TVStack& force) override;
    void addScaledElasticForceDifferential(btScalar scale, const TVStack& dx, TVStack& df) override;
    void addScaledDampingForceDifferential(btScalar scale, const TVStack& dv, TVStack& df) override;
    void buildDampingForceDifferentialDiagonal(btScalar scale, TVStack& diagonal) override;
    void addScaledHessian(btScalar scale) override;
    double totalElasticEnergy(btScalar time_step) override;
    btDeformableLagrangianForceType getForceType() override;

    /// Of one body of make_body(): what its plan chose.
    PlanDescription describe(const btSoftBody& body) const;

private:
    struct Body;
    void add_elastic_forces(Body& body, btScalar scale, TVStack& force);
    void add_hessian_product(Body& body, btScalar scale, const TVStack& direction, TVStack& product);
    void add_mass_damping(const Body& body, btScalar scale, const TVStack& velocity, TVStack& force) const;
    std::vector<Body*> active_bodies();

    double mass_damping_, stiffness_damping_;
    std::vector<std::unique_ptr<Body>> bodies_;
};

} // namespace hybmss::bullet
