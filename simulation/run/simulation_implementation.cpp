#include "simulation/run/simulation_implementation.hpp"

#include "hybmss/skin.hpp"

#include "layouts/messages.hpp"
#include "plan/bodies/layout_table.hpp"
#include "simulation/run/memory.hpp"
#include "simulation/scene/scene_body.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace hybmss {
namespace {

// Stiffness grows where a body is compressed; the margin keeps the step stable there.
constexpr double kTimeStepFraction = 0.7;
// An implicit step may be any length; this one still follows the slow motions well.
constexpr double kImplicitTimeSteps = 20;

/// Sets the size that cells of a mesh have by its nodes.
std::optional<FittedCells> make_other_cells(Scene& scene, const SimulationOptions& options) {
    if (scene.body.shape == SceneCells::cubes) {
        return std::nullopt;
    }
    check_size(scene, options, available_bytes());
    std::optional<FittedCells> made = other_cells(scene);
    if (scene.body.shape == SceneCells::mesh) {
        scene.body.cell_size = edge_of_mesh(scene.body.cell_mesh);
    }
    return made;
}

Lattice make_lattice(const Scene& scene, const SimulationOptions& options) {
    if (scene.body.shape != SceneCells::cubes) {
        return Lattice::box(1, 1, 1, scene.body.cell_size);
    }
    if (scene.body.size[0] > 0 && scene.body.cell_size == 0) {
        throw scene_error(scene, "body.size", "its mesh is free; solve_to_accuracy() chooses one");
    }
    check_size(scene, options, available_bytes());
    return scene_lattice(scene);
}

// Springs that stiffen are stiffer where they are strained: the step is chosen for strains up to this.
constexpr double kStrainInReach = 0.5;

/// Implicit steps may be of any length: they are the longest up to the one wanted with which outputs land on their
/// times.
double up_to_outputs(const Scene& scene, double step) {
    const double every = scene.output.every.value_or(scene.solver.duration);
    if (scene.solver.method != SolverMethod::backward_euler || every >= scene.solver.duration) {
        return step;
    }
    const double steps = std::ceil(every / step * (1 - 1e-12));
    return std::abs(steps * step - every) <= 1e-12 * every ? step : every / steps;
}

std::vector<Vector3> rest_of(const Network* network, const Lattice& lattice, const Vector3& origin) {
    return network ? network->rest_positions : rest_positions(lattice, origin);
}

FrequencyBounds frequencies_of(const Scene& scene, const std::optional<FittedCells>& other, const Lattice& lattice) {
    if (other) {
        return network_frequencies(other->network);
    }
    FrequencyBounds bounds = lattice_frequencies(lattice, scene.material);
    const double stiffening = stiffening_by_actuation(scene);
    bounds.body *= stiffening;
    bounds.crushed *= stiffening;
    return bounds;
}

/// What branches of relaxation add to the bound of omega^2, as StressRelaxation::narrow() does.
double relaxing(const Scene& scene, const FrequencyBounds& frequencies) {
    double parts = 0;
    for (const Relaxation& branch : scene.relaxation) {
        parts += branch.part;
    }
    return parts * frequencies.body;
}

/// A given step is held against the critical one at rest, for a motion may well be small.
double choose_time_step(const Scene& scene, const FrequencyBounds& frequencies) {
    if (timeless(scene.solver.method)) {
        return 0;
    }
    const bool small_steps = explicit_in_time(scene.solver.method);
    const double critical = frequencies.critical_time_step(scene.damping.stiffness, relaxing(scene, frequencies));
    const double further = relaxing(scene, frequencies) +
                           (largest_stiffening(scene.material.stiffening, kStrainInReach) - 1) * frequencies.springs +
                           frequencies.crushed;
    const double followed = small_steps ? frequencies.critical_time_step(scene.damping.stiffness, further)
                                        : kImplicitTimeSteps * frequencies.critical_time_step();
    const double step = up_to_outputs(scene, scene.solver.time_step.value_or(kTimeStepFraction * followed));
    if (small_steps && step > critical) {
        throw scene_error(scene, "solver.time_step",
                          printed("above the stable time step; it must be above 0 and at most %.6g s (method = "
                                  "\"backward-euler\" takes any)",
                                  critical));
    }
    if (scene.solver.duration / step > 1e15) {
        throw scene_error(
            scene, "solver.duration",
            printed("it takes more than 1e15 steps, which are the most that are allowed, of %.6g s", step));
    }
    return step;
}

/// The last step of backward Euler, where it is cut to end at the duration.
long step_to_cut(const Scene& scene, double step) {
    const double steps = std::ceil(scene.solver.duration / step * (1 - 1e-12));
    const bool cut = scene.solver.method == SolverMethod::backward_euler &&
                     std::abs(steps * step - scene.solver.duration) > 1e-12 * scene.solver.duration;
    return cut ? static_cast<long>(steps) : std::numeric_limits<long>::max();
}

void check_cuts(const Scene& scene, const AnyDynamics& dynamics) {
    if (scene.cuts.empty()) {
        return;
    }
    if (!explicit_in_time(scene.solver.method)) {
        throw scene_error(
            scene, "cut[0].at",
            "cells are cut only while a body moves by symplectic-euler or leapfrog, not with method = \"" +
                std::string(name(scene.solver.method)) + "\"");
    }
    if (scene.output.energy_balance) {
        throw scene_error(scene, "output.energy_balance",
                          "a scene with it cannot be cut: the energy of what is removed is not in the balance");
    }
    if (scene.cuts[0].separates) {
        return; // which has been looked at
    }
    const bool can = std::visit(
        [](const auto& d) {
            if constexpr (requires { d.can_remove_cells(); }) {
                return d.can_remove_cells();
            } else {
                return false;
            }
        },
        dynamics);
    if (!can) {
        const std::string layout = std::visit([](const auto& d) { return d.describe().layout; }, dynamics);
        throw scene_error(scene, "cut[0].at",
                          "the layout " + layout + " cannot be cut; " + layouts_that_can_be_cut() + " can");
    }
}

/// What a Newton solve may leave unbalanced, where the scene does not say.
double default_tolerance(Precision precision) {
    return precision == Precision::float32 ? 1e-4 : 1e-8;
}

/// A load step turns no part of a body by more, against another or against the rest of the world. Beyond half a turn
/// the way there and the way back look alike.
constexpr double kTurnOfALoadStep = 60; // degrees

/// Steps in which the moves turn by so much at most; 1 where they do not turn.
double steps_to_turn(std::span<const Move> moves) {
    double low[3] = {}, high[3] = {}, most = 0;
    for (const Move& move : moves) {
        if (const Rotation* const rotation = std::get_if<Rotation>(&move.motion)) {
            const auto axis = static_cast<std::size_t>(rotation->axis);
            low[axis] = std::min(low[axis], rotation->degrees);
            high[axis] = std::max(high[axis], rotation->degrees);
            most = std::max(most, high[axis] - low[axis]);
        }
    }
    return std::max(std::ceil(most / kTurnOfALoadStep), 1.0);
}

/// Why a solve failed, and what the scene may do about it.
std::string explained(const EquilibriumResult& result, const Scene& scene) {
    std::string why = result.message;
    if (volume_modulus(scene.material) < 0 && scene.material.volume_energy == VolumeEnergy::quadratic) {
        why += "; volume_energy = \"quadratic\" has no lower bound in tension at a poisson_ratio below 0.25: "
               "\"mean_stretch\" has";
    }
    return why;
}

} // namespace

