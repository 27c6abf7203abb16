#pragma once

/// \file
/// A body that moves by explicit steps: owns its state in the layout that the kernels like best.

#include "hybmss/contact.hpp"
#include "hybmss/export.h"
#include "hybmss/force_plan.hpp"
#include "hybmss/pressure.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hybmss {

template <class T>
class World;
template <class T>
class Batch;

/// How steps go on from velocity and displacement, at the same price: see ExplicitDynamics.
enum class Integrator { symplectic_euler, leapfrog };

/// What acts on every node in one step, besides the internal forces.
struct StepParameters {
    double time_step = 0;                           ///< s, > 0
    std::array<double, 3> acceleration = {0, 0, 0}; ///< gravity, m/s^2
    double mass_damping = 0;                        ///< c in 1/s, >= 0: the force -c m v, taken implicitly
    Integrator integrator = Integrator::symplectic_euler;

    bool operator==(const StepParameters&) const = default;
};

/// A node whose displacement and velocity are given, along the named axes only; the other axes stay free.
struct PrescribedNode {
    std::uint32_t node = 0;
    std::uint8_t axes = 7; ///< bit 0: x, bit 1: y, bit 2: z
    std::array<double, 3> displacement = {0, 0, 0};
    std::array<double, 3> velocity = {0, 0, 0};
};

/// How prescribed nodes and obstacles are led through a call of many steps: asked once a step, for its end; `step`
/// counts from 1 in each call. Either may be empty: nodes then stay, obstacles go on by their velocities. Asked by one
/// thread at a time, not always the same, while others wait; spans are read before the next time. Neither may use the
/// body.
struct StepMotion {
    /// The nodes of the last prescribe(), with the same axes and in the same order.
    std::function<std::span<const PrescribedNode>(long step)> nodes;
    /// One pose an obstacle.
    std::function<std::span<const RigidPose>(long step)> obstacles;
};

/// A constant force on one node, N.
struct NodalLoad {
    std::uint32_t node = 0;
    std::array<double, 3> force = {0, 0, 0};
};

/// A branch of a Prony series: beside the body's own moduli, which are those of slow loads, it has `part` times as much
/// again, that fades by exp(-t / time).
struct Relaxation {
    double part = 0; ///< > 0, at most 1e6
    double time = 0; ///< s, > 0
    bool operator==(const Relaxation&) const = default;
};

/// A cell's own size at rest: by how much its x, y and z axes are stretched there, each in [0.1, 10]; 1, 1, 1 is as it
/// was made.
using RestStretch = std::array<double, 3>;
inline constexpr double kLeastRestStretch = 0.1, kMostRestStretch = 10;

/// What an effect beyond the body's own forces has of energy, J.
struct EffectEnergy {
    std::string name;
    double stored = 0;
    double dissipated = 0; ///< since the effect was made
};

/// Semi-implicit (symplectic) Euler: v <- (v + dt (f/m + g)) / (1 + dt c), then u <- u + dt v. Of the first order. T is
/// float or double.
///
/// Leapfrog, of the second order in free motions, gravity, mass damping, loads and prescribed motion: half a kick, u <-
/// u + dt v, half a kick; a kick of the time t is v <- q v + (1 - q)/c (f/m + g), q = e^(-c t). The second half is
/// taken together with the first of the step that follows, so that a step evaluates forces once, in calls of one step
/// too. To read velocities, and what comes of them (kinetic energy, forces and energies of effects, obstacles'
/// readings), takes an evaluation of forces of its own and leaves the motion as it is. So does, and completes the step,
/// whatever changes in the middle of a kick: other nodes prescribed, effects switched, displacements set, cells
/// removed, the other integrator. Contact and damping along the springs stay of the first order: obstacles push at the
/// end of a step, dashpots by the velocity half a step before.
///
/// Nodes are numbered as in the body. Not for concurrent use of one object. Results are bit-identical for any number of
/// threads. Construction throws as ForcePlan does. The body starts at rest: u = v = 0.
template <class T>
class HYBMSS_EXPORT ExplicitDynamics {
public:
    using Scalar = T;

