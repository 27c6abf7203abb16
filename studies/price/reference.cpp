#include "studies/price/reference.hpp"

#include "simulation/accuracy/mesh_convergence.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/run/readings.hpp"
#include "simulation/scene/scene_body.hpp"
#include "studies/calculix/problem.hpp"
#include "studies/calculix/program.hpp"

#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace hybmss::price {
namespace {

using paper::Kind;

constexpr double kPoissonRatio = 0.3; // so that the volume force has its part
constexpr double kStrain = 1e-5, kSettled = 1e-4, kGravity = 1e-5;

Scene make_scene(Kind kind, int across) {
    Scene scene = paper::scene(experiment(kind, across));
    if (kind == Kind::beam) {
        scene.gravity.acceleration = {0, -kGravity, 0};
    }
    return scene;
}

/// Of the slowest motion, 1/s: a shear wave between both plates, or a cantilever's first bending
/// 3.516 / L^2 sqrt(E I / (rho A)), I/A = w^2 / 12.
double slowest_frequency(const Scene& scene, Kind kind) {
    const Material& m = scene.material;
    const double w = scene.body.cell_size * static_cast<double>(scene.body.cells[0]);
    if (kind == Kind::beam) {
        const double length = scene.body.cell_size * static_cast<double>(scene.body.cells[2]);
        return 3.516 / (length * length) * std::sqrt(m.young_modulus * w * w / (12 * m.density));
    }
    return std::numbers::pi / w * std::sqrt(shear_modulus(m) / m.density);
}

void set_method(Scene& scene, Kind kind, Method method) {
    if (method == Method::static_solve) {
        scene.solver.method = SolverMethod::static_equilibrium;
        return;
    }
    const double omega = slowest_frequency(scene, kind);
    scene.damping.mass = 2 * omega;
    scene.solver.method =
        method == Method::implicit_settling ? SolverMethod::backward_euler : SolverMethod::symplectic_euler;
    for (Move& move : scene.moves) {
        move.over = 1 / omega;
    }
    if (method == Method::paper_settling) {
        scene.solver.duration = 10;
        scene.solver.time_step = kind == Kind::beam ? 10 / 3e5 : 10 / 1e4;
    } else {
        scene.solver.duration = 100 / omega;
        scene.solver.tolerance = kSettled;
        if (method == Method::implicit_settling) {
            scene.solver.time_step = 1 / omega;
        }
    }
}

/// `corners` are the displacements of the cells' corners.
std::vector<double> read_values(Kind kind, const ProbeReading& plate, double volume_change, const GridField& corners) {
    const std::size_t axis = paper::response_axis(kind);
    switch (kind) {
    case Kind::compression:
        return {std::abs(plate.force[axis]), volume_change};
    case Kind::torsion:
        return {std::abs(plate.torque[axis])};
    case Kind::beam: {
        // In the middle of the free end: a mean over nodes would depend on where the mesh has them.
        const auto [nx, ny, nz] = corners.cells;
        return {std::abs(corners.values[corners.node(nx / 2, ny / 2, nz)][axis])};
    }
    default:
        return {std::abs(plate.force[axis])};
    }
}

/// Of the volume that 20-node elements fill, by cells so small that their plane faces follow the curved ones.
double quadratic_volume_change(const Outcome& outcome) {
    const GridField fine = outcome.refined(4);
    const Lattice lattice = Lattice::box(fine.cells[0], fine.cells[1], fine.cells[2], fine.cell_size);
    return measure_volume_change(fine.values, cell_corners(lattice), fine.cell_size).relative_volume_change;
}

} // namespace

std::vector<Kind> problems() {
    return {Kind::compression, Kind::shear, Kind::torsion, Kind::beam};
}

std::string_view name(Quantity quantity) {
    constexpr std::string_view names[] = {"force", "volume change", "torque", "deflection"};
    return names[static_cast<std::size_t>(quantity)];
}

std::vector<Quantity> quantities(Kind kind) {
    switch (kind) {
    case Kind::compression:
        return {Quantity::force, Quantity::volume_change};
    case Kind::torsion:
        return {Quantity::torque};
    case Kind::beam:
        return {Quantity::deflection};
    default:
        return {Quantity::force};
    }
}

paper::Experiment experiment(Kind kind, int across) {
    const double degrees = 180 / std::numbers::pi * kStrain;
    return {.kind = kind,
            .amount = kind == Kind::torsion ? degrees
                      : kind == Kind::beam  ? 0
                                            : 100 * kStrain,
            .poisson_ratio = kPoissonRatio,
            .young_modulus = kind == Kind::beam ? 1e7 : 1e4,
            .across = across};
}

std::string_view name(Method method) {
    constexpr std::string_view names[] = {"static", "explicit settling", "the paper's steps", "backward Euler"};
    return names[static_cast<std::size_t>(method)];
}

GridField Outcome::refined(int factor) const {
    return mesh.elements.empty() ? field.refined(factor) : refined_quadratic(mesh, displacements, field.cells, factor);
}

