#include "simulation/run/readings.hpp"

#include "layouts/messages.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/run/cutting.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

constexpr double kDefaultTolerance = 1e-4;

/// Support forces, one vector a node: zero on free axes, on held ones
///   R = m (a + c v) - f - m g - load.
std::vector<Vector3> support_forces(const NodalForces& forces, std::span<const PrescribedNode> held,
                                    std::span<const Vector3> accelerations) {
    std::vector<Vector3> support(forces.internal.size(), Vector3{0, 0, 0});
    for (std::size_t i = 0; i < held.size(); ++i) {
        const std::size_t n = held[i].node;
        for (std::size_t a = 0; a < 3; ++a) {
            if (held[i].axes >> a & 1) {
                const double inertia =
                    accelerations[i][a] + forces.mass_damping * held[i].velocity[a] - forces.gravity[a];
                support[n][a] = forces.masses[n] * inertia - forces.internal[n][a] - forces.load(n, a);
            }
        }
    }
    return support;
}

/// Largest |f + m g + load| on a free axis over the largest one on a held axis or the largest weight or load of a node.
/// `floor` (N) bounds the denominator below, so that a body at rest without loads is in balance.
double relative_residual(const NodalForces& forces, std::span<const PrescribedNode> held, double floor) {
    double unbalanced = 0, scale = floor;
    std::size_t next = 0;
    for (std::size_t n = 0; n < forces.internal.size(); ++n) {
        const bool is_held = next < held.size() && held[next].node == n;
        const unsigned axes = is_held ? held[next].axes : 0u;
        next += is_held;
        for (std::size_t a = 0; a < 3; ++a) {
            const double weight = forces.masses[n] * forces.gravity[a] + forces.load(n, a);
            const double sum = std::abs(forces.internal[n][a] + weight);
            double& largest = axes >> a & 1 ? scale : unbalanced;
            largest = std::max(largest, sum);
            scale = std::max(scale, std::abs(weight));
        }
    }
    return unbalanced / scale;
}

} // namespace

ProbeReading read_probe(const ProbeNodes& probe, std::span<const Vector3> rest, std::span<const Vector3> displacements,
                        std::span<const Vector3> support, std::span<const Vector3> turned) {
    ProbeReading reading;
    reading.name = probe.name;
    reading.reaction_nodes = probe.reaction_nodes;
    reading.shared_reaction_nodes = probe.shared_reaction_nodes;
    const auto count = static_cast<double>(probe.nodes.size());
    for (std::uint32_t n : probe.nodes) {
        const Vector3 &u = displacements[n], &f = support[n];
        Vector3 r{}, since = u; // where it began
        for (std::size_t a = 0; a < 3; ++a) {
            r[a] = rest[n][a] - probe.centroid[a] + u[a];
            since[a] -= turned.empty() ? 0 : turned[n][a];
            reading.force[a] += f[a];
            reading.mean_displacement[a] += since[a] / count;
        }
        reading.torque[0] += r[1] * f[2] - r[2] * f[1];
        reading.torque[1] += r[2] * f[0] - r[0] * f[2];
        reading.torque[2] += r[0] * f[1] - r[1] * f[0];
        reading.max_displacement = std::max(reading.max_displacement, std::hypot(since[0], since[1], since[2]));
    }
    return reading;
}