    ExplicitDynamics(const Lattice& lattice, const Material& material, const PlanOptions& options = {});
    explicit ExplicitDynamics(const Network& network, const PlanOptions& options = {});
    ExplicitDynamics(ExplicitDynamics&&) noexcept;
    ExplicitDynamics& operator=(ExplicitDynamics&&) noexcept;
    ~ExplicitDynamics();

    std::size_t node_count() const;

    /// Replaces the list of prescribed nodes; their state is set at once, and again after every step. Throws
    /// std::invalid_argument for a node that is not there, axes above 7, an axis of a node given twice, and numbers
    /// that are not finite in the body's precision.
    void prescribe(std::span<const PrescribedNode> nodes);

    /// Replaces the list of loads; several on one node add up. Throws std::invalid_argument for a node that does not
    /// exist or a force that is not finite. Steps of a body without loads cost nothing for it.
    void load(std::span<const NodalLoad> loads);

    /// Replaces the faces that are pressed; none at all for no pressure. `pressures`: Pa, one a face; above zero it
    /// pushes into the face's cell. The force is that of the pressure all over the face where it is now: what it does
    /// to a closed surface is -p times the derivative of the volume inside. Faces whose cell is removed are no more
    /// pressed, those that a cut lays bare are not either. One of effect_energies(): less the work that it has done is
    /// stored. The critical time step stays as it is, which is right for pressures far below Young's modulus. Throws
    /// std::invalid_argument for nodes that are not there, one twice in a face, another count, and numbers that are not
    /// finite.
    ///
    ///     const std::vector<SurfaceFace> faces = surface_faces(lattice);
    ///     dynamics.press(faces, std::vector<double>(faces.size(), 1e3));
    void press(std::span<const SurfaceFace> faces, std::span<const double> pressures);
    /// Other pressures on the same faces, from now on. Throws as press() does.
    void set_pressures(std::span<const double> pressures);

