// Cells that part along faces while a body moves: what tears, and what a tool separates.

#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

namespace hybmss {
namespace {

/// Tears are looked for after so many steps: a look at all cells takes about as long as a step or two.
constexpr long kStepsBetweenLooks = 10;

using Face = std::array<std::uint32_t, 2>;

double own_energy(const AnyDynamics& dynamics) {
    return std::visit([](const auto& d) { return d.potential_energy().total() + d.kinetic_energy(); }, dynamics);
}

} // namespace

std::optional<Simulation::Implementation::Parted> Simulation::Implementation::make_parted(const Scene& scene,
                                                                                          const Lattice& lattice) {
    if (!may_part(scene)) {
        return std::nullopt;
    }
    check_parting(scene);
    return parted_at({}, scene, lattice);
}

Simulation::Implementation::Parted Simulation::Implementation::parted_at(std::vector<Face> faces, const Scene& scene,
                                                                         const Lattice& lattice) {
    try {
        Parted made{separate(lattice, scene.material, faces), std::move(faces)};
        for (Vector3& x : made.body.network.rest_positions) {
            for (std::size_t a = 0; a < 3; ++a) {
                x[a] += scene.body.origin[a];
            }
        }
        return made;
    } catch (const std::invalid_argument& error) {
        throw scene_error(scene, scene.tear_strain ? "material.tear_strain" : "cut[0].mode", error.what());
    }
}

void Simulation::Implementation::part(std::vector<Face> faces, const SimulationOptions& with) {
    const double energy = parted->energy;
    parted = parted_at(std::move(faces), scene, lattice);
    parted->energy = energy;
    rest = parted->body.network.rest_positions;
    turned = initial_displacements(scene, rest);
    supports = Supports(scene, rest, turned);
    probes = probes_of(scene, rest, turned, supports);
    dynamics = make_dynamics(with);
    apply_damping();
    spread_loads();
    apply_loads();
}

void Simulation::Implementation::part_more(std::span<const Face> more) {
    if (more.empty()) {
        return;
    }
    const double before = own_energy(dynamics);
    const std::vector<Vector3> u = displacements_of(dynamics), v = velocities_of(dynamics);
    const std::vector<double> memory = effect_memory_of(dynamics);
    const SeparatedNetwork was = parted->body;
    SimulationOptions same = options; // as in restore()
    same.plan = std::visit([](const auto& d) { return d.describe().choice; }, dynamics);
    std::vector<Face> faces = parted->faces;
    faces.insert(faces.end(), more.begin(), more.end());
    part(std::move(faces), same);
    const std::vector<std::uint32_t> from = nodes_before(was, parted->body);
    std::vector<Vector3> displacements, velocities;
    for (const std::uint32_t n : from) {
        displacements.push_back(u[n]);
        velocities.push_back(v[n]);
    }
    set_effect_memory(dynamics, memory);
    set_state(dynamics, displacements, velocities);
    parted->energy += own_energy(dynamics) - before;
    prescribe();
}

long Simulation::Implementation::next_look() const {
    return scene.tear_strain ? (steps / kStepsBetweenLooks + 1) * kStepsBetweenLooks : std::numeric_limits<long>::max();
}

void Simulation::Implementation::tear_now() {
    if (!scene.tear_strain || steps % kStepsBetweenLooks != 0) {
        return;
    }
    const std::vector<Vector3> u = displacements_of(dynamics);
    part_more(torn_faces(lattice, parted->body, VectorField<const double>::aos(u.data()->data(), u.size()),
                         *scene.tear_strain));
}

std::vector<Face> Simulation::Implementation::faces_in_tools(std::span<const std::size_t> cuts) const {
    std::vector<std::uint32_t> grid, place(lattice.cell_scales().size(), 0);
    for (std::uint32_t cell = 0; cell < place.size(); ++cell) {
        if (lattice.cell_scales()[cell] > 0) {
            place[cell] = static_cast<std::uint32_t>(grid.size());
            grid.push_back(cell);
        }
    }
    const std::vector<Vector3> u = displacements_of(dynamics);
    const std::array<std::uint32_t, 3> next = {1, static_cast<std::uint32_t>(lattice.cells()[0]),
                                               static_cast<std::uint32_t>(lattice.cells()[0] * lattice.cells()[1])};
    std::vector<Face> faces;
    for (const std::uint32_t cell : grid) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const bool is_last =
                static_cast<int>(cell / next[axis]) % lattice.cells()[axis] + 1 == lattice.cells()[axis];
            if (is_last || !(lattice.cell_scales()[cell + next[axis]] > 0)) {
                continue;
            }
            const auto &low = parted->body.corners[place[cell]], &high = parted->body.corners[place[cell + next[axis]]];
            Vector3 present{}, at_rest{};
            bool holds = true;
            for (std::size_t corner = 0; corner < 8; ++corner) {
                if ((corner >> axis & 1) == 0) {
                    continue;
                }
                const std::uint32_t n = low[corner];
                holds = holds && n == high[corner ^ std::size_t{1} << axis];
                for (std::size_t a = 0; a < 3; ++a) {
                    at_rest[a] += rest[n][a] / 4;
                    present[a] += (rest[n][a] + u[n][a]) / 4;
                }
            }
            const bool reached = std::ranges::any_of(cuts, [&](std::size_t c) {
                const Cut& tool = scene.cuts[c];
                return is_inside(tool, tool.at_rest ? at_rest : present, time(), lattice.cell_size());
            });
            if (holds && reached) {
                faces.push_back({cell, cell + next[axis]});
            }
        }
    }
    return faces;
}

std::size_t Simulation::parted_face_count() const {
    return parted_faces().size();
}

std::span<const std::array<std::uint32_t, 2>> Simulation::parted_faces() const {
    const auto& parted = implementation_->parted;
    return parted ? std::span<const Face>(parted->faces) : std::span<const Face>();
}

} // namespace hybmss
