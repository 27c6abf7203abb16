#pragma once

/// \file
/// Static equilibrium and implicit steps of a body: minima of its potential energy.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/export.h"

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// How a solve ended.
enum class EquilibriumStatus {
    converged,
    iterations_exhausted, ///< Newton iterations, or load steps
    no_descent,           ///< rounding hides what is left to gain: the tolerance is below what the precision can tell
    unbounded,            ///< the energy falls without end: no equilibrium is near
    inverted,             ///< an equilibrium was found, but cells are inside out that were not so at first
    not_finite,           ///< the start, a load or the energy is infinite or NaN
    stopped               ///< the caller's progress function said so
};

/// "converged", "iterations exhausted", ...
HYBMSS_EXPORT std::string_view name(EquilibriumStatus status);

/// What conjugate gradients are preconditioned with.
enum class PreconditionerKind {
    automatic,    ///< chosen by the body's size and material
    block_jacobi, ///< each node's 3x3 block
    multigrid     ///< lattices only: coarse lattices of 2x2x2 merged cells
};

/// "automatic", "block-jacobi" or "multigrid".
HYBMSS_EXPORT std::string_view name(PreconditionerKind kind);
/// The inverse of name(). Throws std::invalid_argument that lists the known names.
HYBMSS_EXPORT PreconditionerKind parse_preconditioner(std::string_view text);

/// What holds and loads a body.
struct Loading {
    /// Held components and where they are held, as displacements in m from rest; velocities are not used.
    std::vector<PrescribedNode> supports;
    std::vector<std::array<double, 3>> forces;      ///< dead loads, N, one a node; or none at all
    std::array<double, 3> acceleration = {0, 0, 0}; ///< gravity, m/s^2
    std::vector<double> pressures = {};             ///< Pa, one a face of EquilibriumSolver::press(); or none at all
    /// Where the obstacles of EquilibriumSolver::set_obstacles() are, one each; or none: where they were. Velocities
    /// are not used.
    std::vector<RigidPose> obstacles = {};
    /// The sizes at rest of the cells of EquilibriumSolver::actuate(), one each; or none: as they were.
    std::vector<RestStretch> rest_stretches = {};
};

/// Where a solve stands.
struct EquilibriumProgress {
    double load_fraction = 0; ///< of the load step under way
    int load_step = 0, newton_iteration = 0;
    long cg_iterations = 0;
    double residual = 0;  ///< of the Newton iteration's start; 1 while the first answer to a load step is sought
    double potential = 0; ///< J
};

struct EquilibriumOptions {
    /// Bound of the largest unbalanced force on a free component by the largest support force or load.
    double tolerance = 1e-8;
    int newton_iterations = 200; ///< at most, a load step
    int load_steps = 1000;       ///< at most, failed ones included
    double first_load_step = 1;  ///< the fraction of the loading that is tried first, in (0, 1]
    double smallest_load_step = 1e-4;
    /// The longest load step, in (0, 1]: what turns a body by more than about 60 degrees in one step may end at a state
    /// that is turned by as much less a whole turn.
    double largest_load_step = 1;
    PreconditionerKind preconditioner = PreconditionerKind::automatic;
    /// Lattices of even counts of cells along each axis, 8 at least and 4000 cells in all: find the equilibrium of the
    /// body of merged cells first, and of ever coarser ones before, and start from it with the whole loading. What that
    /// does not solve is solved as without. Slender lattices that are "banded" do without.
    bool nested = true;
    /// At the end, look for a direction in which the energy curves downwards (conjugate gradients for random forces),
    /// and where there is one go on to a lower minimum. A symmetric solve may otherwise end at a saddle: no force
    /// points away from it. Costs about a Newton iteration. Slender lattices that are "banded" do so by themselves
    /// where such a direction was met on the way.
    bool leave_saddles = false;
    /// Called at every iteration of Newton's method and of conjugate gradients; false stops the solve. May be empty.
    std::function<bool(const EquilibriumProgress&)> progress;
};

struct EquilibriumResult {
    EquilibriumStatus status = EquilibriumStatus::converged;
    std::string message; ///< why the solve did not converge, in one line; "" where it did
    /// The largest unbalanced force over the largest support force or load, of the state that is returned, under the
    /// part of the loading that load_fraction says.
    double residual = 0;
    double potential = 0;     ///< J: energy of the body less the work of the loads (and what drives an implicit step)
    double load_fraction = 0; ///< the part of the loading that the state is at: 1 where all went well
    int coarser_meshes = 0;   ///< that the solve came by; what follows counts the work on the body itself
    int load_steps = 0, failed_load_steps = 0;
    int newton_iterations = 0;
    long cg_iterations = 0;
    int negative_curvatures = 0; ///< Newton iterations that met a direction in which the energy curves downwards
    double min_cell_volume_ratio = 1, max_cell_volume_ratio = 1; ///< V'/V0 over the cells
    /// The one used last; of slender lattices by default "banded".
    std::string_view preconditioner;
};