double excess_stiffness(const Lattice& lattice, const Material& material,
                        std::span<const std::array<std::uint32_t, 8>> cells, std::span<const Vector3> displacements,
                        double epsilon) {
    if (material.springs == SpringForm::means) {
        return 0; // whose cells bend as they should
    }
    constexpr double kMost = 20000, kGolden = 0.6180339887498949; // of cells spread by it none stand in rows
    std::vector<std::size_t> filled;                              // the cells that there are, in their order
    for (std::size_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
        if (lattice.cell_scales()[cell] > 0) {
            filled.push_back(cell);
        }
    }
    const double h = lattice.cell_size(), count = static_cast<double>(cells.size()), looks = std::min(count, kMost);
    double whole = 0, mean = 0, greatest = 0, volume = 0; // J, J, m, m^3
    for (double look = 0; look < looks; ++look) {
        const double place = looks < count ? count * (kGolden * look - std::floor(kGolden * look)) : look;
        const std::size_t c = std::min(static_cast<std::size_t>(place), cells.size() - 1);
        std::array<Vector3, 8> u{}, affine{};
        for (std::size_t corner = 0; corner < 8; ++corner) {
            u[corner] = displacements[cells[c][corner]];
            greatest = std::max(greatest, std::hypot(u[corner][0], u[corner][1], u[corner][2]));
            for (std::size_t other = 0; other < 8; ++other) {
                // (1 + s.s) / 8, s = -1, +1 at the low and the high sides: mean and mean gradient of the corners.
                const double weight = (4 - 2 * static_cast<double>(std::popcount(corner ^ other))) / 8;
                for (std::size_t a = 0; a < 3; ++a) {
                    affine[other][a] += weight * displacements[cells[c][corner]][a];
                }
            }
        }
        const double scale = static_cast<double>(lattice.cell_scales()[filled[c]]);
        const Material own = material_of(lattice, lattice.cell_tissue(filled[c]), material);
        whole += cell_energy(own, h, scale, u);
        mean += cell_energy(own, h, scale, affine);
        volume += scale * h * h * h;
    }
    const double strain = 64 * epsilon * greatest / h, excess = 2.0 / 3 * (whole - mean);
    return whole > material.young_modulus * strain * strain * volume && excess > 0 ? excess / (whole - excess) : 0;
}

std::span<const double> Simulation::Implementation::masses() const {
    return std::visit([](const auto& d) { return d.masses(); }, dynamics);
}

NodalForces Simulation::Implementation::nodal_forces(std::span<const Vector3> internal) const {
    Vector3 part = gravity;
    for (double& g : part) {
        g *= loaded_part();
    }
    return {internal, masses(), part, scene.damping.mass, loads, loaded_part()};
}

double Simulation::Implementation::stored_in_effects() const {
    double sum = 0;
    for (const EffectEnergy& effect : effect_energies_of(dynamics)) {
        sum += effect.stored;
    }
    return sum;
}

double Simulation::Implementation::external_energy(std::span<const Vector3> displacements) const {
    const Vector3& g = gravity;
    const std::span<const double> mass = masses();
    double sum = 0;
    for (std::size_t n = 0; n < displacements.size(); ++n) {
        const Vector3& u = displacements[n];
        for (std::size_t a = 0; a < 3; ++a) {
            sum -= (mass[n] * g[a] + (loads.empty() ? 0 : loads[n][a])) * u[a];
        }
    }
    return loaded_part() * sum;
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
    if (gravity != Vector3{0, 0, 0} || !loads.empty()) {
        energies.external = external_energy(displacements_of(dynamics));
    }
    energies.removed = removed_energy;
    return energies;
}

double Simulation::Implementation::body_volume() const {
    if (other) {
        return std::accumulate(other->network.masses.begin(), other->network.masses.end(), 0.0) /
               scene.material.density;
    }
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
    double kinetic = energies.kinetic;
    Settlement s;
    s.residual = relative_residual(nodal_forces(internal), supports.present(), 1e-9 * E * h * h);
    for (const SceneObstacle& obstacle : scene.obstacles) { // free ones rest where what they touch bears them
        if (obstacle.mass > 0) {
            const auto number = static_cast<std::size_t>(&obstacle - scene.obstacles.data());
            const ObstacleReading reading = read_obstacles()[number].reading;
            double unbalanced = 0, scale = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                const double weight = obstacle.mass * gravity[a];
                unbalanced = std::max(unbalanced, std::abs(weight - reading.force[a]));
                scale = std::max({scale, std::abs(weight), std::abs(reading.force[a])});
            }
            s.residual = std::max(s.residual, scale > 0 ? unbalanced / scale : 0);
            kinetic += reading.kinetic;
        }
    }
    s.kinetic_ratio = std::sqrt(kinetic / potential);
    s.settled = !changing() && s.residual <= tolerance && s.kinetic_ratio <= tolerance;
    return s;
}

long Simulation::Implementation::steps_between_checks() const {
    return explicit_in_time(scene.solver.method) ? 50 : 1;
}

