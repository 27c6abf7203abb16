#pragma once

/// \file
/// Several bodies that touch each other and themselves, and are tied to each other.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/export.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace hybmss {

/// That two bodies touch, or one itself: surface nodes of each and cells of the other. A node inside a cell is pushed
/// to the nearest face of the cells that is free, along the axes of the body at rest, and the cell's corners get the
/// opposite of it by the node's trilinear weights: momentum is kept to rounding, angular momentum too where the node
/// entered. Taken implicitly, as contact with obstacles is: no stable step becomes shorter, and what beats together
/// loses energy.
struct BodyContact {
    std::size_t first = 0, second = 0; ///< bodies; the same one: it touches itself, but for its own neighbourhood
    double friction = 0;               ///< Coulomb's coefficient, >= 0
    /// 1/s^2: a node at the depth p is pushed by m stiffness p, m the mass that node and cell have against each other.
    /// 0: default_contact_stiffness() of the smaller critical time step of the two.
    double stiffness = 0;
    /// s, as an obstacle's. 0: default_friction_delay() of that time step.
    double friction_delay = 0;
};

/// What two bodies did to each other in the last step, and since the contact was set.
struct BodyContactReading {
    std::array<double, 3> force = {0, 0, 0};   ///< N, on the first body in the last step; of a body on itself none
    std::size_t nodes = 0;                     ///< of either that touched
    double depth = 0;                          ///< m: of the deepest node
    double greatest_depth = 0;                 ///< m: likewise, since the contact was set
    std::array<double, 3> impulse = {0, 0, 0}; ///< N s, on the first body since the contact was set
};

/// A point that goes with a body, or one in space.
struct Anchor {
    std::optional<std::size_t> body = {}; ///< none: in space
    /// m: where the point is in the body at rest, within a cell or on a node; or where it is in space.
    std::array<double, 3> point = {0, 0, 0};
};

/// Two points held together by a spring without length, taken implicitly: stable whatever its stiffness.
struct Attachment {
    Anchor from, to;
    /// N/m, > 0; infinite: the points coincide after every step, if no other attachment moves them.
    double stiffness = std::numeric_limits<double>::infinity();
};

/// A free obstacle of a body, by its number there: those of the same `one` are the same.
struct SharedObstacle {
    std::size_t body = 0, obstacle = 0, one = 0;
};

/// A part of a body that is one of its own now.
struct BodyPart {
    std::size_t body; ///< its number in the world
    Lattice lattice;  ///< its cells, on the grid that they had before: for remove_cells()
};

/// Bodies that are stepped together. T is float or double.
///
/// In a step every body takes its own, with what it alone has to do with: loads, prescribed nodes, obstacles, effects.
/// Then bodies push each other, contact by contact, and last the attachments act in the order of their numbers; nodes
/// that are prescribed do not yield. Bodies far from each other take their steps as if they were alone, to the bit.
/// Where there are many, each is stepped by one thread; the results are the same, bit for bit, for any number of
/// threads. Not for concurrent use of one object.
///
///     World<float> world;
///     const std::size_t ball = world.add(ExplicitDynamics<float>(cells, material), cells, {0, 1, 0});
///     const std::size_t block = world.add(ExplicitDynamics<float>(box, material), box);
///     world.set_contacts(std::array{BodyContact{.first = ball, .second = block, .friction = 0.5}});
///     world.step({.time_step = world.critical_time_step() / 2, .acceleration = {0, -9.81, 0}}, 1000);
template <class T>
class HYBMSS_EXPORT World {
public:
    /// `threads`: at most, >= 0; 0 for all of the machine. Throws std::invalid_argument where it is negative.
    explicit World(int threads = 0);
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;
    ~World();

