#include "simulation/run/cutting.hpp"

#include "simulation/geometry/cells.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace hybmss {
namespace {

bool inside(const HalfSpace& half, const Vector3& x, double slack) {
    const Vector3 &p = half.point, &n = half.normal;
    const double height = (x[0] - p[0]) * n[0] + (x[1] - p[1]) * n[1] + (x[2] - p[2]) * n[2];
    return height <= slack * std::hypot(n[0], n[1], n[2]);
}

/// phi(J) by J - 1, see the model's description: quadratic, or by the mean stretch.
double volume_density(VolumeEnergy kind, double dilation) {
    if (kind == VolumeEnergy::quadratic) {
        return 0.5 * dilation * dilation;
    }
    const double J = 1 + dilation;
    if (J < 0.125) { // on in a straight line from there, of slope -6
        return 1.125 - 6 * (J - 0.125);
    }
    // cbrt(J) - 1 without cancellation
    const double c = std::cbrt(J), stretch = dilation / (c * c + c + 1);
    return 4.5 * stretch * stretch;
}

} // namespace

CutSchedule::CutSchedule(const std::vector<Cut>& cuts, double time_step)
    : cuts_(time_step > 0 ? cuts : std::vector<Cut>()), time_step_(time_step), done_(cuts_.size(), 0.0) {
    find_next();
}

long CutSchedule::step_of(std::size_t cut, double bite) const {
    // Up to rounding, a time of n steps comes after n steps.
    const double time = cuts_[cut].at + bite * cuts_[cut].every;
    return static_cast<long>(std::min(std::ceil(time / time_step_ * (1 - 1e-12)), 1e17));
}

long CutSchedule::next_step_of(std::size_t cut) const {
    const double length = cuts_[cut].until - cuts_[cut].at;
    const double bites = cuts_[cut].every > 0 ? std::floor(length / cuts_[cut].every * (1 + 1e-12)) + 1 : 1;
    return done_[cut] < bites ? step_of(cut, done_[cut]) : kNever;
}

void CutSchedule::find_next() {
    next_step_ = kNever;
    for (std::size_t c = 0; c < cuts_.size(); ++c) {
        next_step_ = std::min(next_step_, next_step_of(c));
    }
}

std::vector<std::size_t> CutSchedule::take(long step) {
    std::vector<std::size_t> due;
    for (std::size_t c = 0; c < cuts_.size(); ++c) {
        if (next_step_of(c) > step) {
            continue;
        }
        due.push_back(c);
        // On to the first bite after this step.
        const double past = static_cast<double>(step) * time_step_ - cuts_[c].at;
        done_[c] = std::max(done_[c] + 1, cuts_[c].every > 0 ? std::floor(past / cuts_[c].every) : 0);
        while (next_step_of(c) <= step) {
            ++done_[c];
        }
    }
    find_next();
    return due;
}

void CutSchedule::set_done(std::vector<double> done) {
    done_ = std::move(done);
    done_.resize(cuts_.size(), 0.0);
    find_next();
}

bool is_inside(const Cut& cut, const Vector3& point, double time, double cell_size) {
    Vector3 x = point; // as seen from the tool
    for (std::size_t a = 0; a < 3; ++a) {
        x[a] -= cut.velocity[a] * (time - cut.at);
    }
    return std::visit([&](const auto& tool) { return inside(tool, x, 1e-6 * cell_size); }, cut.tool);
}

Vector3 center_of(const BodyCell& cell, std::span<const Vector3> rest, std::span<const Vector3> displacements) {
    Vector3 center = {0, 0, 0};
    for (const std::uint32_t n : cell.corners) {
        for (std::size_t a = 0; a < 3; ++a) {
            center[a] += (rest[n][a] + (displacements.empty() ? 0 : displacements[n][a])) / 8;
        }
    }
    return center;
}

