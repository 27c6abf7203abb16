#pragma once

/// \file
/// Runs a scene: holds and moves what it says, steps the body, tells when it has settled, and measures.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/precision.hpp"
#include "hybmss/simulation/accuracy_report.hpp"
#include "hybmss/simulation/scene.hpp"
#include "hybmss/stress.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

struct SimulationOptions {
    Precision precision = Precision::float64;
    PlanOptions plan; ///< instruction set, layout, threads
};

/// Energies in J.
struct Energies {
    double springs = 0, volume = 0, kinetic = 0;
    double removed = 0;  ///< all that left with the cells that were cut away, kinetic and external energy too
    double external = 0; ///< potential of gravity and loads as they are now, zero at rest: -sum (m g + load).u
    std::vector<EffectEnergy> effects; ///< such as "contact": stored, and dissipated since the start
};

/// What a probe reads. Force and torque are those that the support or the moving plate exerts on the body.
struct ProbeReading {
    std::string name;
    std::array<double, 3> force = {0, 0, 0};             ///< N
    std::array<double, 3> torque = {0, 0, 0};            ///< N m, about the region's rest centroid
    std::array<double, 3> mean_displacement = {0, 0, 0}; ///< m, over the region's nodes
    double max_displacement = 0;                         ///< m, largest length over the region's nodes
    std::size_t reaction_nodes = 0;                      ///< of the region's: those that are fixed or moved
    /// Of these, those held by a fix or move of nodes outside the region too, which does not hold all of the region's:
    /// as on an edge that two faces share. Force and torque have its part in them.
    std::size_t shared_reaction_nodes = 0;
};

/// What one [[fix]] or [[move]] exerts on the body, on the axes that it holds alone.
struct SupportReading {
    std::string kind;                         ///< "fix" or "move"
    std::string where;                        ///< as the scene has it
    std::array<double, 3> force = {0, 0, 0};  ///< N
    std::array<double, 3> torque = {0, 0, 0}; ///< N m, about its nodes' centroid where the body begins
    std::size_t nodes = 0;
};

/// How far the body is from rest.
struct Settlement {
    double residual = 0;      ///< largest unbalanced force on a free axis over the largest support force or weight
    double kinetic_ratio = 0; ///< sqrt(kinetic / potential energy): amplitude of the motion over the deformation
    bool settled = false;     ///< both are at most the tolerance, and every prescribed motion has ended
};

/// Cell volumes V' = a . (b x c) against their rest volume, over all cells.
struct VolumeChange {
    double relative_volume_change = 0; ///< |sum V' - sum V| / sum V
    double min_cell_volume_ratio = 1, max_cell_volume_ratio = 1;
};

/// An obstacle at the present state.
struct NamedObstacleReading {
    std::string name;
    ObstacleReading reading;
    double stiffness = 0;               ///< Pa/m: pressure by depth on a flat surface, as given or by default
    std::optional<RigidPose> pose = {}; ///< of a free one
};

/// Works and losses since the start of a run, J: supports + loads + gravity + obstacles = kinetic + free_obstacles +
/// elastic + effects + mass_damping + effects_dissipated, up to the step's own error.
struct EnergyBalance {
    double supports = 0;           ///< work of fixes and moves
    double loads = 0;              ///< work of loads
    double gravity = 0;            ///< its work, on free obstacles too
    double obstacles = 0;          ///< work of obstacles that are led
    double kinetic = 0;            ///< change
    double free_obstacles = 0;     ///< change of their kinetic energy
    double elastic = 0;            ///< change of springs' and volume energy
    double effects = 0;            ///< change of what effects store, as contact does
    double mass_damping = 0;       ///< dissipated
    double effects_dissipated = 0; ///< by friction and the like
    double peak_kinetic = 0;       ///< the largest on the way

    double imbalance() const;          ///< what the two sides differ by
    double relative_imbalance() const; ///< its size over the largest of all parts and the peak
};

/// What the implicit methods have done so far; all zero for an explicit one.
struct SolverWork {
    long newton_iterations = 0, cg_iterations = 0;
    int load_steps = 0, failed_load_steps = 0; ///< static
    std::string preconditioner;
};

/// Of a search for modes or buckling loads.
struct ModesProgress {
    int iteration = 0, found = 0, count = 0;
};

struct Progress {
    long step = 0, steps = 0; ///< taken, and planned at most
    double time = 0;          ///< s
    double wall_seconds = 0;
    Energies energies;
    Settlement settlement;
    std::optional<EquilibriumProgress> solve; ///< of a static solve: it knows nothing of the above but the wall time
    std::optional<ModesProgress> modes;       ///< likewise
};