std::vector<ProbeNodes> probes_of(const Scene& scene, std::span<const Vector3> rest, std::span<const Vector3> turned,
                                  const Supports& supports) {
    const std::vector<Vector3> begin = positions(rest, turned);
    std::vector<ProbeNodes> probes;
    for (std::size_t p = 0; p < scene.probes.size(); ++p) {
        ProbeNodes& probe = probes.emplace_back();
        probe.name = scene.probes[p].name;
        probe.nodes = nodes_of(scene, rest, scene.probes[p].where, "probe[" + std::to_string(p) + "].where");
        probe.centroid = rest_centroid(begin, probe.nodes);
        const SharedSupports shared = supports.shared(scene, rest, probe.nodes);
        probe.reaction_nodes = shared.held;
        probe.shared_reaction_nodes = shared.shared;
        if (shared.shared > 0) {
            const std::string where = where_text(scene, "probe[" + std::to_string(p) + "].where");
            probe.shared =
                printed("probe %s, where = %s: %zu of its %zu held nodes are held by others of %s too, whose "
                        "forces there it reads; where = {of = %s, without = [%s]} leaves these nodes out",
                        probe.name.c_str(), where.c_str(), shared.shared, shared.held, shared.by.c_str(), where.c_str(),
                        shared.by.c_str());
        }
    }
    return probes;
}

