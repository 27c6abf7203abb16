#pragma once

// The ODE side of it is here whole: an engine takes this one file.

#include "hybmss/explicit_dynamics.hpp"

#include <ode/ode.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace hybmss::ode {

/// The obstacle that has the shape and pose of a plane, sphere, box or capsule of ODE, at rest. Throws
/// std::invalid_argument for geoms of other classes.
Obstacle obstacle_of(dGeomID geom);

/// Rigid bodies of an ODE world that touch one soft body, both ways. ODE moves them; the soft body then takes as many
/// steps of its own along the very way that each has gone, and the impulses that it gave to them change their
/// velocities: what one gets the other has lost, to rounding, however many steps that were. Angular momentum is kept to
/// the first order of the frame: the arm of an impulse is that at the beginning of its step. T is float or double.
///
///     dWorldStep(world, frame);
///     coupling.step({.time_step = frame / 8, .acceleration = {0, -9.81, 0}}, 8);
///
/// The soft body feels a rigid one as it moves within a frame, not what it does to it in that frame: rigid bodies
/// should be heavier than the nodes that bear them, see docs/ode.md.
template <class T>
class Coupling {
public:
    /// `surface`: the nodes that touch. Both the body and the geoms that are added must outlive the coupling, which has
    /// the obstacles of the body to itself.
    Coupling(ExplicitDynamics<T>& body, std::vector<SurfaceNode> surface);

    /// A geom with a body, or one without, which never yields. What friction held on others is let go. Throws as
    /// obstacle_of() does.
    void add(dGeomID geom, double friction = 0);
    /// `count` steps of the soft body, in the time that the world has moved on since the last call or since the geom
    /// was added: it should be the same.
    void step(const StepParameters& parameters, long count);
    /// One a geom, in the order of add().
    std::vector<ObstacleReading> readings() const { return body_->obstacle_readings(); }

private:
    struct Rigid {
        dGeomID geom;
        RigidPose pose;                                                         ///< where it was after the last step
        std::array<double, 3> impulse = {0, 0, 0}, angular_impulse = {0, 0, 0}; ///< given to the soft body so far
    };

    ExplicitDynamics<T>* body_;
    std::vector<SurfaceNode> surface_;
    std::vector<Obstacle> obstacles_;
    std::vector<Rigid> rigids_;
};

namespace detail {

using Eigen::Matrix3d;
using Eigen::Vector3d;

using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// ODE's matrices have rows of four.
inline Rows matrix(const dReal* rows) {
    Rows m;
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            m(a, b) = static_cast<double>(rows[4 * a + b]);
        }
    }
    return m;
}
inline Vector3d vector(const dReal* x) {
    return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}
inline Vector3d vector(const std::array<double, 3>& x) {
    return {x[0], x[1], x[2]};
}
inline std::array<double, 3> array(const Vector3d& x) {
    return {x[0], x[1], x[2]};
}

inline RigidPose pose_of(dGeomID geom) {
    RigidPose pose;
    if (dGeomGetClass(geom) == dPlaneClass) { // which has no place of its own
        dVector4 plane;
        dGeomPlaneGetParams(geom, plane);
        pose.position = array(static_cast<double>(plane[3]) * vector(plane));
        return pose;
    }
    pose.position = array(vector(dGeomGetPosition(geom)));
    const Rows rotation = matrix(dGeomGetRotation(geom));
    std::copy_n(rotation.data(), 9, pose.rotation.begin());
    return pose;
}

/// rad, as a vector along the axis: the shorter way from one rotation to another.
inline Vector3d turn(const RigidPose& from, const RigidPose& to) {
    const Matrix3d a = Eigen::Map<const Rows>(from.rotation.data()), b = Eigen::Map<const Rows>(to.rotation.data());
    const Eigen::Quaterniond q(b * a.transpose());
    const double sine = q.vec().norm(), angle = 2 * std::atan2(sine, std::abs(q.w()));
    return sine > 0 ? Vector3d((q.w() < 0 ? -angle : angle) / sine * q.vec()) : Vector3d(0, 0, 0);
}

/// Where the geom will be so many seconds later, by the velocities that its body has now.
inline RigidPose ahead(dGeomID geom, double seconds) {
    RigidPose pose = pose_of(geom);
    if (const dBodyID body = dGeomGetBody(geom)) {
        const Vector3d spin = vector(dBodyGetAngularVel(body));
        const Vector3d arm = vector(pose.position) - vector(dBodyGetPosition(body));
        pose.position = array(vector(pose.position) + seconds * (vector(dBodyGetLinearVel(body)) + spin.cross(arm)));
        if (const double rate = spin.norm(); rate > 0) {
            Eigen::Map<Rows> rotation(pose.rotation.data());
            rotation = Rows(Eigen::AngleAxisd(seconds * rate, spin / rate).toRotationMatrix() * rotation);
        }
    }
    return pose;
}

} // namespace detail