/// What a run calls back; each may be empty.
struct RunCallbacks {
    std::function<void(const Progress&)> progress; ///< at every check of the state, or iteration of a static solve
    /// Once, near the start: how long all of it may take, s. A static solve tells before it begins, by
    /// Simulation::estimated_seconds(); in time it is told by what the steps took, after a second or, where one takes
    /// longer, the first.
    std::function<void(double seconds)> estimate;
    std::function<void()> output; ///< at time 0, then every `output.every`, and at the end; static: start and end
    /// At every check of the state that the run goes on from, after the output there: the moment to call
    /// write_checkpoint(). false ends the run, which a checkpoint from there continues. Not called by static solves.
    std::function<bool()> checkpoint;
};

/// Of the last state.
struct StressSummary {
    double max_von_mises = 0;            ///< Pa, of a cell
    std::array<double, 3> where{};       ///< m: that cell's middle at rest
    std::array<double, 6> mean_cauchy{}; ///< Pa, over the deformed volume: xx, yy, zz, xy, yz, xz
};

/// How good the springs of a mesh are: see FittedCells.
struct SpringFit {
    double misfit = 0, anisotropy = 0, modulus_error = 0;
    std::size_t without = 0;
};

/// A vibration, or a way to buckle.
struct ModeReading {
    double value = 0; ///< frequency in Hz, below zero where the shape grows; or the factor of loads and moves
    double residual = 0;
    /// m, one a node; the greatest displacement is a tenth of the body's longest edge at rest.
    std::vector<std::array<double, 3>> shape;
};

/// What came of a run.
struct Summary {
    SolverMethod method = SolverMethod::symplectic_euler;
    bool converged = false;
    std::string failure;      ///< why the run stopped early or is no success; "" where all is well
    bool interrupted = false; ///< RunCallbacks::checkpoint ended it
    VolumeChange volume;
    Energies energies;
    std::vector<ProbeReading> probes;
    std::vector<NamedObstacleReading> obstacles;
    std::vector<SupportReading> supports;   ///< fixes, then moves, where the scene asks for reactions
    std::optional<EnergyBalance> balance;   ///< where the scene asks for it
    std::optional<AccuracyReport> accuracy; ///< of solve_to_accuracy()
    std::optional<StressSummary> stress;    ///< where the scene asks for it
    std::optional<SpringFit> fit;           ///< of a mesh
    std::vector<ModeReading> modes;         ///< with the methods "modes" and "buckling", from the lowest on
    int rigid_motions = 0;                  ///< motions of the whole body that cost nothing, left out of the modes
    std::vector<std::string> warnings;      ///< what the results do not show by themselves, a line each
    long steps = 0;
    double time = 0, time_step = 0, critical_time_step = 0; ///< s
    Settlement settlement;
    SolverWork work;
    std::size_t removed_cells = 0; ///< by cuts, in all
    std::size_t parted_faces = 0;  ///< between cells, by tears and by cuts that separate
    /// J: what parting changed of the body's own energy and of its motion's, which rounding alone does.
    double parting_energy = 0;
    double wall_seconds = 0;
    PlanDescription plan;
};

/// One scene in the course of time, or at rest. Not for concurrent use.
class Simulation {
public:
    /// Checks everything that the parser cannot know (empty regions, contradictory supports, the stable time step,
    /// memory). Throws SceneError, or std::invalid_argument for options that the machine or the plan cannot meet.
    explicit Simulation(Scene scene, const SimulationOptions& options = {});
    Simulation(Simulation&&) noexcept;
    Simulation& operator=(Simulation&&) noexcept;
    ~Simulation();

    /// Writes what all later results depend on, bit for bit, to a file that is there whole or not at all: under a
    /// temporary name first. `attached` is kept beside it, as it is. Throws std::runtime_error where it cannot be
    /// written, std::logic_error for a static scene, which has no time to go on from.
    void write_checkpoint(const std::string& path, const std::string& attached = "") const;

    /// The simulation that wrote the checkpoint, as it was then: run() goes on without another output at its start, and
    /// ends with the same bits as one that was never stopped. Precision, layout, instruction set and accuracy are the
    /// checkpoint's; `options` gives the threads. Sets `attached` where it is not null. Throws as the constructor does,
    /// and std::invalid_argument for a checkpoint that is missing, damaged, of another version or of another scene: one
    /// whose text, other than comments and order, or whose files say something else. (Of a scene that was not read from
    /// a text, its cells, time step and duration are compared.)
    static Simulation restarted(Scene scene, const SimulationOptions& options, const std::string& path,
                                std::string* attached = nullptr);