Simulation::Implementation::Implementation(Scene given, const SimulationOptions& wanted)
    : scene(within_ranges(std::move(given))), options(wanted), other(make_other_cells(scene, options)),
      lattice(make_lattice(scene, options)), parted(make_parted(scene, lattice)),
      rest(rest_of(network(), lattice, scene.body.origin)), turned(initial_displacements(scene, rest)),
      supports(scene, rest, turned), probes(probes_of(scene, rest, turned, supports)), tables_end(end_of_tables(scene)),
      pressed(pressed_faces(scene, lattice, supports)), actuated(actuated_cells(scene, lattice)),
      frequencies(frequencies_of(scene, other, lattice)), obstacles(scene, frequencies.critical_time_step()),
      dynamics(make_dynamics(options)),
      critical_time_step(frequencies.critical_time_step(scene.damping.stiffness, relaxing(scene, frequencies))),
      time_step(choose_time_step(scene, frequencies)), cut_step(step_to_cut(scene, time_step)),
      schedule(scene.cuts, time_step) {
    check_cuts(scene, dynamics);
    obstacles.set_time_step(time_step);
    apply_damping();
    spread_loads();
    apply_loads();
    set_obstacles();
    press();
    actuate();
    if (scene.output.stress && !scene.actuations.empty()) {
        throw scene_error(scene, "output.stress",
                          "stresses are those of cells as they were made: not of a scene with [[actuate]]");
    }
    if (options.precision == Precision::float32 && is_static() &&
        scene.solver.method != SolverMethod::static_equilibrium) {
        throw scene_error(scene, "solver.method", "modes and buckling loads are found in --precision double alone");
    }
    if (!scene.starts.empty()) {
        if (is_static()) {
            throw scene_error(scene, "solver.method",
                              "a scene with [[start]] must be solved in time: an equilibrium has no velocities");
        }
    }
    if (!scene.starts.empty() || !turned.empty()) {
        set_state(dynamics, turned.empty() ? displacements_of(dynamics) : turned,
                  start_velocities(scene, rest, positions(rest, turned), masses(), supports));
    }
    prescribe();
    check_start();
    if (scene.output.energy_balance) {
        if (!explicit_in_time(scene.solver.method)) {
            throw scene_error(scene, "output.energy_balance",
                              "a scene with it must be solved by \"symplectic-euler\" or \"leapfrog\": the other "
                              "methods do not keep energy, or have no time");
        }
        meter.emplace(EnergyMeter::Constants(step_parameters(), masses(), has_tables()), metered_state(),
                      velocities_of(dynamics));
    }
}

AnyDynamics Simulation::Implementation::make_dynamics(const SimulationOptions& with) const {
    return network() ? hybmss::make_dynamics(*network(), scene.solver.method, with)
                     : hybmss::make_dynamics(lattice, scene.material, scene.solver.method, with);
}

StepParameters Simulation::Implementation::step_parameters() const {
    const bool leapfrog = scene.solver.method == SolverMethod::leapfrog;
    return {time_step, gravity, scene.damping.mass, leapfrog ? Integrator::leapfrog : Integrator::symplectic_euler};
}

void Simulation::Implementation::set_obstacles() {
    if (!obstacles.empty() && scene.body.skin_touches) {
        bool moves = false;
        on_explicit([&](auto& d) {
            const TriangleMesh mesh =
                scene.body.mesh.triangles.empty() ? smooth_boundary_mesh(lattice) : scene.body.mesh;
            d.set_skin_obstacles(skin_points(lattice, mesh, scene.body.origin), obstacles.at_start());
            moves = true;
        });
        if (!moves) {
            throw scene_error(scene, "body.contact",
                              "a skin touches obstacles in motions by symplectic-euler or leapfrog; others take nodes");
        }
    } else if (!obstacles.empty()) {
        const std::vector<SurfaceNode> surface =
            network() ? surface_nodes(*network()) : surface_nodes(lattice, scene.body.origin);
        std::visit([&](auto& d) { d.set_obstacles(surface, obstacles.at_start()); }, dynamics);
    }
}

