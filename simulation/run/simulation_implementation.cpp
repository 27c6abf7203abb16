#include "simulation/run/simulation_implementation.hpp"

#include "plan/bodies/layout_table.hpp"
#include "simulation/run/loads.hpp"
#include "simulation/run/memory.hpp"
#include "simulation/scene/scene_body.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hybmss {
namespace {

constexpr double kDefaultTolerance = 1e-4;
// Stiffness grows where a body is compressed; the margin keeps the step stable there.
constexpr double kTimeStepFraction = 0.7;
// An implicit step may be any length; this one still follows the slow motions well.
constexpr double kImplicitTimeSteps = 20;

Lattice make_lattice(const Scene& scene, const SimulationOptions& options) {
    if (scene.body.size[0] > 0 && scene.body.cell_size == 0) {
        throw scene_error(scene, "body.size", "its mesh is free; solve_to_accuracy() chooses one");
    }
    check_size(scene, options, available_bytes());
    return scene_lattice(scene);
}

// Springs that stiffen are stiffer where they are strained: the step is chosen for strains up to this.
constexpr double kStrainInReach = 0.5;

/// A given step is held against the critical one at rest, for a motion may well be small.
double choose_time_step(const Scene& scene, const FrequencyBounds& frequencies) {
    if (scene.solver.method == SolverMethod::static_equilibrium) {
        return 0;
    }
    const bool explicit_in_time = scene.solver.method == SolverMethod::symplectic_euler;
    const double critical = frequencies.critical_time_step(scene.damping.stiffness);
    const double stiffening = largest_stiffening(scene.material.stiffening, kStrainInReach);
    const double followed = explicit_in_time ? frequencies.critical_time_step(scene.damping.stiffness, stiffening)
                                             : kImplicitTimeSteps * frequencies.critical_time_step();
    const double step = scene.solver.time_step.value_or(kTimeStepFraction * followed);
    if (explicit_in_time && step > critical) {
        throw scene_error(scene, "solver.time_step",
                          text("above the stable time step; it must be above 0 and at most %.6g s (method = "
                               "\"backward-euler\" takes any)",
                               critical));
    }
    if (scene.solver.duration / step > 1e15) {
        throw scene_error(
            scene, "solver.duration",
            text("%.3g steps of %.6g s; at most 1e15 steps are allowed", scene.solver.duration / step, step));
    }
    return step;
}

void check_cuts(const Scene& scene, const AnyDynamics& dynamics) {
    if (scene.cuts.empty()) {
        return;
    }
    if (scene.solver.method != SolverMethod::symplectic_euler) {
        throw scene_error(scene, "cut[0].at",
                          "cells are cut only while a body moves by symplectic-euler, not with method = \"" +
                              std::string(name(scene.solver.method)) + "\"");
    }
    if (scene.output.energy_balance) {
        throw scene_error(scene, "output.energy_balance",
                          "a scene with it cannot be cut: the energy of what is removed is not in the balance");
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

} // namespace

std::vector<ProbeNodes> probes_of(const Scene& scene, std::span<const Vector3> rest) {
    std::vector<ProbeNodes> probes;
    for (std::size_t p = 0; p < scene.probes.size(); ++p) {
        ProbeNodes& probe = probes.emplace_back();
        probe.name = scene.probes[p].name;
        probe.nodes = nodes_of(scene, rest, scene.probes[p].where, "probe[" + std::to_string(p) + "].where");
        probe.centroid = rest_centroid(rest, probe.nodes);
    }
    return probes;
}

Simulation::Implementation::Implementation(Scene given, const SimulationOptions& wanted)
    : scene(within_ranges(std::move(given))), options(wanted), lattice(make_lattice(scene, options)),
      rest(hybmss::rest_positions(lattice, scene.body.origin)), supports(scene, rest), probes(probes_of(scene, rest)),
      loads(nodal_loads(scene, lattice, rest)), body_frequencies(lattice_frequencies(lattice, scene.material)),
      obstacles(scene, body_frequencies.critical_time_step()),
      dynamics(make_dynamics(lattice, scene.material, scene.solver.method, options)),
      frequencies(body_frequencies.with(obstacles.at_start())),
      critical_time_step(frequencies.critical_time_step(scene.damping.stiffness)),
      time_step(choose_time_step(scene, frequencies)), schedule(scene.cuts, time_step) {
    check_cuts(scene, dynamics);
    apply_damping();
    apply_loads();
    set_obstacles();
    prescribe();
    check_start();
    if (scene.output.energy_balance) {
        if (scene.solver.method != SolverMethod::symplectic_euler) {
            throw scene_error(scene, "output.energy_balance",
                              "a scene with it must be solved by \"symplectic-euler\": the other methods do not keep "
                              "energy, or have no time");
        }
        meter.emplace(
            EnergyMeter::Constants{time_step, masses(), scene.gravity.acceleration, scene.damping.mass, loads},
            metered_state(), velocities_of(dynamics));
    }
}

void Simulation::Implementation::set_obstacles() {
    if (!obstacles.empty()) {
        const std::vector<SurfaceNode> surface = surface_nodes(lattice, scene.body.origin);
        on_explicit([&](auto& d) { d.set_obstacles(surface, obstacles.at_start()); });
    }
}

void Simulation::Implementation::check_start() const {
    const std::vector<NamedObstacleReading> readings = read_obstacles();
    for (std::size_t o = 0; o < readings.size(); ++o) {
        const ObstacleShape& shape = scene.obstacles[o].shape;
        if (const ObstacleReading& reading = readings[o].reading; reading.depth > scene.body.cell_size) {
            throw scene_error(scene,
                              "obstacle[" + std::to_string(o) + "]." +
                                  (std::holds_alternative<PlaneShape>(shape)    ? "plane"
                                   : std::holds_alternative<SphereShape>(shape) ? "sphere"
                                                                                : "box"),
                              text("%zu nodes of the body lie in it at the start, up to %.3g m deep; at most a cell, "
                                   "%.3g m, is allowed",
                                   reading.nodes, reading.depth, scene.body.cell_size));
        }
    }
}

MeteredState Simulation::Implementation::metered_state() const {
    MeteredState state;
    state.displacements = displacements_of(dynamics);
    state.forces = forces_of(dynamics);
    state.held.assign(supports.present().begin(), supports.present().end());
    state.accelerations.assign(supports.accelerations().begin(), supports.accelerations().end());
    const std::vector<NamedObstacleReading> readings = read_obstacles();
    for (std::size_t o = 0; o < readings.size(); ++o) {
        state.obstacles.push_back({obstacles.poses()[o].position, obstacles.angles()[o], readings[o].reading.force,
                                   readings[o].reading.torque});
    }
    state.elastic = std::visit([](const auto& d) { return d.potential_energy().total(); }, dynamics);
    state.effects = effect_energies_of(dynamics);
    return state;
}

void Simulation::Implementation::prescribe() {
    const std::span<const PrescribedNode> nodes = is_static() ? supports.at_part(load_fraction) : supports.at(time());
    on_explicit([&](auto& d) {
        d.prescribe(nodes);
        if (!obstacles.empty()) {
            d.move_obstacles(obstacles.at(time()));
        }
    });
}

void Simulation::Implementation::apply_loads() {
    std::vector<NodalLoad> nodal;
    for (std::size_t n = 0; n < loads.size(); ++n) {
        nodal.push_back({static_cast<std::uint32_t>(n), loads[n]});
    }
    on_explicit([&](auto& d) { d.load(nodal); });
}

void Simulation::Implementation::apply_damping() {
    if (!is_static()) {
        std::visit([&](auto& d) { d.damp_springs(scene.damping.stiffness); }, dynamics);
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
    const StepParameters parameters{time_step, scene.gravity.acceleration, scene.damping.mass};
    // Plates are set after each step, so that every force is taken with all nodes at the same time.
    StepMotion motion;
    motion.nodes = [this](long step) { return supports.at(time_after(steps + step)); };
    if (!obstacles.empty()) {
        motion.obstacles = [this](long step) { return obstacles.at(time_after(steps + step)); };
    }
    const auto advance = [&](long n, const StepMotion& led) {
        on_explicit([&](auto& d) { d.step(parameters, n, led); });
        steps += n;
    };
    cut_now();
    for (long end = steps + count; steps < end; cut_now()) {
        const long next = std::min(end, schedule.next_step());
        while (steps < next) {
            const bool led = moving();
            advance(meter ? 1 : (led ? std::min(next, last_step_of_motion()) : next) - steps,
                    led ? motion : StepMotion{});
            if (meter) {
                meter->record(metered_state());
            }
        }
    }
    return "";
}

void Simulation::Implementation::restore(std::span<const Vector3> displacements, std::span<const Vector3> velocities,
                                         std::span<const double> effect_memory, long at_step, const CutsDone& cuts) {
    // The same plan: another measurement might choose another one, whose last bits differ.
    SimulationOptions same = options;
    same.plan = std::visit([](const auto& d) { return d.describe().choice; }, dynamics);
    uncut();
    dynamics = make_dynamics(lattice, scene.material, scene.solver.method, same);
    apply_damping();
    set_obstacles(); // as they were before any cut, so that effects have the memory that they had
    cut_again(cuts);
    set_state(dynamics, displacements, velocities);
    steps = at_step;
    meter.reset(); // it knows of steps that have been taken back
    apply_loads();
    prescribe();
    set_effect_memory(dynamics, effect_memory);
}

std::span<const double> Simulation::Implementation::masses() const {
    return std::visit([](const auto& d) { return d.masses(); }, dynamics);
}

NodalForces Simulation::Implementation::nodal_forces(std::span<const Vector3> internal) const {
    return {internal, masses(), scene.gravity.acceleration, scene.damping.mass, loads};
}

double Simulation::Implementation::stored_in_effects() const {
    double sum = 0;
    for (const EffectEnergy& effect : effect_energies_of(dynamics)) {
        sum += effect.stored;
    }
    return sum;
}

double Simulation::Implementation::external_energy(std::span<const Vector3> displacements) const {
    const Vector3& g = scene.gravity.acceleration;
    const std::span<const double> mass = masses();
    double sum = 0;
    for (std::size_t n = 0; n < displacements.size(); ++n) {
        const Vector3& u = displacements[n];
        for (std::size_t a = 0; a < 3; ++a) {
            sum -= (mass[n] * g[a] + (loads.empty() ? 0 : loads[n][a])) * u[a];
        }
    }
    return sum;
}

Energies Simulation::Implementation::energies() const {
    Energies energies;
    std::visit(
        [&](const auto& d) {
            const PotentialEnergy potential = d.potential_energy();
            energies.springs = potential.springs;
            energies.volume = potential.volume;
            energies.kinetic = d.kinetic_energy();
        },
        dynamics);
    energies.effects = effect_energies_of(dynamics);
    if (scene.gravity.acceleration != Vector3{0, 0, 0} || !loads.empty()) {
        energies.external = external_energy(displacements_of(dynamics));
    }
    energies.removed = removed_energy;
    return energies;
}

double Simulation::Implementation::body_volume() const {
    const double h = lattice.cell_size();
    // Of a body that was cut away to nothing, one cell's: it divides.
    return static_cast<double>(std::max<std::size_t>(lattice.cell_count(), 1)) * h * h * h;
}

Settlement Simulation::Implementation::settlement(const Energies& energies) const {
    if (is_static()) {
        return {solved_residual, 0, solved};
    }
    const double tolerance = scene.solver.tolerance.value_or(kDefaultTolerance);
    // The floors stand for a strain of 1e-9: a body deformed less counts as undeformed.
    const double E = scene.material.young_modulus, h = lattice.cell_size();
    const double potential = std::max(energies.springs + energies.volume, 1e-18 * E * body_volume());
    const std::vector<Vector3> internal = forces_of(dynamics);
    Settlement s;
    s.kinetic_ratio = std::sqrt(energies.kinetic / potential);
    s.residual = relative_residual(nodal_forces(internal), supports.present(), 1e-9 * E * h * h);
    s.settled = !changing() && s.residual <= tolerance && s.kinetic_ratio <= tolerance;
    return s;
}

long Simulation::Implementation::steps_between_checks() const {
    return scene.solver.method == SolverMethod::symplectic_euler ? 50 : 1;
}

std::string Simulation::Implementation::blow_up(const Energies& e) const {
    const SpringStiffening& stiffening = scene.material.stiffening;
    const double bound = 1e4 * (1 + std::abs(stiffening.quadratic) + stiffening.cubic) *
                         (scene.material.young_modulus + std::abs(volume_modulus(scene.material))) * body_volume();
    const double potential = e.springs + e.volume;
    const char* cause = !std::isfinite(potential) || !std::isfinite(e.kinetic) || !std::isfinite(e.external)
                            ? "the state is not finite any more"
                        : std::abs(potential) > bound ? "the elastic energy grows without bound"
                                                      : nullptr;
    if (!cause) {
        return "";
    }
    // Below nu = 1/4 the volume energy of inverted cells has no lower bound: no step is small enough for them.
    const char* inverted = scene.material.poisson_ratio < 0.25 ? "; cells that turn inside out do this below "
                                                                 "poisson_ratio = 0.25, whatever the step"
                                                               : "";
    return text(
        "diverged by step %ld (t = %.6g s): %s; a smaller time_step than %.6g s, more damping or gentler motions "
        "and loads may help%s",
        steps, time(), cause, time_step, inverted);
}

std::vector<NamedObstacleReading> Simulation::Implementation::read_obstacles() const {
    std::vector<ObstacleReading> readings;
    if (const auto* single = std::get_if<ExplicitDynamics<float>>(&dynamics)) {
        readings = single->obstacle_readings();
    } else if (const auto* in_double = std::get_if<ExplicitDynamics<double>>(&dynamics)) {
        readings = in_double->obstacle_readings();
    }
    std::vector<NamedObstacleReading> named;
    for (std::size_t o = 0; o < readings.size(); ++o) {
        named.push_back({scene.obstacles[o].name, readings[o]});
    }
    return named;
}

std::vector<std::string> Simulation::Implementation::warnings(std::span<const NamedObstacleReading> readings) const {
    std::vector<std::string> lines;
    for (std::size_t o = 0; o < readings.size(); ++o) {
        const double depth = readings[o].reading.greatest_depth, good = obstacles.greatest_good_depth(o);
        if (depth > good) {
            lines.push_back(text("nodes were up to %.3g m deep in %s, where more than %.3g m may let them through; a "
                                 "slower impact, a stiffer or a thicker obstacle may help",
                                 depth, readings[o].name.c_str(), good));
        }
    }
    return lines;
}

std::vector<ProbeReading> Simulation::Implementation::read_probes() const {
    if (probes.empty()) {
        return {};
    }
    const std::vector<Vector3> internal = forces_of(dynamics), u = displacements_of(dynamics);
    const std::vector<Vector3> support =
        support_forces(nodal_forces(internal), supports.present(), supports.accelerations());
    std::vector<ProbeReading> readings;
    for (const ProbeNodes& probe : probes) {
        readings.push_back(read_probe(probe, rest, u, support));
    }
    return readings;
}

} // namespace hybmss
