#include "integrations/bullet/hybmss_force.hpp"

#include "hybmss/explicit_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss::bullet {
namespace {

using TVStack = btDeformableLagrangianForce::TVStack;

static_assert(sizeof(btVector3) == 4 * sizeof(btScalar), "a vector of Bullet is x y z w");

/// A body's part of one of the world's arrays.
VectorField<btScalar> field(TVStack& all, int first, std::size_t nodes) {
    return VectorField<btScalar>::aos(all[first].m_floats, nodes, 4);
}
VectorField<const btScalar> field(const TVStack& all, int first, std::size_t nodes) {
    return VectorField<const btScalar>::aos(all[first].m_floats, nodes, 4);
}

/// Bullet builds its trees over the links of nodes, and does not end where they leave nodes apart. Links alone exert no
/// force here: only btDeformableMassSpringForce reads them.
void link_nodes(btSoftBody& body, const Lattice& lattice) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    const auto row = static_cast<std::uint32_t>(lattice.cells()[0] + 1);
    const std::uint32_t layer = row * static_cast<std::uint32_t>(lattice.cells()[1] + 1);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (n > 0) { // the next in number: a neighbour in its row, or what keeps the body's parts together
            body.appendLink(static_cast<int>(n - 1), static_cast<int>(n));
        }
        for (const std::uint32_t step : {row, layer}) {
            const auto above = std::lower_bound(nodes.begin(), nodes.end(), nodes[n] + step);
            if (above != nodes.end() && *above == nodes[n] + step) {
                body.appendLink(static_cast<int>(n), static_cast<int>(above - nodes.begin()));
            }
        }
    }
}

void check_damping(const char* what, double value) {
    if (!(value >= 0) || !std::isfinite(value)) {
        throw std::invalid_argument(std::string(what) + " = " + std::to_string(value) +
                                    " is not allowed: it must be finite and >= 0");
    }
}

} // namespace

struct HybmssForce::Body {
    static PlanOptions one_thread() {
        PlanOptions options;
        options.threads = 1;
        return options;
    }

    Body(const Lattice& lattice, const Material& material, const btVector3& origin)
        : plan(lattice, material, one_thread()) {
        for (const std::uint32_t node : lattice.nodes()) {
            const auto x = lattice.rest_position(node);
            rest.push_back(origin + btVector3(static_cast<btScalar>(x[0]), static_cast<btScalar>(x[1]),
                                              static_cast<btScalar>(x[2])));
        }
        const int count = static_cast<int>(rest.size());
        displacement.resize(count);
        scratch.resize(count);
    }

    std::size_t size() const { return rest.size(); }
    /// Where this body's nodes begin in the world's arrays.
    int first() const { return soft_body->m_nodes[0].index; }

    /// u = q - X; q is where Bullet asks for forces: its latest iterate in an implicit step.
    VectorField<const btScalar> present_displacement() {
        for (int n = 0; n < displacement.size(); ++n) {
            displacement[n] = soft_body->m_nodes[n].m_q - rest[static_cast<std::size_t>(n)];
        }
        return field(std::as_const(displacement), 0, size());
    }

    VectorField<btScalar> cleared_scratch() {
        for (int n = 0; n < scratch.size(); ++n) {
            scratch[n].setZero();
        }
        return field(scratch, 0, size());
    }

    btSoftBody* soft_body = nullptr;
    Plan plan;
    std::vector<btVector3> rest;
    TVStack displacement, scratch;
};

HybmssForce::HybmssForce(double mass_damping, double stiffness_damping)
    : mass_damping_(mass_damping), stiffness_damping_(stiffness_damping) {
    check_damping("mass_damping", mass_damping);
    check_damping("stiffness_damping", stiffness_damping);
}

HybmssForce::~HybmssForce() = default;

btSoftBody* HybmssForce::make_body(btSoftBodyWorldInfo& world, const Lattice& lattice, const Material& material,
                                   const btVector3& origin) {
    auto body = std::make_unique<Body>(lattice, material, origin);
    std::vector<btScalar> masses;
    const ExplicitDynamics<btScalar> heavy(lattice, material);
    for (const double mass : heavy.masses()) {
        masses.push_back(static_cast<btScalar>(mass));
    }
    auto soft_body =
        std::make_unique<btSoftBody>(&world, static_cast<int>(body->size()), body->rest.data(), masses.data());
    link_nodes(*soft_body, lattice);
    soft_body->m_cfg.collisions = btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN; // nodes touch
    soft_body->m_cfg.kDF = 0; // friction with rigid bodies, by default none
    soft_body->m_cfg.drag = 0;
    soft_body->m_sleepingThreshold = 0;
    soft_body->setActivationState(DISABLE_DEACTIVATION);
    body->soft_body = soft_body.get();
    bodies_.push_back(std::move(body));
    return soft_body.release();
}

void HybmssForce::addSoftBody(btSoftBody* soft_body) {
    for (const auto& body : bodies_) {
        if (body->soft_body == soft_body) {
            btDeformableLagrangianForce::addSoftBody(soft_body);
            return;
        }
    }
    throw std::invalid_argument("HybmssForce: the soft body was not made by make_body() of the world's HybmssForce");
}

