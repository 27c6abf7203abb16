#include "simulation/geometry/cell_volume.hpp"
#include "simulation/run/loads.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hybmss {

bool Simulation::Implementation::changing() const {
    const double end = std::min(std::ceil(scene.solver.duration / time_step), 1e17);
    return moving() || (!is_static() && static_cast<double>(schedule.next_step()) <= end);
}

void Simulation::Implementation::list_cells() {
    if (!cells.empty()) {
        return;
    }
    const auto corners = cell_corners(lattice); // nothing has been cut so far: it has the body's numbers
    const std::span<const float> scales = lattice.cell_scales();
    cells.reserve(corners.size());
    for (std::size_t c = 0; c < scales.size(); ++c) {
        if (scales[c] > 0) {
            cells.push_back({static_cast<std::uint32_t>(c), corners[cells.size()]});
        }
    }
}

double Simulation::Implementation::energy_of(const BodyCell& cell, std::span<const Vector3> displacements,
                                             std::span<const Vector3> velocities) const {
    const double h = lattice.cell_size(), mass = scene.material.density * h * h * h / 8;
    const Vector3& g = scene.gravity.acceleration;
    std::array<Vector3, 8> u{};
    double energy = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const std::uint32_t n = cell.corners[corner];
        u[corner] = displacements[n];
        for (std::size_t a = 0; a < 3; ++a) {
            energy += mass * (0.5 * velocities[n][a] * velocities[n][a] - g[a] * u[corner][a]);
        }
    }
    return energy + cell_energy(scene.material, h, static_cast<double>(lattice.cell_scales()[cell.cell]), u);
}

std::size_t Simulation::Implementation::cut(std::span<const std::uint32_t> wanted) {
    list_cells();
    const std::span<const float> scales = lattice.cell_scales();
    const std::vector<Vector3> u = displacements_of(dynamics), v = velocities_of(dynamics);
    std::vector<std::uint32_t> listed;
    double energy = stored_in_effects();
    for (const std::uint32_t c : wanted) {
        if (c >= scales.size()) {
            throw std::invalid_argument("cell " + std::to_string(c) + ": the lattice has " +
                                        std::to_string(scales.size()));
        }
    }
    std::vector<std::uint32_t> sorted(wanted.begin(), wanted.end());
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    for (const std::uint32_t c : sorted) {
        if (scales[c] > 0) {
            const auto at =
                std::lower_bound(cells.begin(), cells.end(), c,
                                 [](const BodyCell& cell, std::uint32_t index) { return cell.cell < index; });
            energy += energy_of(*at, u, v);
            listed.push_back(c);
        }
    }
    std::vector<Vector3> loads_before = loads;
    cut_again(listed);
    for (std::size_t n = 0; n < loads.size(); ++n) { // those of nodes that are left without a cell
        for (std::size_t a = 0; a < 3; ++a) {
            energy -= (loads_before[n][a] - loads[n][a]) * u[n][a];
        }
    }
    removed_energy += energy - stored_in_effects();
    return listed.size();
}

void Simulation::Implementation::cut_again(std::span<const std::uint32_t> listed) {
    if (listed.empty()) {
        return;
    }
    list_cells();
    std::vector<RemovedCell> now;
    for (const std::uint32_t c : listed) {
        now.push_back({c, lattice.cell_scales()[c]});
    }
    on_explicit([&](auto& d) { d.remove_cells(lattice, listed); });
    removed.insert(removed.end(), now.begin(), now.end());
    const std::span<const double> mass = masses();
    for (std::size_t n = 0; n < loads.size(); ++n) {
        loads[n] = mass[n] > 0 ? loads[n] : Vector3{0, 0, 0};
    }
    for (ProbeNodes& probe : probes) {
        std::erase_if(probe.nodes, [&](std::uint32_t n) { return mass[n] == 0; });
    }
}

void Simulation::Implementation::cut_again(const CutsDone& done) {
    std::vector<std::uint32_t> listed;
    for (const RemovedCell& cell : std::span(removed).first(done.removed)) {
        listed.push_back(cell.cell);
    }
    removed.clear();
    cut_again(listed);
    removed_energy = done.energy;
    schedule.set_done(done.bites);
}

void Simulation::Implementation::uncut() {
    if (removed.empty()) {
        return;
    }
    const std::size_t nx = static_cast<std::size_t>(lattice.cells()[0]),
                      ny = static_cast<std::size_t>(lattice.cells()[1]);
    for (const auto& [cell, scale] : removed) {
        lattice.set_cell_scale(static_cast<int>(cell % nx), static_cast<int>(cell / nx % ny),
                               static_cast<int>(cell / nx / ny), scale);
    }
    loads = nodal_loads(scene, lattice, rest);
    probes = probes_of(scene, rest);
}

void Simulation::Implementation::cut_now() {
    if (schedule.next_step() > steps) {
        return;
    }
    const std::vector<std::size_t> due = schedule.take(steps);
    list_cells();
    const std::vector<Vector3> u = displacements_of(dynamics);
    std::vector<std::uint32_t> inside;
    for (const BodyCell& cell : cells) {
        if (!(lattice.cell_scales()[cell.cell] > 0)) {
            continue;
        }
        const Vector3 at_rest = center_of(cell, rest, {}), present = center_of(cell, rest, u);
        const bool bitten = std::any_of(due.begin(), due.end(), [&](std::size_t c) {
            const Cut& tool = scene.cuts[c];
            return is_inside(tool, tool.at_rest ? at_rest : present, time(), lattice.cell_size());
        });
        if (bitten) {
            inside.push_back(cell.cell);
        }
    }
    cut(inside);
}

std::size_t Simulation::remove_cells(std::span<const std::uint32_t> cells) {
    Implementation& body = *implementation_;
    if (body.scene.solver.method != SolverMethod::symplectic_euler) {
        throw std::invalid_argument("cells are cut only while a body moves by symplectic-euler, not with method = \"" +
                                    std::string(name(body.scene.solver.method)) + "\"");
    }
    if (body.meter) {
        throw std::invalid_argument("cells cannot be removed in a scene with energy_balance: the energy of what is "
                                    "removed is not in the balance");
    }
    return body.cut(cells);
}

std::size_t Simulation::removed_cell_count() const {
    return implementation_->removed.size();
}

std::span<const Vector3> Simulation::rest_positions() const {
    return implementation_->rest;
}

std::vector<std::array<std::uint32_t, 8>> Simulation::cell_nodes() const {
    const Implementation& body = *implementation_;
    if (body.cells.empty()) {
        return cell_corners(body.lattice);
    }
    std::vector<std::array<std::uint32_t, 8>> present;
    for (const BodyCell& cell : body.cells) {
        if (body.lattice.cell_scales()[cell.cell] > 0) {
            present.push_back(cell.corners);
        }
    }
    return present;
}

} // namespace hybmss
