#include "hybmss/simulation/simulation.hpp"

#include "layouts/messages.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/run/run_in_time.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace hybmss {

Simulation::Simulation(Scene scene, const SimulationOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(scene), options)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

std::vector<std::array<std::uint32_t, 8>> Simulation::cell_nodes() const {
    return implementation_->cell_nodes();
}
const Scene& Simulation::scene() const {
    return implementation_->scene;
}
const Lattice& Simulation::lattice() const {
    if (implementation_->other) {
        throw std::invalid_argument("the body's cells are no cubes: it has no lattice, which this needs");
    }
    return implementation_->lattice;
}
const FittedCells* Simulation::other_cells() const {
    return implementation_->other ? &*implementation_->other : nullptr;
}
std::size_t Simulation::cell_count() const {
    return implementation_->other ? implementation_->other->network.polyhedra.size()
                                  : implementation_->lattice.cell_count();
}
std::size_t Simulation::node_count() const {
    return implementation_->rest.size();
}
long Simulation::steps() const {
    return implementation_->steps;
}
double Simulation::time() const {
    return implementation_->time();
}
double Simulation::time_step() const {
    return implementation_->time_step;
}
double Simulation::estimated_seconds() const {
    return implementation_->estimated_seconds();
}
double Simulation::critical_time_step() const {
    return implementation_->critical_time_step;
}
std::size_t Simulation::fixed_node_count() const {
    return implementation_->supports.fixed_node_count();
}
std::size_t Simulation::moved_node_count() const {
    return implementation_->supports.moved_node_count();
}
std::size_t Simulation::actuated_cell_count() const {
    return implementation_->actuated.cells.size();
}
std::size_t Simulation::pressed_face_count() const {
    return implementation_->pressed.faces.size();
}
void Simulation::step(long count) {
    Implementation& body = *implementation_;
    std::string failure = body.is_static() ? body.solve({}) : "";
    if (!body.is_static()) {
        const long end = body.steps + count, between = body.steps_between_checks();
        while (failure.empty() && body.steps < end) {
            // By the steps since the start: many calls for one step each are looked after too.
            const long check = (body.steps / between + 1) * between;
            failure = body.step(std::min(end, check) - body.steps);
            if (failure.empty() && body.steps == check) {
                failure = body.blow_up(body.energies());
            }
        }
    }
    if (!failure.empty()) {
        throw std::runtime_error(failure);
    }
}
std::vector<Vector3> Simulation::displacements() const {
    return displacements_of(implementation_->dynamics);
}
std::vector<Vector3> Simulation::velocities() const {
    return velocities_of(implementation_->dynamics);
}
Energies Simulation::energies() const {
    return implementation_->energies();
}
std::vector<ProbeReading> Simulation::probes() const {
    return implementation_->read_probes();
}
std::vector<std::string> Simulation::shared_supports() const {
    std::vector<std::string> lines;
    for (const ProbeNodes& probe : implementation_->probes) {
        if (!probe.shared.empty()) {
            lines.push_back(probe.shared);
        }
    }
    return lines;
}
std::span<const double> Simulation::masses() const {
    return implementation_->masses();
}
std::vector<Vector3> Simulation::reactions() const {
    return implementation_->reactions();
}

std::vector<Vector3> Simulation::contact_forces() const {
    return contact_forces_of(implementation_->dynamics);
}
std::vector<CellStress> Simulation::cell_stresses() const {
    (void)lattice(); // which only cubes have
    return implementation_->cell_stresses();
}
std::vector<RigidPose> Simulation::obstacle_poses() const {
    return implementation_->obstacle_poses();
}
std::vector<NamedObstacleReading> Simulation::obstacles() const {
    return implementation_->read_obstacles();
}
std::optional<EnergyBalance> Simulation::energy_balance() const {
    const auto& meter = implementation_->meter;
    return meter ? std::optional(meter->balance()) : std::nullopt;
}
VolumeChange Simulation::volume_change() const {
    if (const FittedCells* const other = other_cells()) {
        return measure_volume_change(other->network.polyhedra, rest_positions(), displacements());
    }
    return measure_volume_change(displacements(), cell_nodes(), lattice().cell_size(),
                                 values_of_cells(lattice(), lattice().fills()));
}
Settlement Simulation::settlement() const {
    return implementation_->settlement(energies());
}

PlanDescription Simulation::describe() const {
    return std::visit([](const auto& d) { return d.describe(); }, implementation_->dynamics);
}

Summary Simulation::run(const RunCallbacks& callbacks) {
    const auto elapsed = [start = std::chrono::steady_clock::now()] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    Implementation& body = *implementation_;
    std::string failure;
    bool interrupted = false;
    if (body.is_static()) {
        if (callbacks.estimate) {
            callbacks.estimate(body.estimated_seconds());
        }
        const std::function<void()> write = callbacks.output ? callbacks.output : [] {};
        write();
        failure = body.solve(callbacks);
        write();
    } else {
        failure = run_in_time(body, body.scene, callbacks, elapsed, interrupted);
    }
    Summary summary = body.summary(std::move(failure));
    summary.interrupted = interrupted;
    summary.volume = volume_change();
    summary.plan = describe();
    summary.wall_seconds = elapsed();
    return summary;
}

Summary Simulation::Implementation::summary(std::string failure) const {
    Summary summary;
    summary.method = scene.solver.method;
    summary.failure = std::move(failure);
    summary.energies = energies();
    summary.settlement = settlement(summary.energies);
    summary.converged = summary.settlement.settled && summary.failure.empty();
    summary.obstacles = read_obstacles();
    if (!is_static() && scene.solver.tolerance && !summary.converged && summary.failure.empty()) {
        summary.failure =
            printed("not settled after duration = %.6g s: residual %.3g, kinetic ratio %.3g, tolerance %.3g%s",
                    scene.solver.duration, summary.settlement.residual, summary.settlement.kinetic_ratio,
                    *scene.solver.tolerance,
                    moving()              ? "; a motion has not ended"
                    : time() < tables_end ? "; a load has not come to its end"
                                          : "");
        for (const NamedObstacleReading& obstacle : summary.obstacles) {
            if (obstacle.reading.nodes > 0) {
                summary.failure +=
                    printed("; contact: %zu nodes touch %s", obstacle.reading.nodes, obstacle.name.c_str());
            }
        }
    }
    summary.probes = read_probes();
    summary.warnings = warnings(summary.obstacles);
    if (const std::string coarse = summary.failure.empty() ? coarseness() : ""; !coarse.empty()) {
        summary.warnings.push_back(coarse);
    }
    if (meter) {
        summary.balance = meter->balance();
    }
    if (scene.output.reaction) {
        summary.supports = support_readings();
    }
    if (scene.output.stress) {
        summary.stress = stress_summary();
    }
    summary.modes = modes;
    summary.rigid_motions = rigid_motions;
    summary.steps = steps;
    summary.time = time();
    summary.time_step = time_step;
    summary.critical_time_step = critical_time_step;
    summary.work = work;
    summary.removed_cells = removed.size();
    if (parted) {
        summary.parted_faces = parted->faces.size();
        summary.parting_energy = parted->energy;
    }
    if (other && scene.body.shape == SceneCells::mesh) {
        summary.fit = SpringFit{other->misfit, other->anisotropy, other->modulus_error, other->without};
    }
    return summary;
}

} // namespace hybmss