/// A small vibration about a state.
struct Mode {
    double eigenvalue = 0; ///< omega^2, 1/s^2; below zero where the state is not stable along the shape
    /// |K x - omega^2 M x| in the norm of M^-1 over omega^2 |x| in that of M, or over a thousandth of the greatest
    /// omega^2 asked for where that is more.
    double residual = 0;
    std::vector<std::array<double, 3>> shape; ///< one a node; the sum of m |x|^2 is 1 kg m^2
    /// omega / 2 pi in Hz; below zero where the shape grows instead, by exp(-omega t).
    HYBMSS_EXPORT double frequency() const;
};

struct ModesOptions {
    int count = 6;           ///< >= 1; fewer where the body has no more
    double tolerance = 1e-6; ///< of the residuals; an eigenvalue is as good as its square
    int iterations = 500;    ///< at most
    PreconditionerKind preconditioner = PreconditionerKind::automatic;
    /// Called at every iteration with its number and how many modes are found; false stops. May be empty.
    std::function<bool(int iteration, int found)> progress = {};
    /// modes() alone: those that act at the state, Pa, one a face of EquilibriumSolver::press(); or none at all.
    std::vector<double> pressures = {};
};

struct ModesResult {
    bool converged = false;
    std::vector<Mode> modes; ///< from the lowest on, those of free motions of the whole body left out
    int rigid_motions = 0;   ///< how many: 6 of a free body at rest
    int iterations = 0;
    long products = 0; ///< of second derivatives with a vector
    std::string_view preconditioner;
};

/// A way in which a body gives way under its loading.
struct BucklingLoad {
    double factor = 0;                        ///< of the loading, above 0: the part of it at which the body gives way
    double residual = 0;                      ///< |K x + factor K_g x| over |K x|, in the norm of M^-1
    std::vector<std::array<double, 3>> shape; ///< one a node; the greatest displacement is 1 m
};

struct BucklingResult {
    bool converged = false;
    std::string message;             ///< why there are none, or not so many, in one line; "" where all is well
    std::vector<BucklingLoad> loads; ///< from the least factor on
    int iterations = 0;
    long products = 0; ///< of second derivatives with a vector
    std::string_view preconditioner;
};

/// Solves a body to equilibrium by Newton's method with conjugate gradients in a trust region. T is float or double:
/// the type of the state; sums are double.
///
/// Nodes are numbered as in the body. Not for concurrent use of one object. Results are bit-identical for any number of
/// threads. Construction throws as ForcePlan does.
template <class T>
class HYBMSS_EXPORT EquilibriumSolver {
public:
    EquilibriumSolver(const Lattice& lattice, const Material& material, const PlanOptions& options = {});
    explicit EquilibriumSolver(const Network& network, const PlanOptions& options = {});
    EquilibriumSolver(EquilibriumSolver&&) noexcept;
    EquilibriumSolver& operator=(EquilibriumSolver&&) noexcept;
    ~EquilibriumSolver();

    std::size_t node_count() const;
    /// Nodal masses, kg, one a node.
    std::span<const double> masses() const;

    /// Replaces the faces that Loading::pressures press, as ExplicitDynamics::press does; none before the first call.
    /// Pressure has a potential where the pressed faces of one pressure close, or where each edge that they end at is
    /// held: both its nodes along all axes, or along one, in one plane at right angles to it that is the same for all
    /// such edges of the axis. With others, solve(), follow() and step() throw std::invalid_argument. With pressed
    /// faces no coarser mesh is solved first. `pressures`: those of get_effect_forces() until the next solve; or none.
    void press(std::span<const SurfaceFace> faces, std::span<const double> pressures = {});

    /// Replaces the obstacles and the nodes that may touch them, as ExplicitDynamics::set_obstacles does; none before
    /// the first call. Contact is the spring that it is in steps in time: where a node is held by an obstacle and what
    /// it is pressed by are balanced to the tolerance, and none lies deeper than the force on it says. Nodes touch on
    /// the side that is nearest: obstacles come to a body along a path of load steps, not through it. With obstacles no
    /// coarser mesh is solved first. Throws std::invalid_argument for friction, which has no potential.
    void set_obstacles(std::span<const SurfaceNode> surface, std::span<const Obstacle> obstacles);
    /// Replaces the cells that Loading::rest_stretches gives another size at rest, as ExplicitDynamics::actuate does;
    /// none before the first call, and all as they were made after it. solve() goes there in proportion. With such
    /// cells no coarser mesh is solved first. Throws std::invalid_argument as that does, and for a network.
    void actuate(std::span<const std::uint32_t> cells);
    /// What obstacles, where they are, and the body do to each other at displacements of the caller, one an obstacle:
    /// depths are present ones, impulses zero.
    std::vector<ObstacleReading> obstacle_readings(VectorField<const T> displacement);

