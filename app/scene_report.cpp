#include "app/scene_report.hpp"

#include "simulation/geometry/cells.hpp"
#include "simulation/run/memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

namespace hybmss {
namespace {

std::string vector_text(const std::array<double, 3>& v) {
    return fmt::format("{:>12.6g} {:>12.6g} {:>12.6g}", v[0], v[1], v[2]);
}

struct Rows {
    std::string text;
    void operator()(std::string_view label, const std::string& value) {
        fmt::format_to(std::back_inserter(text), "{:<24} {}\n", label, value);
    }
    void vectors(std::string_view label) { (*this)(label, fmt::format("{:>12} {:>12} {:>12}", "x", "y", "z")); }
};

void add_probes(Rows& row, const Summary& s, const std::string& owner = "") {
    for (const ProbeReading& probe : s.probes) {
        row.vectors(fmt::format("{}probe {}", owner, probe.name));
        row("  force (N)", vector_text(probe.force));
        row("  torque (N m)", vector_text(probe.torque));
        row("  mean displacement (m)", vector_text(probe.mean_displacement));
        row("  max displacement (m)", fmt::format("{:>12.6g}", probe.max_displacement));
    }
}

void add_obstacles(Rows& row, const Summary& s, const std::string& owner = "") {
    for (const auto& [name, reading, stiffness, pose] : s.obstacles) {
        row.vectors(fmt::format("{}obstacle {}", owner, name));
        row("  force (N)", vector_text(reading.force));
        row("  torque (N m)", vector_text(reading.torque));
        row("  impulse (N s)", vector_text(reading.impulse));
        row("  contact (J)", fmt::format("stored {:.6g}, dissipated {:.6g}; stiffness {:.3g} Pa/m", reading.energy,
                                         reading.dissipated, stiffness));
        row("  depth (m)",
            fmt::format("{:.3g} of {} nodes, {:.3g} on the way", reading.depth, reading.nodes, reading.greatest_depth));
        if (pose) {
            row("  position (m)", vector_text(pose->position));
            row("  velocity (m/s)", vector_text(pose->velocity));
            row("  turns by (rad/s)", vector_text(pose->angular_velocity));
        }
    }
}

void add_volume(Rows& row, const Summary& s) {
    row("relative volume change", fmt::format("{:.4f} %", 100 * s.volume.relative_volume_change));
    row("cell volume ratio",
        fmt::format("{:.6g} ... {:.6g}", s.volume.min_cell_volume_ratio, s.volume.max_cell_volume_ratio));
}

std::string price_text(const AccuracyOffer& offer) {
    return fmt::format("{} x {} x {} cells in {}, {:.2g} GB, some {:.2g} s{}", offer.cells[0], offer.cells[1],
                       offer.cells[2], name(offer.precision), offer.bytes / 1e9, offer.seconds,
                       offer.fits ? "" : ": more than this machine has room for");
}

} // namespace

std::string other_cells_line(const Simulation& simulation) {
    std::array<std::size_t, 7> counts{};
    for (const Network::Polyhedron& cell : simulation.other_cells()->network.polyhedra) {
        ++counts[cell.node_count()];
    }
    std::string line;
    for (const auto& [nodes, name] : {std::pair{4, "tetrahedra"}, {5, "pyramids"}, {6, "prisms"}}) {
        if (const std::size_t count = counts[static_cast<std::size_t>(nodes)]; count > 0) {
            line += fmt::format("{}{} {}", line.empty() ? "" : ", ", count, name);
        }
    }
    return line;
}

std::string fit_line(const FittedCells& fitted) {
    return fmt::format("anisotropy {:.3g} %, error of the shear modulus {:.3g} %, misfit around nodes {:.3g} %; {} "
                       "pairs of nodes without a spring",
                       100 * fitted.anisotropy, 100 * fitted.modulus_error, 100 * fitted.misfit, fitted.without);
}

std::string body_line(const Simulation& simulation, const SimulationOptions& options) {
    if (const FittedCells* const other = simulation.other_cells()) {
        return fmt::format("{}, {} nodes, {} springs{}", other_cells_line(simulation), simulation.node_count(),
                           simulation.describe().springs,
                           simulation.scene().body.shape == SceneCells::mesh ? "; fitted: " + fit_line(*other) : "");
    }
    const Lattice& lattice = simulation.lattice();
    const auto grid = lattice.cells();
    const std::size_t filled = lattice.cell_count();
    std::string line = fmt::format("{} x {} x {} cells", grid[0], grid[1], grid[2]);
    if (filled < lattice.cell_scales().size()) {
        line = fmt::format("{} cells of a grid of {} x {} x {}", filled, grid[0], grid[1], grid[2]);
    }
    if (const std::string& resampled = simulation.scene().body.resampled; !resampled.empty()) {
        line = fmt::format("{}; {}", resampled, line);
    }
    return line + fmt::format(", {} nodes, {} springs, about {:.3g} MB", simulation.node_count(),
                              simulation.describe().springs, estimated_bytes(simulation.scene().body, options) / 1e6);
}

std::string parts_line(const Simulation& simulation) {
    if (simulation.other_cells() != nullptr) {
        return "";
    }
    constexpr std::size_t kShown = 5;
    const std::vector<std::size_t> parts = cell_parts(simulation.lattice());
    if (parts.size() < 2) {
        return "";
    }
    std::string sizes;
    const std::size_t shown = parts.size() <= kShown + 1 ? parts.size() : kShown;
    for (std::size_t p = 0; p < shown; ++p) {
        sizes += (p == 0 ? "" : p + 1 == parts.size() ? " and " : ", ") + std::to_string(parts[p]);
    }
    if (shown < parts.size()) {
        const auto rest = std::accumulate(parts.begin() + kShown, parts.end(), std::size_t{0});
        sizes += fmt::format(" cells, and {} more parts of {} cells in all", parts.size() - shown, rest);
    } else {
        sizes += " cells";
    }
    return fmt::format("{} parts that share no face with each other: {}", parts.size(), sizes);
}

std::string labels_line(const Scene& scene) {
    std::array<std::size_t, 256> counts{};
    for (std::uint8_t value : scene.body.labels) {
        ++counts[value];
    }
    std::string line;
    for (std::size_t value = 1; value < counts.size(); ++value) {
        if (counts[value] == 0) {
            continue;
        }
        const auto label = std::find_if(scene.labels.begin(), scene.labels.end(),
                                        [value](const Label& each) { return each.value == value; });
        const Material own = label == scene.labels.end() ? scene.material : material_of(*label, scene.material);
        line +=
            fmt::format("{}{}: {} cells of {:g} Pa", line.empty() ? "" : "; ", value, counts[value], own.young_modulus);
        if (!(own.young_modulus > 0)) {
            line += ", left out";
            continue;
        }
        line += own.poisson_ratio == scene.material.poisson_ratio ? "" : fmt::format(", nu {:g}", own.poisson_ratio);
        line += own.density == scene.material.density ? "" : fmt::format(", {:g} kg/m^3", own.density);
    }
    return line;
}

std::string fills_line(const Simulation& simulation) {
    const Lattice& lattice = simulation.lattice();
    const std::vector<float> fills = values_of_cells(lattice, lattice.fills());
    if (fills.empty()) {
        return "";
    }
    const auto cut = std::count_if(fills.begin(), fills.end(), [](float fill) { return fill != 1; });
    return fmt::format("{} of {} cells are not whole; {:.6g} m^3 by their fills, {:.6g} m^3 inside the surface", cut,
                       fills.size(),
                       std::accumulate(fills.begin(), fills.end(), 0.0) * std::pow(lattice.cell_size(), 3),
                       simulation.scene().body.surface_volume);
}

std::string slice_lines(const Simulation& simulation, std::size_t axis) {
    constexpr int kWidest = 100; // characters; of larger grids every second or so many cells
    const Lattice& lattice = simulation.lattice();
    const std::array<int, 3>& cells = lattice.cells();
    const std::size_t across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    const int step = std::max(1, (std::max(cells[across], cells[up]) + kWidest - 1) / kWidest);
    std::array<int, 3> at{};
    at[axis] = cells[axis] / 2;
    std::string lines =
        fmt::format("  layer {} of {} along {}, {} to the right, {} upwards{}\n", at[axis], cells[axis], "xyz"[axis],
                    "xyz"[across], "xyz"[up], step > 1 ? fmt::format(", one of {} cells each way", step) : "");
    for (at[up] = cells[up] - 1; at[up] >= 0; at[up] -= step) {
        lines += "  ";
        for (at[across] = 0; at[across] < cells[across]; at[across] += step) {
            const std::size_t cell = lattice.cell_index(at[0], at[1], at[2]);
            const auto& labels = simulation.scene().body.labels;
            const int label = labels.empty() ? 0 : labels[cell];
            lines += !(lattice.cell_scales()[cell] > 0) ? '.'
                     : lattice.cell_fill(cell) < 0.5F   ? '-'
                     : label == 0 || label > 35         ? '#'
                     : label < 10                       ? static_cast<char>('0' + label)
                                                        : static_cast<char>('a' + label - 10);
        }
        lines += '\n';
    }
    return lines;
}

std::string summary_table(const Simulation& simulation, const Summary& s) {
    Rows row;
    row("kernel", fmt::format("{}, {}, {}, {}, threads {}", s.plan.kernel, s.plan.layout, name(s.plan.instruction_set),
                              s.plan.precision, s.plan.threads));
    const SolverMethod method = simulation.scene().solver.method;
    if (!s.modes.empty()) {
        const bool buckling = method == SolverMethod::buckling;
        row(buckling ? "buckling" : "modes",
            fmt::format("{:>14}   {}{}", buckling ? "times the load" : "frequency (Hz)", "residual",
                        buckling
                            ? ""
                            : fmt::format("   about {}, {} motions of the whole body left out",
                                          s.work.load_steps > 0 ? "the loaded equilibrium" : "rest", s.rigid_motions)));
        for (std::size_t m = 0; m < s.modes.size(); ++m) {
            row(fmt::format("  {}", m), fmt::format("{:>14.8g}   {:.1e}", s.modes[m].value, s.modes[m].residual));
        }
        row("preconditioner", s.work.preconditioner);
    }
    if (timeless(method) && (s.modes.empty() || s.work.load_steps > 0)) {
        row("load steps", fmt::format("{} and {} failed ones, to {:.6g} % of the loading", s.work.load_steps,
                                      s.work.failed_load_steps, 100 * s.time));
        row("converged", fmt::format("{} (residual {:.3g})", s.converged ? "yes" : "no", s.settlement.residual));
    } else if (!timeless(method)) {
        row("steps", fmt::format("{} of {:.6g} s (stable: {:.6g} s), t = {:.6g} s", s.steps, s.time_step,
                                 s.critical_time_step, s.time));
        row("settled", fmt::format("{} (residual {:.3g}, kinetic ratio {:.3g})", s.converged ? "yes" : "no",
                                   s.settlement.residual, s.settlement.kinetic_ratio));
    }
    if (s.work.newton_iterations > 0) {
        row("iterations", fmt::format("{} of Newton's method, {} of conjugate gradients ({})", s.work.newton_iterations,
                                      s.work.cg_iterations, s.work.preconditioner));
    }
    if (s.accuracy) {
        const AccuracyReport& a = *s.accuracy;
        row("estimated error", fmt::format("{:.2g} ({}; wanted {:g})", a.error_estimate,
                                           a.quantity.empty() ? "the tolerance's" : a.quantity, a.wanted));
        for (const AccuracyMesh& mesh : a.meshes) {
            row("  mesh",
                fmt::format("{} x {} x {} cells, {:.3g} s{}", mesh.cells[0], mesh.cells[1], mesh.cells[2], mesh.seconds,
                            std::isfinite(mesh.error_estimate)
                                ? fmt::format(", estimated error {:.2g}", mesh.error_estimate)
                                : ""));
        }
        for (const AccuracyOffer& offer : a.offers) {
            if (offer.accuracy < a.wanted) {
                row("  accuracy", fmt::format("{:g} would take {}", offer.accuracy, price_text(offer)));
            }
        }
    }
    add_volume(row, s);
    if (s.stress) {
        const auto& [x, y, z] = s.stress->where;
        row("stress", fmt::format("von Mises at most {:.6g} Pa, in the cell at rest at ({:.4g}, {:.4g}, {:.4g}) m",
                                  s.stress->max_von_mises, x, y, z));
    }
    row("energy (J)", fmt::format("springs {:.6g}, volume {:.6g}, kinetic {:.3g}, external {:.6g}", s.energies.springs,
                                  s.energies.volume, s.energies.kinetic, s.energies.external));
    if (s.removed_cells > 0) {
        row("cut away", fmt::format("{} cells, with {:.6g} J", s.removed_cells, s.energies.removed));
    }
    if (s.parted_faces > 0) {
        row("parted",
            fmt::format("{} faces between cells; energy changed by {:.3g} J", s.parted_faces, s.parting_energy));
    }
    for (const EffectEnergy& effect : s.energies.effects) {
        row(effect.name + " (J)", fmt::format("stored {:.6g}, dissipated {:.6g}", effect.stored, effect.dissipated));
    }
    if (s.balance) {
        const EnergyBalance& b = *s.balance;
        row("work (J)", fmt::format("supports {:.6g}, loads {:.6g}, gravity {:.6g}, obstacles {:.6g}", b.supports,
                                    b.loads, b.gravity, b.obstacles));
        row("  became", fmt::format("kinetic {:.6g}, elastic {:.6g}, in effects {:.6g}", b.kinetic + b.free_obstacles,
                                    b.elastic, b.effects));
        row("  and was lost to",
            fmt::format("mass damping {:.6g}, effects {:.6g}", b.mass_damping, b.effects_dissipated));
        row("  up to", fmt::format("{:.3g} J, {:.2g} of the largest part", b.imbalance(), b.relative_imbalance()));
    }
    add_obstacles(row, s);
    add_probes(row, s);
    row("wall time", fmt::format("{:.3f} s", s.wall_seconds));
    return row.text;
}

std::string summary_line(const Simulation& simulation, const Summary& s) {
    const bool still = timeless(simulation.scene().solver.method);
    return fmt::format("{} ({}), {} cells, volume change {:.4f} %, {:.2f} s",
                       s.converged ? (still ? "converged" : "settled") : (still ? "not converged" : "not settled"),
                       !s.modes.empty()
                           ? fmt::format("{} {}, the first {:.6g}", s.modes.size(),
                                         s.method == SolverMethod::buckling ? "factors" : "modes", s.modes[0].value)
                       : still ? fmt::format("{} Newton iterations", s.work.newton_iterations)
                               : fmt::format("{} steps", s.steps),
                       simulation.cell_count(), 100 * s.volume.relative_volume_change, s.wall_seconds);
}

std::string summary_table(const WorldSimulation& world, const WorldSummary& s) {
    Rows row;
    row("steps", fmt::format("{} of {:.6g} s (stable: {:.6g} s), t = {:.6g} s", s.steps, s.time_step,
                             s.critical_time_step, s.time));
    row("settled", fmt::format("{} (residual {:.3g}, kinetic ratio {:.3g})", s.converged ? "yes" : "no",
                               s.settlement.residual, s.settlement.kinetic_ratio));
    for (std::size_t b = 0; b < s.bodies.size(); ++b) {
        const Summary& body = s.bodies[b];
        row("body " + world.name(b),
            fmt::format("{}, {}, threads {}", body.plan.kernel, body.plan.layout, body.plan.threads));
        add_volume(row, body);
        row("energy (J)",
            fmt::format("springs {:.6g}, volume {:.6g}, kinetic {:.3g}, external {:.6g}", body.energies.springs,
                        body.energies.volume, body.energies.kinetic, body.energies.external));
        add_obstacles(row, body, world.name(b) + ": ");
        add_probes(row, body, world.name(b) + ": ");
    }
    for (const auto& [first, second, reading] : s.contacts) {
        row.vectors(fmt::format("contact {}, {}", first, second));
        row("  force (N)", vector_text(reading.force));
        row("  impulse (N s)", vector_text(reading.impulse));
        row("  depth (m)",
            fmt::format("{:.3g} of {} nodes, {:.3g} on the way", reading.depth, reading.nodes, reading.greatest_depth));
    }
    for (const AttachmentReading& tied : s.attachments) {
        row.vectors(fmt::format("attached {}, {}", tied.from, tied.to.empty() ? "space" : tied.to));
        row("  force (N)", fmt::format("{} of {} ties", vector_text(tied.force), tied.ties));
    }
    row("wall time", fmt::format("{:.3f} s", s.wall_seconds));
    return row.text;
}

std::string summary_line(const WorldSimulation& world, const WorldSummary& s) {
    std::size_t cells = 0;
    for (std::size_t b = 0; b < world.body_count(); ++b) {
        cells += world.body(b).cell_count();
    }
    return fmt::format("{} ({} steps), {} bodies of {} cells, {:.2f} s", s.converged ? "settled" : "not settled",
                       s.steps, s.bodies.size(), cells, s.wall_seconds);
}

std::string candidate_lines(const PlanDescription& plan) {
    std::string lines;
    for (const CandidateFigure& figure : plan.candidates) {
        lines += fmt::format("  {:<52} {:8.3g} ns a cell and step{}\n", figure.name, figure.ns_per_cell_step,
                             figure.finalist ? "" : ", dropped early");
    }
    return lines;
}

} // namespace hybmss