    /// Takes over a body and returns its number, which is how many there were. `lattice` is the one that it was made
    /// from, as it is now; `origin`, m, is where the grid's low corner is. Throws std::invalid_argument for a lattice
    /// or network of another number of nodes and for an origin that is not finite.
    std::size_t add(ExplicitDynamics<T> body, const Lattice& lattice, const std::array<double, 3>& origin = {0, 0, 0});
    std::size_t add(ExplicitDynamics<T> body, const Network& network);
    /// Likewise of a body that stays its owner's, who keeps it where it is and does not replace it while the world
    /// lives.
    std::size_t add(ExplicitDynamics<T>* body, const Lattice& lattice, const std::array<double, 3>& origin = {0, 0, 0});
    std::size_t body_count() const;
    /// To hold, load, read and set it by, where it stays while the world lives. Cells are removed by the world's own
    /// remove_cells(). Throws std::out_of_range for a body that is not there, as all that follow do.
    ExplicitDynamics<T>& body(std::size_t body);
    const ExplicitDynamics<T>& body(std::size_t body) const;

    /// Puts a body as it is at rest where the pose brings it: what is at X, `origin` included, to position + rotation
    /// X, with the pose's velocities. Throws std::invalid_argument for a pose that an obstacle could not have.
    void place(std::size_t body, const RigidPose& pose);
    /// As ExplicitDynamics::remove_cells(), which is not for bodies of a world: step() refuses them then. The faces
    /// laid bare are touched, in time proportional to the body. Attachments let go of nodes that no cell touches any
    /// more, and are taken away with their last one.
    std::size_t remove_cells(std::size_t body, Lattice& lattice, std::span<const std::uint32_t> cells);

    /// Makes bodies of their own of the parts of a body of cells that have no node in common, as cuts leave them; the
    /// part of the most cells stays the body. Each has the places and velocities that its nodes had; attachments go
    /// with their nodes, each part touches what the body touched, and where that touched itself they touch each other.
    /// What holds, loads or damps a part, and its obstacles, is for `make` to set: it is called for each part with a
    /// lattice of that part's cells alone, on the same grid, and returns a body of the same material. `lattice` is the
    /// body's, and loses the cells of the others. In time proportional to the body for each part. Throws
    /// std::invalid_argument for a network, another lattice and a body not made of what `make` was given; then nothing
    /// has changed.
    std::vector<BodyPart> split_parts(std::size_t body, Lattice& lattice,
                                      const std::function<ExplicitDynamics<T>(const Lattice&)>& make);

    /// Replaces the contacts, and forgets what friction held. Throws std::invalid_argument for a body that is not
    /// there, two bodies named twice, and values that the struct does not allow.
    void set_contacts(std::span<const BodyContact> contacts);
    /// One a contact.
    std::vector<BodyContactReading> contact_readings() const;

    /// Free obstacles of several bodies that are the same one, in place of those told before: all its bodies push it in
    /// a step, after their own, and it has one motion, from where the first of them has it on. Steps are taken one at a
    /// time then, by symplectic Euler. Throws std::invalid_argument for what is not there or not free, told twice, or
    /// of another shape, mass or inertia than the same obstacle of another body; so does step(), where obstacles have
    /// been replaced since.
    void set_shared_obstacles(std::span<const SharedObstacle> obstacles);

    /// Returns the attachment's number. Throws std::invalid_argument for a body that is not there, a stiffness that is
    /// not > 0, two points in space, and a point that is in no cell and on no node of its body.
    std::size_t attach(const Attachment& attachment);
    /// Moves the end of an attachment that is in space, to where it shall be after the next step. Throws
    /// std::invalid_argument where there is none or the point is not finite.
    void move_anchor(std::size_t attachment, const std::array<double, 3>& point);
    /// N, that it exerted on what it comes from, in the last step. Zero where it has been taken away.
    std::array<double, 3> attachment_force(std::size_t attachment) const;
    /// Whether an attachment is there still.
    bool attached(std::size_t attachment) const;
    /// Takes an attachment away; the others keep their numbers.
    void detach(std::size_t attachment);

    /// Takes `count` steps of every body, all with the same parameters. Throws what ExplicitDynamics::step throws for
    /// them, before any body has moved.
    void step(const StepParameters& parameters, long count = 1);
    /// The same with what is prescribed on its way, one motion a body, as ExplicitDynamics::step() takes it. Throws
    /// std::invalid_argument for another count of motions; what a motion throws leaves the world between two states.
    void step(const StepParameters& parameters, long count, std::span<const StepMotion> motions);
    /// s: the smallest of the bodies'; infinite without bodies.
    double critical_time_step() const;

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

extern template class World<float>;
extern template class World<double>;

} // namespace hybmss