    /// From the displacements given (m, node_count() nodes) to equilibrium under the loading. Supports move on straight
    /// lines from where they are and loads grow in proportion, in one step where that works, else in several.
    ///
    /// Obstacles stand at the loading's places from the start.
    ///
    /// On return `displacement` holds the equilibrium; where none was found, the last one on the way to it; where there
    /// is none of those either, the first attempt's state, if it is only not balanced well enough, else the start.
    /// Throws std::invalid_argument for a size that differs, fields that share memory or have none, a node that does
    /// not exist or is held twice along an axis, a value that is not finite in T, options out of range, and for
    /// multigrid asked of a network.
    EquilibriumResult solve(const Loading& loading, VectorField<T> displacement,
                            const EquilibriumOptions& options = {});

    /// The same along a path: loading(fraction) is asked for fractions in (0, 1] and must be continuous.
    EquilibriumResult follow(const std::function<Loading(double fraction)>& path, VectorField<T> displacement,
                             const EquilibriumOptions& options = {});

    /// One backward Euler step: u <- u + dt v_new, m (v_new - v)/dt = f(u_new) + loads - c m v_new, as the minimum of
    /// one potential; stable for any dt. Held components end at their prescribed displacements, with the velocity of
    /// the way there. `time_step` in s, > 0; `mass_damping` c in 1/s, >= 0. Load steps are not used.
    EquilibriumResult step(const Loading& loading, double time_step, double mass_damping, VectorField<T> displacement,
                           VectorField<T> velocity, const EquilibriumOptions& options = {});

    /// The lowest vibrations about the displacements (m), which should be an equilibrium, while the components named by
    /// `supports` stay where they are; dead loads and obstacles have no part in it, pressures that are given have. In
    /// double to any tolerance that makes sense; in float residuals below a thousandth are not to be had. Throws as
    /// solve() does.
    ModesResult modes(std::span<const PrescribedNode> supports, VectorField<const T> displacement,
                      const ModesOptions& options = {});

    /// The least factors of a loading at which the body at rest gives way, by linear theory: K x = -factor K_g x, with
    /// the stiffness K at rest and its change K_g with the loading, by differences of K between the equilibria under a
    /// small part of the loading and under its reverse. Supports that move and pressures are parts of the loading too.
    /// What deforms much before it gives way does so elsewhere: modes() of the loaded body tell. A body that is free to
    /// move as a whole has none. Throws as solve() does, and std::invalid_argument in float, where such differences
    /// are lost.
    BucklingResult buckling(const Loading& loading, const ModesOptions& options = {});

    /// What a later solve takes over from those before it, all that a solver remembers: where multigrid last ended its
    /// estimate of a spectrum. Three values a node, or none. With it, another solver made in the same way goes on with
    /// the same bits.
    std::vector<T> memory() const;
    /// Throws std::invalid_argument unless there are three values a node, or none.
    void set_memory(std::span<const T> values);
    /// Damps all springs along themselves in step() from now on, as ExplicitDynamics::damp_springs does; taken at the
    /// new velocity, with the springs' directions before the step: the damping stays convex, unconditionally stable,
    /// and keeps linear momentum; angular momentum up to the turn of a spring in a step. No part of solve() and
    /// follow().
    void damp_springs(double stiffness_damping);
    /// What the damped springs, the pressures, cells of another size and contact with obstacles have of energy: an
    /// entry each, as far as there are any. Pressures store p (V - V at rest), contact what its springs do, at the last
    /// state that was found.
    std::vector<EffectEnergy> effect_energies() const;
    /// What they count up from step to step, to go on with in a solver that is damped too. Throws
    /// std::invalid_argument for another count than effect_memory() gives.
    std::vector<double> effect_memory() const;
    void set_effect_memory(std::span<const double> memory);
    /// Sets (not adds) the forces of damped springs, and of the last solve's pressures, sizes and obstacles, N, at
    /// displacements and velocities of the caller.
    void get_effect_forces(VectorField<const T> displacement, VectorField<const T> velocity, VectorField<T> force);

    /// Sets (not adds) the internal forces, N, and gives the energy, J, at displacements of the caller.
    PotentialEnergy get_forces(VectorField<const T> displacement, VectorField<T> force);
    PlanDescription describe() const;
    /// How long one solve in one load step may take, s: by a rule for the number of Hessian products, and the time of
    /// one, measured now. Right to a factor of some three where nothing buckles.
    double estimate_seconds();

private:
    struct HYBMSS_LOCAL Implementation;
    std::unique_ptr<Implementation> implementation_;
};

extern template class EquilibriumSolver<float>;
extern template class EquilibriumSolver<double>;

} // namespace hybmss
