#include "hybmss/simulation/simulation.hpp"

#include "simulation/geometry/cell_volume.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace hybmss {

Simulation::Simulation(Scene scene, const SimulationOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(scene), options)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

const Scene& Simulation::scene() const {
    return implementation_->scene;
}
const Lattice& Simulation::lattice() const {
    return implementation_->lattice;
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
double Simulation::critical_time_step() const {
    return implementation_->critical_time_step;
}
std::size_t Simulation::fixed_node_count() const {
    return implementation_->supports.fixed_node_count();
}
std::size_t Simulation::moved_node_count() const {
    return implementation_->supports.moved_node_count();
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
std::vector<RigidPose> Simulation::obstacle_poses() const {
    const std::span<const RigidPose> poses = implementation_->obstacles.poses();
    return {poses.begin(), poses.end()};
}
std::vector<NamedObstacleReading> Simulation::obstacles() const {
    return implementation_->read_obstacles();
}
std::optional<EnergyBalance> Simulation::energy_balance() const {
    const auto& meter = implementation_->meter;
    return meter ? std::optional(meter->balance()) : std::nullopt;
}
VolumeChange Simulation::volume_change() const {
    return measure_volume_change(displacements(), cell_nodes(), lattice().cell_size());
}
Settlement Simulation::settlement() const {
    return implementation_->settlement(energies());
}

PlanDescription Simulation::describe() const {
    return std::visit([](const auto& d) { return d.describe(); }, implementation_->dynamics);
}

} // namespace hybmss