std::string Simulation::Implementation::blow_up(const Energies& e) const {
    const SpringStiffening& stiffening = scene.material.stiffening;
    double kappa = 0, least_ratio = scene.material.poisson_ratio;
    for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
        const Material own = material_of(lattice, tissue, scene.material);
        kappa = std::max(kappa, std::abs(volume_modulus(own)));
        least_ratio = std::min(least_ratio, own.poisson_ratio);
    }
    const double bound = 1e4 * (1 + std::abs(stiffening.quadratic) + stiffening.cubic) *
                         (scene.material.young_modulus + kappa) * body_volume();
    const double potential = e.springs + e.volume;
    const char* cause = !std::isfinite(potential) || !std::isfinite(e.kinetic) || !std::isfinite(e.external)
                            ? "the state is not finite any more"
                        : std::abs(potential) > bound ? "the elastic energy grows without bound"
                                                      : nullptr;
    if (!cause) {
        return "";
    }
    // Below nu = 1/4 the volume energy of inverted cells has no lower bound: no step is small enough for them.
    const char* inverted = least_ratio < 0.25 ? "; cells that turn inside out do this below poisson_ratio = 0.25, "
                                                "whatever the step"
                                              : "";
    return printed(
        "diverged by step %ld (t = %.6g s): %s; a smaller time_step than %.6g s, more damping or gentler motions "
        "and loads may help%s",
        steps, time(), cause, time_step, inverted);
}

std::vector<RigidPose> Simulation::Implementation::obstacle_poses() const {
    std::vector<RigidPose> poses(obstacles.poses().begin(), obstacles.poses().end());
    const auto is_free = [](const SceneObstacle& obstacle) { return obstacle.mass > 0; };
    if (std::none_of(scene.obstacles.begin(), scene.obstacles.end(), is_free)) {
        return poses;
    }
    const std::vector<RigidPose> now = std::visit(
        [](const auto& d) {
            if constexpr (requires { d.obstacle_poses(); }) {
                return d.obstacle_poses();
            } else {
                return std::vector<RigidPose>();
            }
        },
        dynamics);
    for (std::size_t o = 0; o < now.size(); ++o) {
        poses[o] = is_free(scene.obstacles[o]) ? now[o] : poses[o];
    }
    return poses;
}

std::vector<NamedObstacleReading> Simulation::Implementation::read_obstacles() const {
    const std::vector<RigidPose> poses = obstacle_poses();
    const std::vector<ObstacleReading> readings =
        std::visit([](const auto& d) { return d.obstacle_readings(); }, dynamics);
    std::vector<NamedObstacleReading> named;
    for (std::size_t o = 0; o < readings.size(); ++o) {
        const double by_mass = obstacles.at_start()[o].stiffness * scene.material.density * scene.body.cell_size / 2;
        named.push_back({scene.obstacles[o].name, readings[o], scene.obstacles[o].stiffness.value_or(by_mass),
                         scene.obstacles[o].mass > 0 ? std::optional(poses[o]) : std::nullopt});
    }
    return named;
}

std::vector<std::string> Simulation::Implementation::warnings(std::span<const NamedObstacleReading> readings) const {
    std::vector<std::string> lines;
    for (const ProbeNodes& probe : probes) {
        if (!probe.shared.empty()) {
            lines.push_back(probe.shared);
        }
    }
    for (std::size_t o = 0; o < readings.size(); ++o) {
        const double depth = readings[o].reading.greatest_depth, good = obstacles.greatest_good_depth(o);
        if (depth >= good * (1 - 1e-9)) {
            lines.push_back(
                printed("nodes were up to %.3g m deep in %s, where %.3g m is no contact of surfaces any more; a "
                        "slower impact, a stiffer or a thicker obstacle may help",
                        depth, readings[o].name.c_str(), good));
        }
    }
    return lines;
}

std::vector<Vector3> Simulation::Implementation::reactions() const {
    const std::vector<Vector3> internal = forces_of(dynamics);
    return support_forces(nodal_forces(internal), supports.present(), supports.accelerations());
}

std::vector<SupportReading> Simulation::Implementation::support_readings() const {
    const std::vector<Vector3> support = reactions(), u = displacements_of(dynamics);
    const std::span<const PrescribedNode> held = supports.present();
    const auto fixes = static_cast<int>(scene.fixes.size()), moves = static_cast<int>(scene.moves.size());
    std::vector<SupportReading> readings;
    for (int n = 0; n < fixes + moves; ++n) {
        const bool is_fix = n < fixes;
        const int by = is_fix ? -1 - n : n - fixes; // as Supports counts them
        ProbeNodes nodes;
        std::vector<Vector3> own(support.size(), Vector3{});
        for (std::size_t i = 0; i < held.size(); ++i) {
            const Supports::Held& holders = supports.holders()[i];
            for (std::size_t a = 0; a < 3; ++a) {
                own[held[i].node][a] = holders.by[a] == by ? support[held[i].node][a] : 0;
            }
            if (std::ranges::find(holders.by, by) != holders.by.end()) {
                nodes.nodes.push_back(held[i].node);
            }
        }
        nodes.centroid = rest_centroid(turned.empty() ? rest : positions(rest, turned), nodes.nodes);
        const ProbeReading read = read_probe(nodes, rest, u, own, turned);
        std::string where = where_text(scene, Supports::path_of(by));
        if (where.starts_with('"')) { // the name of a face
            where = where.substr(1, where.size() - 2);
        }
        readings.push_back({is_fix ? "fix" : "move", where, read.force, read.torque, nodes.nodes.size()});
    }
    return readings;
}