Outcome solve_lattice(Kind kind, int across, paper::Model model, Method method, Precision precision) {
    Scene scene = make_scene(kind, across);
    scene.material = paper::with_model(scene.material, model);
    set_method(scene, kind, method);
    SimulationOptions options;
    options.precision = precision;
    options.plan.threads = 1;
    Outcome outcome;
    outcome.field.cells = paper::mesh(experiment(kind, across));
    outcome.field.cell_size = scene.body.cell_size;
    const auto start = std::chrono::steady_clock::now();
    Simulation simulation(std::move(scene), options);
    const Summary summary = simulation.run();
    outcome.field.values = simulation.displacements();
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    outcome.failure = summary.failure;
    outcome.steps = method == Method::static_solve ? summary.work.cg_iterations : summary.steps;
    outcome.values = read_values(kind, summary.probes.at(0), summary.volume.relative_volume_change, outcome.field);
    return outcome;
}

Outcome solve_calculix(Kind kind, int across, calculix::ElementType type) {
    const Scene scene = make_scene(kind, across);
    const calculix::Problem problem = calculix::scene_problem(scene, type, calculix::Geometry::linear);
    if (!calculix::is_installed()) {
        throw std::runtime_error(calculix::kNotInstalled);
    }
    Outcome outcome;
    outcome.field.cells = paper::mesh(experiment(kind, across));
    outcome.field.cell_size = scene.body.cell_size;
    calculix::Solution solution;
    try {
        solution = calculix::solve(problem);
    } catch (const std::runtime_error& error) {
        outcome.failure = error.what();
        return outcome;
    }
    const std::span<const std::array<double, 3>> rest = problem.mesh.rest;
    const std::vector<std::uint32_t> nodes = select_nodes(rest, scene.body.cell_size, scene.probes.at(0).where);
    const ProbeNodes probe{"plate", nodes, rest_centroid(rest, nodes)};
    const ProbeReading plate = read_probe(probe, rest, solution.displacements, solution.support);
    outcome.seconds = solution.seconds;
    outcome.field.values.assign(solution.displacements.begin(),
                                solution.displacements.begin() +
                                    static_cast<std::ptrdiff_t>(problem.mesh.lattice_nodes));
    double volume_change =
        measure_volume_change(outcome.field.values, cell_corners(scene_lattice(scene)), scene.body.cell_size)
            .relative_volume_change;
    if (type == calculix::ElementType::c3d20) {
        outcome.mesh = problem.mesh;
        outcome.displacements = std::move(solution.displacements);
        volume_change = quadratic_volume_change(outcome);
    }
    outcome.values = read_values(kind, plate, volume_change, outcome.field);
    return outcome;
}

namespace {

double order_of(double coarse_change, double fine_change, double expected) {
    const double order = std::log2(std::abs(coarse_change / fine_change));
    return coarse_change * fine_change > 0 && order > 0.5 && order < 4 ? order : expected;
}

double share(double order) {
    return 1 / (std::exp2(order) - 1);
}

double limit(double coarse, double middle, double fine, double expected, double& order) {
    order = order_of(middle - coarse, fine - middle, expected);
    return fine + share(order) * (fine - middle);
}

/// The finest field with what is still missing added; that is known on every other node, and smooth.
GridField limit(const GridField& coarse, const GridField& middle, const GridField& fine, double expected) {
    const auto size = [](const GridField& a, const GridField& b) { return field_error(a, b).l2; };
    const double order = order_of(size(coarse, middle.coarsened(2)), size(middle, fine.coarsened(2)), expected);
    const GridField missing = combined(share(order), fine.coarsened(2), -share(order), middle);
    return combined(1, fine, 1, missing.refined(2));
}

} // namespace

Extrapolation extrapolate(const std::vector<double>& q, double expected_order) {
    if (q.size() != 4) {
        throw std::invalid_argument("extrapolate: " + std::to_string(q.size()) + " values; four are needed");
    }
    Extrapolation result;
    double coarse_order = 0;
    const double before = limit(q[0], q[1], q[2], expected_order, coarse_order);
    result.value = limit(q[1], q[2], q[3], expected_order, result.order);
    result.uncertainty = std::abs(before / result.value - 1);
    return result;
}

Reference make_reference(paper::Kind kind, int finest, const std::function<void(const std::string&)>& progress) {
    Reference reference;
    reference.kind = kind;
    reference.finest = finest;
    reference.expected_order = 2 * clamped_edge_exponent(experiment(kind, finest).poisson_ratio);
    for (int across = finest / 8; across <= finest; across *= 2) {
        progress(paper::key(experiment(kind, across)) + " for the reference");
        Outcome outcome = solve_lattice(kind, across, paper::Model::hybmss, Method::static_solve, Precision::float64);
        if (!outcome.good()) {
            throw std::runtime_error(paper::key(experiment(kind, across)) + ": " + outcome.failure);
        }
        reference.solutions[across] = std::move(outcome);
    }
    for (std::size_t v = 0; v < quantities(kind).size(); ++v) {
        std::vector<double> values;
        for (const auto& [across, outcome] : reference.solutions) {
            values.push_back(outcome.values[v]);
        }
        reference.values.push_back(extrapolate(values, reference.expected_order));
    }
    const auto field = [&](int part) -> const GridField& { return reference.solutions.at(finest / part).field; };
    reference.field = limit(field(4), field(2), field(1), reference.expected_order);
    const GridField before = limit(field(8), field(4), field(2), reference.expected_order);
    reference.field_uncertainty = field_error(before, reference.field.coarsened(2)).l2;
    return reference;
}

} // namespace hybmss::price