    /// Removes cells from the moving body, in time proportional to their number (the first call takes a pass over the
    /// body's grid too): stiffnesses and masses that they shared become what they are in a body built without them.
    /// `lattice` is the one that this body was made from, less the cells removed since, and they are removed from it as
    /// well; `cells` are indices as Lattice::cell_index() gives, those without a cell are passed over. Returns how many
    /// were removed.
    ///
    /// Nodes keep their numbers. One that no cell touches any more has no mass and no force, is not loaded, and stays
    /// where it is unless it is prescribed. Where there are obstacles, the nodes laid bare may touch them too.
    /// critical_time_step() stays as it was, and stays a lower bound: it bounds
    /// x'Kx / x'Mx cell by cell, and a cell takes its share of both away with it.
    ///
    /// Throws std::invalid_argument, and changes nothing, for an index outside the grid, a lattice of another grid, of
    /// other cells' size, with other nodes, or at the first call with more or fewer cells, and a body that cannot be
    /// cut: a network, or a lattice in a network's layout.
    std::size_t remove_cells(Lattice& lattice, std::span<const std::uint32_t> cells);
    /// Whether this body is one that can.
    bool can_remove_cells() const;
    /// Replaces the obstacles, and the nodes that may touch them; none at all for no obstacles. What friction held is
    /// let go. No step becomes shorter by them. Throws std::invalid_argument for nodes that
    /// are not there or named twice, and for values that the structs do not allow. Nodes alone touch: an obstacle
    /// smaller than a cell slips between them.
    ///
    ///     dynamics.set_obstacles(surface_nodes(lattice), std::array{Obstacle{.shape = PlaneShape{}, .friction =
    ///     0.5}});
    void set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles);
    /// Likewise obstacles that touch the body's skin: depth is that of its points, and a point's force acts on its
    /// nodes by their weights, so that momentum is kept to rounding. A point has its part of its nodes' masses, so that
    /// the body is as stiff to touch with many points as with few. The same bits for any number of threads. They take
    /// the place of all obstacles before, and the other way round. Throws for weights whose sum is not 1, too. Points
    /// of cells that have been removed touch nothing, nor do the faces that a cut lays bare.
    ///
    ///     dynamics.set_skin_obstacles(skin_points(lattice, smooth_boundary_mesh(lattice)), obstacles);
    void set_skin_obstacles(std::span<const SkinPoint> skin, std::span<const Obstacle> obstacles);
    /// Sets where the obstacles are now, one pose each; in the steps that follow each goes on by its velocities. That
    /// of a free one is not used. Throws std::invalid_argument for another count and for poses that are not finite.
    void move_obstacles(std::span<const RigidPose> poses);
    /// Where they are now, free ones too, and how they move.
    std::vector<RigidPose> obstacle_poses() const;
    /// One an obstacle, at the present state.
    std::vector<ObstacleReading> obstacle_readings() const;
    /// Sets (not adds) what the obstacles exert on each node at the present state, friction too, N; their sum is that
    /// of obstacle_readings(). Zero where there are none.
    void get_contact_forces(VectorField<T> out) const;
    /// Damps all springs along themselves (Kelvin-Voigt) from now on: with the force c (n.v) n on each, v the velocity
    /// of its ends to each other, n its direction, c = stiffness_damping times its stiffness; taken at the velocity
    /// before a step. Rigid motions are not damped. `stiffness_damping` in s, >= 0; 0: no more, and no cost. One of
    /// effect_energies(). Makes critical_time_step() smaller. Throws std::invalid_argument for a value that is not
    /// finite or negative.
    void damp_springs(double stiffness_damping);

    /// Gives the material of a lattice a memory from now on: of every cell all moduli are 1 + sum of part exp(-t /
    /// time) times what they are for slow loads, whatever nu. By the Green strain of a cell's mean deformation E, with
    /// which each branch's own strain h goes, dh/dt = dE/dt - h / time, exactly for strains that change steadily within
    /// a step; its stress is that of an isotropic material, part (lambda tr h + 2 G h). Rigid motions do nothing to it.
    /// `lattice` and `material` are those that the body was made from, less the cells removed since; the strain that
    /// the cells have now counts as old. No branches: no more, and no cost. One of effect_energies(). Makes
    /// critical_time_step() smaller. Throws std::invalid_argument for values that are not allowed, more than four
    /// branches, and a lattice with other nodes.
    void relax(const Lattice& lattice, const Material& material, std::span<const Relaxation> branches);

    /// Makes cells be of another size at rest: muscles that contract, tissue that swells or grows, chambers of a soft
    /// robot. A cell that stored the energy W of its deformation F stores Ja W(F diag(1/s)) with the stretches s and
    /// Ja = s_x s_y s_z: what an unloaded cell so stretched is, of the same material. Along the axes of the grid at
    /// rest; with equal stretches a cell of the edge s h. Masses and damping stay. `lattice` and `material` are those
    /// that the body was made from, less the cells removed since; `cells` are indices as Lattice::cell_index() gives,
    /// each once, `stretches` one a cell. None: no more, and no cost. One of effect_energies(): stored is what is added
    /// to the body's own energy, dissipated what changes of the sizes have put in, with the sign reversed. Makes
    /// critical_time_step() smaller by sqrt(Ja) over the least stretch where that is above 1. Throws
    /// std::invalid_argument for cells that are not there or twice, another count, stretches outside of the range, and
    /// a lattice with other nodes.
    ///
    ///     dynamics.actuate(lattice, material, muscle, std::vector<RestStretch>(muscle.size(), {1, 0.8, 1}));
    void actuate(const Lattice& lattice, const Material& material, std::span<const std::uint32_t> cells,
                 std::span<const RestStretch> stretches);
    /// Other stretches of the same cells, from now on. Throws as actuate() does.
    void set_rest_stretches(std::span<const RestStretch> stretches);

    /// Takes `count` steps. Throws std::invalid_argument for a negative count or damping, a time step that is not
    /// finite and > 0, or an acceleration that is not finite. A step above the critical one is taken, as larger ones
    /// may do where the body is stretched: the motion may then grow without bound, in the end to numbers that are not
    /// finite, and the energies with it.
    void step(const StepParameters& parameters, long count = 1);
    /// The same with what is prescribed on its way: to the bit what single steps with prescribe() and move_obstacles()
    /// after each do, in less time. What the motion throws, and what those two would, ends the motion and is thrown
    /// again after the last step: until then everything stays as it was led before.
    void step(const StepParameters& parameters, long count, const StepMotion& motion);

    /// Whether all displacements and velocities are finite now.
    bool finite() const;
    /// 0 while they are; else the number of steps taken since the body was made, when that was first found out: by a
    /// call of step(), which looks where 64 steps or more have been taken since the last look, or by this and finite(),
    /// which look at once. To set the state starts anew.
    long not_finite_at() const;

    void get_displacements(VectorField<T> out) const;
    void get_velocities(VectorField<T> out) const;
    /// Throw std::invalid_argument where the size differs or a number is not finite, and change nothing then.
    void set_displacements(VectorField<const T> in);
    void set_velocities(VectorField<const T> in);
    /// The motion with every bit, for a body made in the same way to go on from: displacement and velocity in the
    /// plan's own unit of length, which rounding to m would lose; six values a node. After leapfrog steps the velocity
    /// is that of half a step before, and goes on with effect_memory() alone.
    std::vector<T> exact_state() const;
    /// Throws std::invalid_argument unless there are six values a node. Prescribed nodes and loads are to be set anew.
    void set_exact_state(std::span<const T> values);
    /// Sets (not adds) the internal forces at the present displacements.
    void get_forces(VectorField<T> out) const;
    /// Nodal masses, kg, one a node.
    std::span<const double> masses() const;

    /// Sets (not adds) the forces of effects beyond the body's own, gravity, mass damping and loads, at the present
    /// state; zero where there is none. N.
    void get_effect_forces(VectorField<T> out) const;
    /// One entry an effect.
    std::vector<EffectEnergy> effect_energies() const;
    /// What later steps depend on besides exact_state(): numbers for set_effect_memory() of a body with the same
    /// effects, after the state was set. Empty where no effect remembers anything; five more after leapfrog steps.
    std::vector<double> effect_memory() const;
    /// Throws std::invalid_argument for another count of numbers than the effects have.
    void set_effect_memory(std::span<const double> memory);

    PotentialEnergy potential_energy() const;
    double kinetic_energy() const;
    /// A guaranteed lower bound (s) of the largest stable step near rest, with the body's springs damped as they are:
    /// dt in dt^2 omega^2 + 2 dt stiffness_damping omega_s^2 = 4, omega^2 and omega_s^2 bounds of the largest
    /// eigenvalues of M^-1 K with all forces and with the springs alone. Obstacles make it no smaller.
    double critical_time_step() const;
    PlanDescription describe() const;

private:
    template <class U>
    friend class World; // bodies of a world push each other
    template <class U>
    friend class Batch;

    struct HYBMSS_LOCAL Implementation;
    /// The way to it. A batch may have the state among that of others (BatchLayout): whoever asks finds it at home.
    class Home {
    public:
        HYBMSS_LOCAL explicit Home(std::unique_ptr<Implementation> made) : held_(std::move(made)) {}
        HYBMSS_LOCAL Implementation* operator->() const;
        HYBMSS_LOCAL Implementation& operator*() const { return *operator->(); }
        HYBMSS_LOCAL Implementation& wherever() const { return *held_; }

    private:
        std::unique_ptr<Implementation> held_;
    };
    Home implementation_;
};

extern template class ExplicitDynamics<float>;
extern template class ExplicitDynamics<double>;

} // namespace hybmss