std::vector<CellStress> Simulation::Implementation::cell_stresses() const {
    const std::vector<std::array<std::uint32_t, 8>> corners = cell_nodes();
    std::vector<CellStress> stresses(corners.size());
    const std::vector<Vector3> u = displacements_of(dynamics);
    StressMeter(lattice, scene.material, corners, u.size(), options.plan)
        .read(VectorField<const double>::aos(u.data()->data(), u.size()), stresses);
    return stresses;
}

StressSummary Simulation::Implementation::stress_summary() const {
    const std::vector<std::array<std::uint32_t, 8>> corners = cell_nodes();
    const std::vector<CellStress> stresses = cell_stresses();
    StressSummary summary;
    std::size_t worst = 0;
    const std::vector<float> fills = values_of_cells(lattice, lattice.fills());
    double volume = 0;
    for (std::size_t n = 0; n < stresses.size(); ++n) {
        if (stresses[n].von_mises() > summary.max_von_mises) {
            summary.max_von_mises = stresses[n].von_mises();
            worst = n;
        }
        const double own = stresses[n].volume_ratio * (fills.empty() ? 1.0 : static_cast<double>(fills[n]));
        volume += own;
        for (std::size_t s = 0; s < 6; ++s) {
            summary.mean_cauchy[s] += own * stresses[n].cauchy[s];
        }
    }
    if (stresses.empty()) {
        return summary;
    }
    for (double& s : summary.mean_cauchy) {
        s /= volume;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        summary.where[axis] = 0.5 * (rest[corners[worst][0]][axis] + rest[corners[worst][7]][axis]);
    }
    return summary;
}

std::string Simulation::Implementation::coarseness() const {
    // Not where an accuracy was asked for, whose error is told by other meshes; nor of a body that nothing holds: what
    // bends it is its own waves after an impact, and nothing is read of those.
    constexpr double kMuch = 0.1;
    if (other || scene.solver.accuracy || (scene.fixes.empty() && scene.moves.empty())) {
        return "";
    }
    const double epsilon = options.precision == Precision::float32 ? 0x1p-23 : 0x1p-52;
    const double excess = excess_stiffness(lattice, scene.material, cell_nodes(), displacements_of(dynamics), epsilon);
    return excess > kMuch ? printed("the mesh is coarse: its cells are bent or twisted, which makes the body some "
                                    "%.2g %% too stiff; cells of half the size make that a quarter",
                                    100 * excess)
                          : "";
}

std::vector<ProbeReading> Simulation::Implementation::read_probes() const {
    if (probes.empty()) {
        return {};
    }
    const std::vector<Vector3> support = reactions(), u = displacements_of(dynamics);
    std::vector<ProbeReading> readings;
    for (const ProbeNodes& probe : probes) {
        readings.push_back(read_probe(probe, rest, u, support, turned));
    }
    return readings;
}

MeteredState Simulation::Implementation::metered_state() const {
    MeteredState state;
    state.displacements = displacements_of(dynamics);
    state.forces = forces_of(dynamics);
    state.held.assign(supports.present().begin(), supports.present().end());
    state.accelerations.assign(supports.accelerations().begin(), supports.accelerations().end());
    const std::vector<NamedObstacleReading> readings = read_obstacles();
    for (std::size_t o = 0; o < readings.size(); ++o) {
        const ObstacleReading& reading = readings[o].reading;
        state.obstacles.push_back({obstacles.poses()[o].position, obstacles.angles()[o], reading.force, reading.torque,
                                   reading.kinetic, reading.work_of_gravity});
    }
    state.loads = loads;
    state.gravity = gravity;
    state.elastic = std::visit([](const auto& d) { return d.potential_energy().total(); }, dynamics);
    state.effects = effect_energies_of(dynamics);
    return state;
}

} // namespace hybmss
