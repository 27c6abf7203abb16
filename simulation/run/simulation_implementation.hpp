#pragma once

/// \file
/// What a Simulation holds: the scene made concrete for one body.

#include "hybmss/separation.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "plan/bodies/critical_time_step.hpp"
#include "simulation/run/any_dynamics.hpp"
#include "simulation/run/boundary_conditions.hpp"
#include "simulation/run/cutting.hpp"
#include "simulation/run/energy_meter.hpp"
#include "simulation/run/readings.hpp"
#include "simulation/scene/other_cells.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hybmss {

/// The scene's probes. Throws SceneError where a region is empty.
std::vector<ProbeNodes> probes_of(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> turned,
                                  const Supports& supports);

struct Simulation::Implementation {
    Scene scene;
    SimulationOptions options;
    /// A lattice that may part, as the network that it is from the start.
    struct Parted {
        SeparatedNetwork body;
        std::vector<std::array<std::uint32_t, 2>> faces; ///< in the order in which they parted
        double energy = 0;                               ///< J, see Summary::parting_energy
    };
    std::optional<FittedCells>
        other;       ///< where cells are no cubes; the lattice is one cell then, and stands for nothing
    Lattice lattice; ///< less what was cut away
    std::optional<Parted> parted;
    std::vector<Vector3> rest, turned; ///< m, one a node; the latter initial_displacements()
    Supports supports;
    std::vector<ProbeNodes> probes;
    double tables_end;               ///< s: from then on loads and gravity are constant
    std::vector<LoadedNodes> loaded; ///< where loads change; else none
    std::vector<Vector3> loads;      ///< N, one a node, at present; empty where the scene has none
    PressedFaces pressed;
    ActuatedCells actuated;
    Vector3 gravity; ///< m/s^2, at present
    FrequencyBounds frequencies;
    Obstacles obstacles;
    AnyDynamics dynamics;
    double critical_time_step; ///< s: with the damping of the springs too
    double time_step;          ///< 0 where there is no time
    long cut_step;             ///< the one that is cut to end at the duration; the greatest number: none
    long steps = 0;
    double load_fraction = 0;   ///< static: the part of the loading that the state is at
    double solved_residual = 0; ///< static: of the state
    bool solved = false;
    std::vector<ModeReading> modes; ///< found by solve()
    int rigid_motions = 0;          ///< likewise
    SolverWork work;
    CutSchedule schedule;
    /// In place of the dynamics' own remove_cells(), where another has to know of it.
    std::function<void(Lattice&, std::span<const std::uint32_t>)> remove_from_dynamics;
    std::vector<BodyCell> cells; ///< of the whole body; from the first cut on
    struct RemovedCell {
        std::uint32_t cell;
        float scale;
    };
    std::vector<RemovedCell> removed;
    /// How far the cuts are.
    struct CutsDone {
        std::size_t removed = 0; ///< cells
        double energy = 0;       ///< J
        std::vector<double> bites;
    };
    double removed_energy = 0;        ///< J
    std::optional<EnergyMeter> meter; ///< where the scene asks for it
    // Of the run at hand, so that a checkpoint can continue it.
    long outputs = 0;       ///< made so far
    long written = -1;      ///< the step of the last one
    bool continued = false; ///< the next run goes on with these

    Implementation(Scene given, const SimulationOptions& wanted);

    const Network* network() const { return other ? &other->network : parted ? &parted->body.network : nullptr; }
    /// Nothing for a body that does not part. Throws SceneError for a scene that cannot.
    static std::optional<Parted> make_parted(const Scene& scene, const Lattice& lattice);
    static Parted parted_at(std::vector<std::array<std::uint32_t, 2>> faces, const Scene& scene,
                            const Lattice& lattice);
    /// Makes it be the body with these faces parted, all else anew as the scene says it, at rest.
    void part(std::vector<std::array<std::uint32_t, 2>> faces, const SimulationOptions& with);
    /// Parts these faces besides, in the motion that the body has.
    void part_more(std::span<const std::array<std::uint32_t, 2>> faces);
    /// What tears now.
    void tear_now();
    /// The step after which tears are looked for next; the greatest number: never.
    long next_look() const;
    /// Of cuts that separate, all faces that hold still and that these reach.
    std::vector<std::array<std::uint32_t, 2>> faces_in_tools(std::span<const std::size_t> cuts) const;
    AnyDynamics make_dynamics(const SimulationOptions& with) const;
    bool is_static() const { return timeless(scene.solver.method); }
    double time_after(long step) const {
        return step < cut_step ? static_cast<double>(step) * time_step
                               : scene.solver.duration + static_cast<double>(step - cut_step) * time_step;
    }
    double time() const { return is_static() ? load_fraction : time_after(steps); }
    /// How much of gravity and loads is there.
    double loaded_part() const { return is_static() ? load_fraction : 1; }
    double end_of_motion() const { return std::max(supports.end_of_motion(), obstacles.end_of_motion()); }
    bool moving() const { return is_static() ? load_fraction < 1 : time() < end_of_motion(); }
    /// The step in time after which nothing is led any more.
    long last_step_of_motion() const;
    double body_volume() const;
    /// Of the cells that there are now.
    std::vector<std::array<std::uint32_t, 8>> cell_nodes() const;