    const Scene& scene() const;
    /// Less the cells that were cut away; nodes are numbered as in the whole one. Throws std::invalid_argument for a
    /// body whose cells are no cubes.
    const Lattice& lattice() const;
    /// The network of such a body, and how good its springs are; null for cubes. It stays as long as the simulation.
    const FittedCells* other_cells() const;
    /// That there are now.
    std::size_t cell_count() const;
    /// All nodes, those too that no cell touches any more.
    std::size_t node_count() const;
    /// m, one a node.
    std::span<const std::array<double, 3>> rest_positions() const;
    /// The cubes that there are now, in grid order: their corner nodes, by the bits of the corner's number.
    std::vector<std::array<std::uint32_t, 8>> cell_nodes() const;
    long steps() const;
    /// s; of a static scene the part of its loading that has been followed, 0 to 1.
    double time() const;
    double time_step() const; ///< s; 0 for a static scene
    /// Of semi-implicit Euler, s: a guaranteed lower bound of the largest stable step near rest.
    double critical_time_step() const;
    /// How long a static scene may take, s, by EquilibriumSolver::estimate_seconds() and its load steps; 0 in time.
    double estimated_seconds() const;
    PlanDescription describe() const;
    /// Nodes held along at least one axis: by fixes, and by moves.
    std::size_t fixed_node_count() const;
    std::size_t moved_node_count() const;
    std::size_t pressed_face_count() const; ///< faces that [[pressure]]s press, as often as they do
    std::size_t actuated_cell_count() const;

    /// Takes `count` steps, whatever the duration says; a static scene goes to its equilibrium. Throws
    /// std::runtime_error where an implicit step or the solve does not converge, and where the state has diverged
    /// (looked at in every fiftieth explicit step): it then is as it came out.
    void step(long count = 1);

    /// Removes cells at once, by their indices in the grid (Lattice::cell_index); those that are empty are passed over.
    /// Loads and probes lose the nodes that no cell touches any more; see ExplicitDynamics::remove_cells. Returns how
    /// many were removed. Throws std::invalid_argument for an index outside the grid, for another method than
    /// symplectic-euler, for a network's layout, and in a scene with an energy balance.
    std::size_t remove_cells(std::span<const std::uint32_t> cells);
    /// By cuts and calls so far.
    std::size_t removed_cell_count() const;
    /// Faces between cells that have parted so far; nodes are numbered anew, and are more, where some do.
    std::size_t parted_face_count() const;
    /// Two cells each (Lattice::cell_index), in the order in which they parted.
    std::span<const std::array<std::uint32_t, 2>> parted_faces() const;

    /// Runs to the duration, or until settled where the scene gives a tolerance; a static scene to equilibrium. Stops
    /// at a state that is not finite, with the last good state restored and Summary::failure set; likewise where an
    /// implicit step or a solve does not converge, with the state that it had.
    Summary run(const RunCallbacks& callbacks = {});

    /// One vector a node, in the body's node order; m and m/s.
    std::vector<std::array<double, 3>> displacements() const;
    std::vector<std::array<double, 3>> velocities() const;
    Energies energies() const;
    std::vector<ProbeReading> probes() const;
    /// What probes read of supports that they share with others, a line each; empty where there are none.
    std::vector<std::string> shared_supports() const;
    /// kg, one a node.
    std::span<const double> masses() const;
    /// N, one a node: the forces of what fixes and moves nodes, zero along free axes.
    std::vector<std::array<double, 3>> reactions() const;
    /// N, one a node: what the obstacles exert, friction too. Zero where there are none.
    std::vector<std::array<double, 3>> contact_forces() const;
    /// One a cell that is left, in the order of cell_nodes().
    std::vector<CellStress> cell_stresses() const;
    std::vector<NamedObstacleReading> obstacles() const;
    /// Where the scene's obstacles are, one pose each.
    std::vector<RigidPose> obstacle_poses() const;
    /// Since the start; where the scene does not ask for it, nothing.
    std::optional<EnergyBalance> energy_balance() const;
    VolumeChange volume_change() const;
    /// The settled test with the scene's tolerance, or 1e-4 where it gives none.
    Settlement settlement() const;

private:
    friend class WorldSimulation; // steps its bodies together

    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

} // namespace hybmss