void Simulation::Implementation::check_start() const {
    const std::vector<NamedObstacleReading> readings = read_obstacles();
    for (std::size_t o = 0; o < readings.size(); ++o) {
        if (const ObstacleReading& reading = readings[o].reading; reading.depth > scene.body.cell_size) {
            throw scene_error(
                scene, "obstacle[" + std::to_string(o) + "]." + std::string(shape_key(scene.obstacles[o].shape)),
                printed("%zu nodes of the body lie in it at the start, up to %.3g m deep; at most a cell, "
                        "%.3g m, is allowed",
                        reading.nodes, reading.depth, scene.body.cell_size));
        }
    }
}

void Simulation::Implementation::spread_loads() {
    const double time = is_static() ? std::numeric_limits<double>::infinity() : 0;
    gravity = value_at(scene.gravity.acceleration, scene.gravity.acceleration_in_time, time);
    loaded = loaded_nodes(scene, lattice, rest, network(),
                          parted ? std::span<const std::array<std::uint32_t, 8>>(parted->body.corners)
                                 : std::span<const std::array<std::uint32_t, 8>>());
    loads = nodal_loads(scene, loaded, rest.size(), time);
    if (is_static() || std::all_of(scene.loads.begin(), scene.loads.end(),
                                   [](const Load& load) { return load.force_in_time.empty(); })) {
        loaded = {};
    }
}

void Simulation::Implementation::load_as_at(double time) {
    gravity = value_at(scene.gravity.acceleration, scene.gravity.acceleration_in_time, time);
    if (pressed.changing(scene)) {
        on_explicit([&](auto& d) { d.set_pressures(pressed.at(scene, time)); });
    }
    if (actuated.changing(scene)) {
        on_explicit([&](auto& d) { d.set_rest_stretches(actuated.at(scene, time)); });
    }
    if (loaded.empty()) {
        return;
    }
    set_nodal_loads(scene, loaded, time, loads);
    const std::span<const double> mass = masses();
    for (const LoadedNodes& load : loaded) {
        for (const std::uint32_t n : load.nodes) {
            loads[n] = mass[n] > 0 ? loads[n] : Vector3{0, 0, 0};
        }
    }
    apply_loads();
}

void Simulation::Implementation::prescribe() {
    if (has_tables()) {
        load_as_at(time());
    }
    const std::span<const PrescribedNode> nodes = is_static() ? supports.at_part(load_fraction) : supports.at(time());
    const std::span<const RigidPose> poses = obstacles.at(time());
    on_explicit([&](auto& d) {
        d.prescribe(nodes);
        if (!obstacles.empty()) {
            d.move_obstacles(poses);
        }
    });
}

void Simulation::Implementation::apply_loads() {
    std::vector<NodalLoad> nodal;
    for (std::size_t n = 0; n < loads.size(); ++n) {
        if (loads[n] != Vector3{0, 0, 0}) {
            nodal.push_back({static_cast<std::uint32_t>(n), loads[n]});
        }
    }
    on_explicit([&](auto& d) { d.load(nodal); });
}

void Simulation::Implementation::press() {
    if (!pressed.faces.empty()) {
        const std::vector<double> pressures = pressed.at(scene, time_of_pressures());
        std::visit([&](auto& d) { d.press(pressed.faces, pressures); }, dynamics);
    }
}

void Simulation::Implementation::actuate() {
    if (actuated.cells.empty()) {
        return;
    }
    if (explicit_in_time(scene.solver.method)) {
        const std::vector<RestStretch> stretches = actuated.at(scene, time());
        on_explicit([&](auto& d) { d.actuate(lattice, scene.material, actuated.cells, stretches); });
    } else {
        on_implicit([&](auto& d) { d.actuate(actuated.cells); });
    }
}