std::vector<HybmssForce::Body*> HybmssForce::active_bodies() {
    std::vector<Body*> active;
    for (const auto& body : bodies_) {
        if (m_softBodies.findLinearSearch2(body->soft_body) >= 0 && body->soft_body->isActive()) {
            active.push_back(body.get());
        }
    }
    return active;
}

void HybmssForce::add_elastic_forces(Body& body, btScalar scale, TVStack& force) {
    body.plan.add_forces(body.present_displacement(), body.cleared_scratch());
    for (int n = 0; n < body.scratch.size(); ++n) {
        force[body.first() + n] += scale * body.scratch[n];
    }
}

/// product <- product - scale K direction: forces are minus the gradient of the energy.
void HybmssForce::add_hessian_product(Body& body, btScalar scale, const TVStack& direction, TVStack& product) {
    const int first = body.first();
    body.plan.add_hessian_product(body.present_displacement(), field(direction, first, body.size()),
                                  body.cleared_scratch());
    for (int n = 0; n < body.scratch.size(); ++n) {
        product[first + n] -= scale * body.scratch[n];
    }
}

void HybmssForce::add_mass_damping(const Body& body, btScalar scale, const TVStack& velocity, TVStack& force) const {
    const int first = body.first();
    for (int n = 0; n < body.soft_body->m_nodes.size(); ++n) {
        if (const btScalar inverse_mass = body.soft_body->m_nodes[n].m_im; inverse_mass > 0) {
            force[first + n] -= (scale * static_cast<btScalar>(mass_damping_) / inverse_mass) * velocity[first + n];
        }
    }
}

void HybmssForce::addScaledForces(btScalar scale, TVStack& force) {
    addScaledDampingForce(scale, force);
    for (Body* body : active_bodies()) {
        add_elastic_forces(*body, scale, force);
    }
}

void HybmssForce::addScaledExplicitForce(btScalar scale, TVStack& force) {
    for (Body* body : active_bodies()) {
        add_elastic_forces(*body, scale, force);
    }
}

void HybmssForce::addScaledDampingForce(btScalar scale, TVStack& force) {
    if (mass_damping_ == 0 && stiffness_damping_ == 0) {
        return;
    }
    for (Body* body : active_bodies()) {
        const int first = body->first();
        TVStack velocity; // in the world's numbering
        velocity.resize(first + static_cast<int>(body->size()));
        for (int n = 0; n < body->soft_body->m_nodes.size(); ++n) {
            velocity[first + n] = body->soft_body->m_nodes[n].m_v;
        }
        add_mass_damping(*body, scale, velocity, force);
        if (stiffness_damping_ > 0) {
            add_hessian_product(*body, scale * static_cast<btScalar>(stiffness_damping_), velocity, force);
        }
    }
}

void HybmssForce::addScaledElasticForceDifferential(btScalar scale, const TVStack& dx, TVStack& df) {
    for (Body* body : active_bodies()) {
        add_hessian_product(*body, scale, dx, df);
    }
}

void HybmssForce::addScaledDampingForceDifferential(btScalar scale, const TVStack& dv, TVStack& df) {
    for (Body* body : active_bodies()) {
        if (mass_damping_ > 0) {
            add_mass_damping(*body, scale, dv, df);
        }
        if (stiffness_damping_ > 0) {
            add_hessian_product(*body, scale * static_cast<btScalar>(stiffness_damping_), dv, df);
        }
    }
}

// Bullet 3 preconditions by masses alone and calls this for no force of its own.
void HybmssForce::buildDampingForceDifferentialDiagonal(btScalar, TVStack&) {}

/// What a contact feels of a node in an implicit world: M + dt^2 K + dt (c M + d K), of K the node's own block.
void HybmssForce::addScaledHessian(btScalar time_step) {
    const auto stiff = time_step * (time_step + static_cast<btScalar>(stiffness_damping_));
    for (Body* body : active_bodies()) {
        std::vector<btScalar> blocks(6 * body->size());
        body->plan.hessian_diagonal(body->present_displacement(), blocks);
        for (std::size_t n = 0; n < body->size(); ++n) {
            btSoftBody::Node& node = body->soft_body->m_nodes[static_cast<int>(n)];
            if (node.m_im > 0) {
                const btScalar* b = &blocks[6 * n]; // xx, yy, zz, xy, xz, yz
                const btScalar m = time_step * static_cast<btScalar>(mass_damping_) / node.m_im;
                node.m_effectiveMass += btMatrix3x3(m + stiff * b[0], stiff * b[3], stiff * b[4], //
                                                    stiff * b[3], m + stiff * b[1], stiff * b[5], //
                                                    stiff * b[4], stiff * b[5], m + stiff * b[2]);
            }
        }
    }
}

double HybmssForce::totalElasticEnergy(btScalar) {
    double energy = 0;
    for (Body* body : active_bodies()) {
        energy += body->plan.energy(body->present_displacement()).total();
    }
    return energy;
}

btDeformableLagrangianForceType HybmssForce::getForceType() {
    // Bullet joins forces of one type. 7 is the only value of its enumeration's range that it does not use itself.
    return static_cast<btDeformableLagrangianForceType>(7);
}

PlanDescription HybmssForce::describe(const btSoftBody& soft_body) const {
    for (const auto& body : bodies_) {
        if (body->soft_body == &soft_body) {
            return body->plan.describe();
        }
    }
    throw std::invalid_argument("HybmssForce: not one of its bodies");
}

} // namespace hybmss::bullet