double cell_energy(const Material& material, double cell_size, double scale,
                   const std::array<Vector3, 8>& displacement) {
    const SpringConstants constants = spring_constants(material, cell_size);
    const bool means = material.springs == SpringForm::means;
    double energy = 0;
    const auto add_spring = [&](double k, const Vector3& r, const Vector3& du) {
        // q = |d|^2 - l^2 = 2 r.du + du.du,  |d| - l = q / (|d| + l)
        double length2 = 0, q = 0;
        for (unsigned axis = 0; axis < 3; ++axis) {
            length2 += r[axis] * r[axis];
            q += (2 * r[axis] + du[axis]) * du[axis];
        }
        const double stretch = q / (std::sqrt(std::max(length2 + q, 0.0)) + std::sqrt(length2));
        const double e = stretch / std::sqrt(length2);
        energy +=
            k * length2 * e * e * (0.5 + e * (material.stiffening.quadratic / 3 + material.stiffening.cubic / 4 * e));
    };
    for (unsigned a = 0; a < 8 && !means; ++a) {
        for (unsigned b = a + 1; b < 8; ++b) {
            const int axes = std::popcount(a ^ b);
            Vector3 r{}, du{};
            for (unsigned axis = 0; axis < 3; ++axis) {
                r[axis] = cell_size * (static_cast<double>(b >> axis & 1u) - static_cast<double>(a >> axis & 1u));
                du[axis] = displacement[b][axis] - displacement[a][axis];
            }
            add_spring(axes == 1   ? constants.edge / 4
                       : axes == 2 ? constants.face_diagonal / 2
                                   : constants.cube_diagonal,
                       r, du);
        }
    }
    if (means) {
        // The changes of a, b, c and the patterns, as in PatternConstants.
        std::array<Vector3, 3> change{}, pattern{};
        Vector3 fourth{};
        for (unsigned corner = 0; corner < 8; ++corner) {
            const auto side = [corner](std::size_t axis) { return corner >> axis & 1u ? 1.0 : -1.0; };
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const double u = displacement[corner][axis] - displacement[0][axis];
                    change[i][axis] += side(i) / 4 * u;
                    pattern[i][axis] += side((i + 1) % 3) * side((i + 2) % 3) / 8 * u;
                }
            }
            for (std::size_t axis = 0; axis < 3; ++axis) {
                fourth[axis] += side(0) * side(1) * side(2) / 8 * (displacement[corner][axis] - displacement[0][axis]);
            }
        }
        for (int code = 14; code < 27; ++code) { // one of each direction and its opposite
            const std::array<int, 3> sign = {code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1};
            const int axes = sign[0] * sign[0] + sign[1] * sign[1] + sign[2] * sign[2];
            Vector3 r{}, du{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                r[axis] = cell_size * sign[axis];
                du[axis] = sign[0] * change[0][axis] + sign[1] * change[1][axis] + sign[2] * change[2][axis];
            }
            add_spring(axes == 1   ? constants.edge
                       : axes == 2 ? constants.face_diagonal
                                   : constants.cube_diagonal,
                       r, du);
        }
        const PatternConstants k = pattern_constants(material, cell_size);
        double p[3][3] = {}, twist = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    p[i][j] += pattern[i][axis] * ((axis == j ? 1 : 0) + change[j][axis] / cell_size);
                }
            }
            twist += p[i][i];
        }
        energy += k.joint_twist * twist * twist / 2;
        for (const double g : fourth) {
            energy += k.fourth * g * g / 2;
        }
        for (std::size_t i = 0; i < 3; ++i) {
            energy += k.twist * p[i][i] * p[i][i] / 2;
            for (std::size_t j = 0; j < i; ++j) {
                energy += k.bending * (p[i][j] * p[i][j] + p[j][i] * p[j][i] + 2 * k.coupling * p[i][j] * p[j][i]) / 2;
            }
        }
    }
    const VolumeEnergy kind = resolved_volume_energy(material);
    if (kind != VolumeEnergy::none || material.crush.any()) {
        const double dilation = volume_ratio_minus_one(displacement, {0, 1, 2, 3, 4, 5, 6, 7}, cell_size);
        const double depth = std::max(material.crush.ratio - 1 - dilation, 0.0);
        const double of_volume =
            kind != VolumeEnergy::none ? volume_modulus(material) * volume_density(kind, dilation) : 0;
        energy += cell_size * cell_size * cell_size * (of_volume + crush_modulus(material) * depth * depth * depth / 3);
    }
    return scale * energy;
}

bool Simulation::Implementation::changing() const {
    const double end = std::min(std::ceil(scene.solver.duration / time_step), 1e17);
    return moving() || (!is_static() && time() < tables_end) ||
           (!is_static() && static_cast<double>(schedule.next_step()) <= end);
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
    const Material material = material_of(lattice, lattice.cell_tissue(cell.cell), scene.material);
    const double h = lattice.cell_size(),
                 mass = material.density * h * h * h / 8 * static_cast<double>(lattice.cell_fill(cell.cell));
    const Vector3& g = gravity;
    std::array<Vector3, 8> u{};
    double energy = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const std::uint32_t n = cell.corners[corner];
        u[corner] = displacements[n];
        for (std::size_t a = 0; a < 3; ++a) {
            energy += mass * (0.5 * velocities[n][a] * velocities[n][a] - g[a] * u[corner][a]);
        }
    }
    return energy + cell_energy(material, h, static_cast<double>(lattice.cell_scales()[cell.cell]), u);
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
    if (remove_from_dynamics) {
        remove_from_dynamics(lattice, listed);
    } else {
        on_explicit([&](auto& d) { d.remove_cells(lattice, listed); });
    }
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
    spread_loads();
    probes = probes_of(scene, rest, turned, supports);
}

void Simulation::Implementation::cut_now() {
    if (schedule.next_step() > steps) {
        return;
    }
    const std::vector<std::size_t> due = schedule.take(steps);
    if (parted) {
        part_more(faces_in_tools(due));
        return;
    }
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
    (void)lattice(); // which only cubes have
    if (body.parted) {
        throw std::invalid_argument("cells of a body that may part cannot be removed: it is a network");
    }
    if (!explicit_in_time(body.scene.solver.method)) {
        throw std::invalid_argument(
            "cells are cut only while a body moves by symplectic-euler or leapfrog, not with method = \"" +
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

std::vector<std::array<std::uint32_t, 8>> Simulation::Implementation::cell_nodes() const {
    if (other) {
        return {};
    }
    if (parted) {
        return parted->body.corners;
    }
    if (cells.empty()) {
        return cell_corners(lattice);
    }
    std::vector<std::array<std::uint32_t, 8>> present;
    for (const BodyCell& cell : cells) {
        if (lattice.cell_scales()[cell.cell] > 0) {
            present.push_back(cell.corners);
        }
    }
    return present;
}

} // namespace hybmss