inline Obstacle obstacle_of(dGeomID geom) {
    using namespace detail;
    Obstacle obstacle{.pose = pose_of(geom)};
    switch (dGeomGetClass(geom)) {
    case dPlaneClass: {
        dVector4 plane;
        dGeomPlaneGetParams(geom, plane);
        obstacle.shape = PlaneShape{array(vector(plane))};
        break;
    }
    case dSphereClass:
        obstacle.shape = SphereShape{static_cast<double>(dGeomSphereGetRadius(geom))};
        break;
    case dBoxClass: {
        dVector3 lengths;
        dGeomBoxGetLengths(geom, lengths);
        obstacle.shape = BoxShape{array(vector(lengths))};
        break;
    }
    case dCapsuleClass: {
        dReal radius = 0, length = 0;
        dGeomCapsuleGetParams(geom, &radius, &length);
        obstacle.shape = CapsuleShape{{0, 0, static_cast<double>(length)}, static_cast<double>(radius)};
        break;
    }
    default:
        throw std::invalid_argument("geom of class " + std::to_string(dGeomGetClass(geom)) +
                                    ": it must be a plane, sphere, box or capsule");
    }
    return obstacle;
}

template <class T>
Coupling<T>::Coupling(ExplicitDynamics<T>& body, std::vector<SurfaceNode> surface)
    : body_(&body), surface_(std::move(surface)) {}

template <class T>
void Coupling<T>::add(dGeomID geom, double friction) {
    Obstacle obstacle = obstacle_of(geom);
    obstacle.friction = friction;
    obstacles_.push_back(obstacle);
    rigids_.push_back({geom, obstacle.pose});
    for (std::size_t r = 0; r < rigids_.size(); ++r) {
        obstacles_[r].pose = rigids_[r].pose;
        rigids_[r].impulse = rigids_[r].angular_impulse = {0, 0, 0}; // counted anew, too
    }
    body_->set_obstacles(surface_, obstacles_);
}

template <class T>
void Coupling<T>::step(const StepParameters& parameters, long count) {
    using namespace detail;
    if (count < 1) {
        throw std::invalid_argument("count = " + std::to_string(count) + " is not allowed: it must be at least 1 step");
    }
    const double frame = parameters.time_step * static_cast<double>(count);
    std::vector<RigidPose> ways;
    for (Rigid& rigid : rigids_) {
        // Half a frame ahead of ODE: the mean of the forces on the way is then that of where the rigid body is now, and
        // the two together go by semi-implicit Euler. On the way behind it they would come half a frame late, which
        // makes a body swing ever more on the soft one.
        const RigidPose end = ahead(rigid.geom, frame / 2);
        RigidPose& way = ways.emplace_back(rigid.pose);
        way.velocity = array((vector(end.position) - vector(rigid.pose.position)) / frame);
        way.angular_velocity = array(turn(rigid.pose, end) / frame);
        rigid.pose = end;
    }
    body_->move_obstacles(ways);
    body_->step(parameters, count);
    const std::vector<ObstacleReading> readings = body_->obstacle_readings();
    for (std::size_t r = 0; r < rigids_.size(); ++r) {
        Rigid& rigid = rigids_[r];
        const Vector3d blow = vector(rigid.impulse) - vector(readings[r].impulse);
        const Vector3d twist = vector(rigid.angular_impulse) - vector(readings[r].angular_impulse);
        rigid.impulse = readings[r].impulse;
        rigid.angular_impulse = readings[r].angular_impulse;
        const dBodyID body = dGeomGetBody(rigid.geom);
        if (body == nullptr || blow == Vector3d(0, 0, 0)) {
            continue;
        }
        dMass mass;
        dBodyGetMass(body, &mass);
        const Rows rotation = matrix(dBodyGetRotation(body));
        const Matrix3d inertia = rotation * matrix(mass.I) * rotation.transpose();
        // About the centre of mass, from the geom's own.
        const Vector3d arm = vector(rigid.pose.position) - vector(dBodyGetPosition(body));
        const Vector3d velocity = vector(dBodyGetLinearVel(body)) + blow / static_cast<double>(mass.mass);
        const Vector3d spin = vector(dBodyGetAngularVel(body)) + inertia.llt().solve(twist + arm.cross(blow));
        dBodySetLinearVel(body, velocity[0], velocity[1], velocity[2]);
        dBodySetAngularVel(body, spin[0], spin[1], spin[2]);
        dBodyEnable(body); // it may have fallen asleep
    }
}

} // namespace hybmss::ode