    /// action(dynamics) where they are explicit.
    template <class Action>
    void on_explicit(const Action& action) {
        if (auto* single = std::get_if<ExplicitDynamics<float>>(&dynamics)) {
            action(*single);
        } else if (auto* in_double = std::get_if<ExplicitDynamics<double>>(&dynamics)) {
            action(*in_double);
        }
    }
    /// What action(dynamics) returns, where they are implicit.
    template <class Action>
    auto on_implicit(const Action& action) {
        if (auto* single = std::get_if<ImplicitDynamics<float>>(&dynamics)) {
            return action(*single);
        }
        return action(std::get<ImplicitDynamics<double>>(dynamics));
    }
    /// Holds and leads nodes and obstacles as it is at the present time.
    void prescribe();
    void set_obstacles();
    void apply_loads();
    /// With the pressures of the present time.
    void press();
    /// With the sizes of the present time.
    void actuate();
    /// Of which pressures and sizes are at present.
    double time_of_pressures() const { return is_static() ? std::numeric_limits<double>::infinity() : time(); }
    bool has_tables() const { return !is_static() && tables_end > -std::numeric_limits<double>::infinity(); }
    /// Spreads loads over the whole body, by their values at the start; of a static scene at the end.
    void spread_loads();
    /// Sets loads and gravity to what tables say of a time.
    void load_as_at(double time);

    /// Whether something prescribed is still to come within the duration.
    bool changing() const;
    CutsDone cuts_done() const { return {removed.size(), removed_energy, schedule.done()}; }
    /// Removes the cells that are there still. Returns how many that were.
    std::size_t cut(std::span<const std::uint32_t> cells);
    /// Cuts what is due now.
    void cut_now();
    /// The lattice, loads and probes as they were before any cut; the dynamics are to be made anew then, and to be cut
    /// again: as many of the cells as `done` says, or those that are listed.
    void uncut();
    void cut_again(const CutsDone& done);
    void cut_again(std::span<const std::uint32_t> cells);
    /// What all cells were before any cut, as a checkpoint compares it.
    std::uint64_t scene_digest() const;
    void apply_damping();
    StepParameters step_parameters() const;
    /// How many steps may be taken at once from here, up to the step `end`; what acts in them; and what follows them.
    long stretch(long end) const;
    StepMotion begin_stretch();
    void end_stretch(long taken);
    /// Takes steps in time. Returns why an implicit one did not converge, with the state before it kept; or "".
    std::string step(long count);
    /// Goes to equilibrium under the whole loading.
    /// Returns why there is none, with the last state on the way kept; or "".
    std::string solve(const RunCallbacks& callbacks);
    double estimated_seconds() const;
    struct State {
        std::vector<Vector3> displacements, velocities;
        std::vector<double> effect_memory;
        long steps;
        CutsDone cuts;
        std::vector<std::array<std::uint32_t, 2>> faces;
        double parting_energy;
    };
    State present() const;
    /// Starts afresh from a known state: nothing of what the dynamics hold inside may outlive values that are not
    /// finite.
    void restore(const State& state);

    Energies energies() const;
    static const Energies& total(const Energies& energies) { return energies; }
    Settlement settlement(const Energies& energies) const;
    /// How often the state is looked at: a look costs about three explicit steps, so that looks take some 6 % of a run;
    /// an implicit step costs far more.
    long steps_between_checks() const;
    /// Why the state is no good, or "". Potential energy alone is bounded: a free fall may be fast. The bound is the
    /// energy at a stretch of about a hundred.
    std::string blow_up(const Energies& energies) const;
    std::vector<ProbeReading> read_probes() const;
    std::vector<Vector3> reactions() const;
    std::vector<SupportReading> support_readings() const;
    std::vector<CellStress> cell_stresses() const;
    StressSummary stress_summary() const;
    std::span<const double> masses() const;
    std::vector<NamedObstacleReading> read_obstacles() const;
    /// Of those that are led as the scene says, of free ones as the motion has them.
    std::vector<RigidPose> obstacle_poses() const;
    MeteredState metered_state() const;
    Summary summary(std::string failure) const;

private:
    std::string implicit_step();
    std::string find_equilibrium(const RunCallbacks& callbacks);
    std::string find_modes(const RunCallbacks& callbacks);
    /// Of a scene without time: what holds and loads the body at a part of the loading.
    Loading loading_at(double part);
    /// Whether anything moves or loads it.
    bool anything_acts() const;
    /// Throws SceneError where the body lies deep in an obstacle already.
    void check_start() const;
    std::vector<std::string> warnings(std::span<const NamedObstacleReading> readings) const;
    /// A line where the mesh is coarse for how the body is bent now, or "".
    std::string coarseness() const;
    EquilibriumOptions equilibrium_options() const;
    void add_work(const EquilibriumResult& result);
    void list_cells();
    /// J of a cell with its shares of springs and masses, in the present motion.
    double energy_of(const BodyCell& cell, std::span<const Vector3> displacements,
                     std::span<const Vector3> velocities) const;
    NodalForces nodal_forces(std::span<const Vector3> internal) const;
    double external_energy(std::span<const Vector3> displacements) const;
    double stored_in_effects() const;
};

} // namespace hybmss