void Simulation::Implementation::apply_damping() {
    if (!is_static()) {
        std::visit([&](auto& d) { d.damp_springs(scene.damping.stiffness); }, dynamics);
    }
    if (!scene.relaxation.empty()) {
        if (scene.solver.method == SolverMethod::backward_euler) {
            throw scene_error(scene, "material.relaxation",
                              "a material with it moves by symplectic-euler or leapfrog; what takes no time knows its "
                              "slow moduli alone");
        }
        on_explicit([&](auto& d) { d.relax(lattice, scene.material, scene.relaxation); });
    }
}

long Simulation::Implementation::last_step_of_motion() const {
    const double end = end_of_motion();
    auto last = static_cast<long>(std::min(std::ceil(end / time_step), 1e17));
    // Up to rounding: the first step that comes to the end by the times that steps have.
    while (last > 0 && !(time_after(last - 1) < end)) {
        --last;
    }
    while (time_after(last) < end && last < static_cast<long>(1e17)) {
        ++last;
    }
    return last;
}

std::string Simulation::Implementation::step(long count) {
    if (scene.solver.method == SolverMethod::backward_euler) {
        std::string failure;
        for (; count > 0 && failure.empty(); --count) {
            failure = implicit_step();
        }
        return failure;
    }
    cut_now();
    for (const long end = steps + count; steps < end;) {
        const long taken = stretch(end);
        const StepMotion motion = begin_stretch();
        on_explicit([&](auto& d) { d.step(step_parameters(), taken, motion); });
        end_stretch(taken);
    }
    return "";
}

long Simulation::Implementation::stretch(long end) const {
    if (meter || time() < tables_end) {
        return 1;
    }
    const long next = std::min({end, schedule.next_step(), next_look()});
    return (moving() ? std::min(next, last_step_of_motion()) : next) - steps;
}

StepMotion Simulation::Implementation::begin_stretch() {
    if (time() < tables_end && scene.solver.method == SolverMethod::leapfrog) {
        load_as_at(time() + time_step / 2); // what acts in a step is constant: its mean, to the second order
    }
    // Plates are set after each step, so that every force is taken with all nodes at the same time.
    StepMotion motion;
    if (moving()) {
        motion.nodes = [this](long step) { return supports.at(time_after(steps + step)); };
        if (!obstacles.empty()) {
            motion.obstacles = [this](long step) { return obstacles.at(time_after(steps + step)); };
        }
    }
    return motion;
}

void Simulation::Implementation::end_stretch(long taken) {
    const bool by_tables = time() < tables_end;
    steps += taken;
    if (by_tables) {
        load_as_at(time());
    }
    if (meter) {
        meter->record(metered_state());
    }
    cut_now();
    tear_now();
}

Simulation::Implementation::State Simulation::Implementation::present() const {
    return {displacements_of(dynamics),
            velocities_of(dynamics),
            effect_memory_of(dynamics),
            steps,
            cuts_done(),
            parted ? parted->faces : std::vector<std::array<std::uint32_t, 2>>(),
            parted ? parted->energy : 0};
}

void Simulation::Implementation::restore(const State& state) {
    // The same plan: another measurement might choose another one, whose last bits differ.
    SimulationOptions same = options;
    same.plan = std::visit([](const auto& d) { return d.describe().choice; }, dynamics);
    uncut();
    if (parted) {
        part(state.faces, same);
        parted->energy = state.parting_energy;
    } else {
        dynamics = make_dynamics(same);
    }
    apply_damping();
    set_obstacles(); // as they were before any cut, so that effects have the memory that they had
    press();
    actuate();
    cut_again(state.cuts);
    set_state(dynamics, state.displacements, state.velocities); // where free obstacles complete a leapfrog step
    set_effect_memory(dynamics, state.effect_memory);
    set_state(dynamics, state.displacements, state.velocities); // whole steps, whatever the memory says of half ones
    steps = state.steps;
    meter.reset(); // it knows of steps that have been taken back
    apply_loads();
    prescribe();
}

EquilibriumOptions Simulation::Implementation::equilibrium_options() const {
    const double tolerance = default_tolerance(options.precision);
    EquilibriumOptions solve;
    solve.preconditioner = scene.solver.preconditioner;
    if (is_static()) {
        solve.tolerance = scene.solver.tolerance.value_or(tolerance);
        solve.first_load_step = 1.0 / scene.solver.load_steps;
        const double turns = std::max(steps_to_turn(scene.moves), obstacles.steps_to_press());
        solve.largest_load_step = 1 / turns;
        solve.load_steps =
            std::max({solve.load_steps, 10 * scene.solver.load_steps, static_cast<int>(std::min(10 * turns, 1e9))});
        solve.smallest_load_step =
            std::min({solve.smallest_load_step, solve.first_load_step, 1e-3 * solve.largest_load_step});
    } else {
        // A step's own error is far larger.
        solve.tolerance = std::max(tolerance, std::min(1e-6, 0.1 * scene.solver.tolerance.value_or(1)));
    }
    return solve;
}

void Simulation::Implementation::add_work(const EquilibriumResult& result) {
    work.newton_iterations += result.newton_iterations;
    work.cg_iterations += result.cg_iterations;
    work.load_steps += result.load_steps;
    work.failed_load_steps += result.failed_load_steps;
    work.preconditioner = result.preconditioner;
}

Loading Simulation::Implementation::loading_at(double part) {
    const std::span<const PrescribedNode> held = supports.at_part(part);
    const std::span<const RigidPose> poses = obstacles.at(part);
    Loading loading{{held.begin(), held.end()},
                    loads,
                    gravity,
                    pressed.at(scene, time_of_pressures()),
                    {poses.begin(), poses.end()},
                    actuated.at(scene, time_of_pressures(), part)};
    for (double& pressure : loading.pressures) {
        pressure *= part;
    }
    for (std::size_t a = 0; a < 3; ++a) {
        loading.acceleration[a] *= part;
        for (Vector3& force : loading.forces) {
            force[a] *= part;
        }
    }
    return loading;
}

bool Simulation::Implementation::anything_acts() const {
    const auto is_zero = [](const Vector3& v) { return v == Vector3{0, 0, 0}; };
    return !scene.moves.empty() || !is_zero(gravity) || !pressed.faces.empty() || !actuated.cells.empty() ||
           !std::all_of(loads.begin(), loads.end(), is_zero);
}

std::string Simulation::Implementation::solve(const RunCallbacks& callbacks) {
    if (scene.solver.method == SolverMethod::static_equilibrium) {
        return find_equilibrium(callbacks);
    }
    std::string failure;
    if (scene.solver.method == SolverMethod::modes && anything_acts()) {
        failure = find_equilibrium(callbacks);
    } else {
        solved = true;
        load_fraction = scene.solver.method == SolverMethod::modes ? 1 : 0;
    }
    return failure.empty() ? find_modes(callbacks) : failure;
}

std::string Simulation::Implementation::find_modes(const RunCallbacks& callbacks) {
    ModesOptions wanted;
    wanted.count = scene.solver.count;
    wanted.preconditioner = scene.solver.preconditioner;
    if (callbacks.progress) {
        wanted.progress = [&, start = std::chrono::steady_clock::now()](int iteration, int found) {
            Progress report;
            report.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            report.modes = ModesProgress{iteration, found, wanted.count};
            callbacks.progress(report);
            return true;
        };
    }
    const auto told = [&](bool converged, std::size_t count, const char* what, int iterations) {
        solved = converged;
        return converged
                   ? std::string()
                   : printed("only %zu of %d %s were found in %d iterations", count, wanted.count, what, iterations);
    };
    const auto found_well = [&](std::size_t count, double residual) {
        return count + (residual <= wanted.tolerance ? 1U : 0U);
    };
    std::size_t good = 0;
    std::string failure;
    const Loading loading = loading_at(1);
    if (scene.solver.method == SolverMethod::modes) {
        wanted.pressures = loading.pressures;
        const ModesResult result = on_implicit([&](auto& d) { return d.modes(loading.supports, wanted); });
        for (const Mode& mode : result.modes) {
            modes.push_back({mode.frequency(), mode.residual, mode.shape});
            good = found_well(good, mode.residual);
        }
        rigid_motions = result.rigid_motions;
        failure = told(result.converged, good, "modes", result.iterations);
        work.preconditioner = result.preconditioner;
    } else {
        const BucklingResult result = on_implicit([&](auto& d) { return d.buckling(loading, wanted); });
        for (const BucklingLoad& load : result.loads) {
            modes.push_back({load.factor, load.residual, load.shape});
            good = found_well(good, load.residual);
        }
        supports.at_part(0); // where the body still is
        failure =
            result.loads.empty() ? result.message : told(result.converged, good, "buckling loads", result.iterations);
        solved = failure.empty();
        work.preconditioner = result.preconditioner;
    }
    Vector3 edges = {static_cast<double>(lattice.cells()[0]), static_cast<double>(lattice.cells()[1]),
                     static_cast<double>(lattice.cells()[2])};
    for (std::size_t a = 0; a < 3 && other; ++a) {
        const auto [low, high] = std::minmax_element(rest.begin(), rest.end(),
                                                     [a](const Vector3& x, const Vector3& y) { return x[a] < y[a]; });
        edges[a] = ((*high)[a] - (*low)[a]) / lattice.cell_size();
    }
    const double size = 0.1 * lattice.cell_size() * *std::max_element(edges.begin(), edges.end());
    for (ModeReading& mode : modes) {
        double greatest = 0;
        for (const Vector3& u : mode.shape) {
            greatest = std::max(greatest, std::hypot(u[0], u[1], u[2]));
        }
        for (Vector3& u : mode.shape) {
            for (double& x : u) {
                x *= size / greatest;
            }
        }
    }
    return failure;
}

std::string Simulation::Implementation::find_equilibrium(const RunCallbacks& callbacks) {
    EquilibriumOptions solve = equilibrium_options();
    if (callbacks.progress) {
        solve.progress = [&, start = std::chrono::steady_clock::now()](const EquilibriumProgress& progress) {
            Progress report;
            report.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            report.solve = progress;
            callbacks.progress(report);
            return true;
        };
    }
    const EquilibriumResult result =
        on_implicit([&](auto& d) { return d.follow([this](double fraction) { return loading_at(fraction); }, solve); });
    load_fraction = result.load_fraction;
    prescribe();
    add_work(result);
    steps = work.load_steps;
    solved_residual = result.residual;
    solved = result.status == EquilibriumStatus::converged;
    if (solved) {
        const std::string lost = lost_turns(scene, rest, displacements_of(dynamics));
        solved = lost.empty();
        return solved ? "" : "no equilibrium of so many turns: " + lost;
    }
    return printed("no equilibrium (%s): ", std::string(name(result.status)).c_str()) + explained(result, scene);
}

double Simulation::Implementation::estimated_seconds() const {
    if (!is_static()) {
        return 0;
    }
    // Steps double from the first.
    const double load_steps =
        std::max({steps_to_turn(scene.moves), obstacles.steps_to_press(), 1 + std::log2(scene.solver.load_steps)});
    return std::visit(
        [&](const auto& d) {
            if constexpr (requires { d.estimate_seconds(); }) {
                return load_steps * d.estimate_seconds();
            } else {
                return 0.0;
            }
        },
        dynamics);
}

std::string Simulation::Implementation::implicit_step() {
    const double end = time_after(steps + 1), length = steps + 1 == cut_step ? end - time() : time_step;
    const std::span<const PrescribedNode> held = supports.at(end);
    const bool by_tables = time() < tables_end;
    if (by_tables) {
        load_as_at(end);
    }
    const std::span<const RigidPose> poses = obstacles.at(end);
    const Loading loading{
        {held.begin(), held.end()}, loads, gravity, pressed.at(scene, end), {poses.begin(), poses.end()},
        actuated.at(scene, end)};
    const EquilibriumResult result =
        on_implicit([&](auto& d) { return d.step(loading, length, scene.damping.mass, equilibrium_options()); });
    add_work(result);
    if (result.status == EquilibriumStatus::converged) {
        ++steps;
        return "";
    }
    supports.at(time());
    obstacles.at(time());
    if (by_tables) {
        load_as_at(time());
    }
    return printed("step %ld (t = %.6g s) did not converge: ", steps + 1, end) + explained(result, scene);
}

} // namespace hybmss
