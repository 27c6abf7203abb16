// The benchmarks that the studies have, and the one of them that is theirs alone: the equilibrium solver.

#include "app/bench_arguments.hpp"
#include "bench/interleaved.hpp"
#include "hybmss/equilibrium.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "plan/bodies/layout_table.hpp"
#include "simulation/geometry/cells.hpp"
#include "solvers/multigrid/float_multigrid.hpp"
#include "solvers/newton/conjugate_gradients.hpp"
#include "solvers/newton/preconditioner.hpp"
#include "studies/calculix/program.hpp"
#include "studies/commands.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using namespace hybmss;
using namespace hybmss::bench;

constexpr const char* kIntroduction =
    "cg: iterations of conjugate gradients for random forces on an undeformed cube with two opposite faces clamped, "
    "until\n"
    "the residual's norm sqrt(r . B r) has fallen to 1e-8, B the preconditioner; `products`: the same time in Hessian\n"
    "products; `setup` is paid once for several Newton steps. static: the cube compressed by 20 % between clamped "
    "plates\n"
    "from rest to a residual of 1e-8; `x ccx`: CalculiX (C3D8I, NLGEOM, same mesh, its own stepping, one thread) over "
    "it.\n"
    "mesh: a cube of 5 m compressed likewise, with crush resistance 20, to 1e-6; `products`: the time in Hessian "
    "products\n"
    "at that size, `e`: loss of volume, `force`: of the plate, `least`: the least volume ratio of a cell, `B/cell`: "
    "the\n"
    "most memory that the process held meanwhile, displacements too, beyond what it held before.\n"
    "euler: backward Euler at 100 times the critical step, to 1e-6: a cube of 5 m with its lower face clamped, in a "
    "weight "
    "that\n"
    "grows from nothing and turns once in 12 steps, the first 12 left out; medians a step. `steps`: the time of one in "
    "explicit\n"
    "steps.\n"
    "Doubles.\n";

constexpr double kCellSize = 0.5;

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The nodes of both faces normal to y, the upper ones moved by `shift` along it.
std::vector<PrescribedNode> clamped_faces(const Lattice& lattice, double shift) {
    const double height = lattice.cells()[1] * lattice.cell_size();
    std::vector<PrescribedNode> held;
    std::uint32_t number = 0;
    for (std::uint32_t grid_node : lattice.nodes()) {
        const double y = lattice.rest_position(grid_node)[1];
        if (y == 0 || y == height) {
            held.push_back({number, 7, {0, y == 0 ? 0 : shift, 0}, {0, 0, 0}});
        }
        ++number;
    }
    return held;
}

PlanOptions plan_options(int threads) {
    PlanOptions options;
    options.threads = threads;
    return options;
}

void measure_cg(benchmark::State& state, int edge, double poisson_ratio, PreconditionerKind kind, int threads) {
    const Lattice lattice = Lattice::box(edge, edge, edge, kCellSize);
    const Material material{.poisson_ratio = poisson_ratio};
    const auto body = make_body<double>(lattice, material, plan_options(threads));
    Potential<double> potential(*body, BodyScales::of(lattice, material), SolidCells::of(lattice),
                                Sections::of(lattice));
    potential.prescribe(clamped_faces(lattice, 0));
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> draw(-1, 1);
    std::vector<std::array<double, 3>> forces(body->node_count());
    for (auto& f : forces) {
        for (double& x : f) {
            x = draw(engine);
        }
    }
    potential.load(forces, {0, 0, 0});
    State<double> at_rest = body->make_state(false);
    const VectorSpace<double>& space = potential.space();
    NodeVector<double> gradient = space.make(), step = space.make(), product = space.make();
    potential.gradient(at_rest, gradient);
    potential.linearise(at_rest);
    std::unique_ptr<Preconditioner<double>> preconditioner = std::make_unique<BlockJacobi<double>>();
    if (kind == PreconditionerKind::multigrid) {
        preconditioner = std::make_unique<FloatMultigrid>(*body, lattice, material, plan_options(threads));
    }
    ConjugateGradients<double> cg(space);
    preconditioner->update(potential); // once for what is allocated then
    std::vector<double> setups, solves, products;
    CgResult result;
    for ([[maybe_unused]] auto _ : state) {
        auto start = Clock::now();
        preconditioner->update(potential);
        setups.push_back(seconds_since(start));
        start = Clock::now();
        result = cg.solve(potential, *preconditioner, gradient, {.relative_residual = 1e-8, .iterations = 20000}, step);
        solves.push_back(seconds_since(start));
        start = Clock::now();
        constexpr int kProducts = 10;
        for (int i = 0; i < kProducts; ++i) {
            potential.multiply(gradient, product);
        }
        products.push_back(seconds_since(start) / kProducts);
        state.SetIterationTime(setups.back() + solves.back());
    }
    if (result.end != CgEnd::converged) {
        state.SkipWithError("conjugate gradients did not converge");
        return;
    }
    state.counters["iterations"] = result.iterations;
    state.counters["setup_seconds"] = median(setups);
    state.counters["solve_seconds"] = median(solves);
    state.counters["products"] = median(solves) / median(products);
}

std::string cg_line(const std::string& name, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-44s %10.0f %10.2f %10.2f %10.0f", name.c_str(), counter(run, "iterations"),
                   1e3 * counter(run, "setup_seconds"), 1e3 * counter(run, "solve_seconds"), counter(run, "products"));
}

constexpr int kStaticEdge = 10;
constexpr double kStaticStrain = 0.2;

/// The cube that both programs compress.
Lattice static_cube() {
    return Lattice::box(kStaticEdge, kStaticEdge, kStaticEdge, kCellSize);
}
constexpr double kStaticShift = -kStaticStrain * kStaticEdge * kCellSize;

/// CalculiX runs once for each Poisson's ratio, beside the first row that asks; nothing where it fails.
std::optional<calculix::Solution> calculix_beside(double poisson_ratio) {
    static std::map<double, std::optional<calculix::Solution>> runs;
    const auto found = runs.find(poisson_ratio);
    if (found != runs.end()) {
        return found->second;
    }
    std::optional<calculix::Solution>& run = runs[poisson_ratio];
    calculix::Problem problem{calculix::brick_mesh(static_cube(), calculix::ElementType::c3d8i),
                              {.poisson_ratio = poisson_ratio},
                              {},
                              calculix::Geometry::nonlinear,
                              calculix::Law::linear};
    problem.loading.supports = clamped_faces(static_cube(), kStaticShift);
    try {
        run = calculix::solve(problem);
    } catch (const std::runtime_error&) {
        run.reset();
    }
    return run;
}

/// What the upper plate exerts along y, N.
double plate_force(const calculix::Solution& run) {
    double force = 0;
    const std::vector<PrescribedNode> held = clamped_faces(static_cube(), kStaticShift);
    for (const PrescribedNode& node : held) {
        force += node.displacement[1] != 0 ? run.support[node.node][1] : 0;
    }
    return std::abs(force);
}

void measure_static(benchmark::State& state, double poisson_ratio, PreconditionerKind kind, int threads) {
    const Lattice lattice = static_cube();
    Loading loading;
    loading.supports = clamped_faces(lattice, kStaticShift);
    EquilibriumOptions options;
    options.preconditioner = kind;
    std::vector<double> times, u;
    EquilibriumResult result;
    for ([[maybe_unused]] auto _ : state) {
        // All that a user waits for: the solver is made anew.
        const auto start = Clock::now();
        EquilibriumSolver<double> solver(lattice, {.poisson_ratio = poisson_ratio}, plan_options(threads));
        u.assign(3 * solver.node_count(), 0.0);
        result = solver.solve(loading, VectorField<double>::aos(u.data(), solver.node_count()), options);
        times.push_back(seconds_since(start));
        state.SetIterationTime(times.back());
    }
    if (result.status != EquilibriumStatus::converged) {
        state.SkipWithError(result.message.c_str());
        return;
    }
    state.counters["seconds"] = median(times);
    state.counters["newton_iterations"] = result.newton_iterations;
    state.counters["cg_iterations"] = static_cast<double>(result.cg_iterations);
    state.SetLabel(std::string(result.preconditioner));
    if (calculix::is_installed()) {
        if (const auto run = calculix_beside(poisson_ratio)) {
            state.counters["calculix_seconds"] = run->seconds;
            state.counters["calculix_iterations"] = run->iterations;
            state.counters["calculix_force"] = plate_force(*run);
            state.counters["ratio_to_calculix"] = run->seconds / median(times);
        }
    }
}

std::string static_line(const std::string& name, const benchmark::BenchmarkReporter::Run& run) {
    const double ratio = counter(run, "ratio_to_calculix");
    const std::string beside = ratio > 0 ? printed("%10.2f %8.0f", counter(run, "calculix_seconds"), ratio)
                               : calculix::is_installed()
                                   ? std::string("  ccx failed")
                                   : std::string("  skipped: no ccx on PATH (package calculix-ccx)");
    return printed("%-44s %10.0f %10.0f %10.2f  %s", name.c_str(), counter(run, "newton_iterations"),
                   counter(run, "cg_iterations"), 1e3 * counter(run, "seconds"), beside.c_str());
}

/// The time of a product with the second derivatives.
double product_seconds(const Lattice& lattice, const Material& material, std::span<const std::array<double, 3>> u,
                       int threads) {
    const auto body = make_body<double>(lattice, material, plan_options(threads));
    State<double> state = body->make_state(false);
    body->write(VectorField<const double>::aos(u[0].data(), body->node_count()), 1 / body->length_unit(),
                state.displacement);
    NodeField<double> product;
    body->hessian_product(state, state.displacement, product); // once for what is allocated then
    constexpr int kProducts = 10;
    const auto start = Clock::now();
    for (int i = 0; i < kProducts; ++i) {
        body->hessian_product(state, state.displacement, product);
    }
    return seconds_since(start) / kProducts;
}

/// What the process holds ("VmRSS:"), or held at most since forget_peak() ("VmHWM:"); 0 where /proc does not tell.
double resident_bytes(std::string_view field) {
    std::ifstream status("/proc/self/status");
    std::string word;
    double kilobytes = 0;
    while (status >> word) {
        if (word == field && status >> kilobytes) {
            break;
        }
    }
    return 1024 * kilobytes;
}
void forget_peak() {
#ifdef __GLIBC__
    malloc_trim(0); // what is free but not given back would be taken again unseen
#endif
    std::ofstream("/proc/self/clear_refs") << "5\n";
}

/// The same cube on ever finer meshes.
void measure_mesh(benchmark::State& state, int edge, double poisson_ratio, int threads) {
    constexpr double kHeight = 5;
    const Lattice lattice = Lattice::box(edge, edge, edge, kHeight / edge);
    Material material{.poisson_ratio = poisson_ratio};
    material.crush.stiffness = 20;
    Loading loading;
    loading.supports = clamped_faces(lattice, -kStaticStrain * kHeight);
    EquilibriumOptions options;
    options.tolerance = 1e-6;
    std::vector<double> times;
    std::vector<std::array<double, 3>> u, f;
    EquilibriumResult result;
    double products = 0, bytes = 0;
    for ([[maybe_unused]] auto _ : state) {
        u.clear();
        u.shrink_to_fit();
        forget_peak();
        const double before = resident_bytes("VmRSS:");
        const auto start = Clock::now();
        EquilibriumSolver<double> solver(lattice, material, plan_options(threads));
        const std::size_t nodes = solver.node_count();
        u.assign(nodes, {0, 0, 0});
        result = solver.solve(loading, VectorField<double>::aos(u[0].data(), nodes), options);
        times.push_back(seconds_since(start));
        bytes = std::max(resident_bytes("VmHWM:") - before, 0.0);
        state.SetIterationTime(times.back());
        f.assign(nodes, {0, 0, 0});
        solver.get_forces(VectorField<double>::aos(u[0].data(), nodes), VectorField<double>::aos(f[0].data(), nodes));
        products = product_seconds(lattice, material, u, threads);
    }
    if (result.status != EquilibriumStatus::converged) {
        state.SkipWithError(result.message.c_str());
        return;
    }
    double force = 0;
    for (const PrescribedNode& node : loading.supports) {
        force += node.displacement[1] != 0 ? f[node.node][1] : 0;
    }
    state.counters["seconds"] = median(times);
    state.counters["microseconds_a_cell"] = 1e6 * median(times) / static_cast<double>(lattice.cell_count());
    state.counters["products"] = median(times) / products;
    state.counters["newton_iterations"] = result.newton_iterations;
    state.counters["cg_iterations"] = static_cast<double>(result.cg_iterations);
    state.counters["force"] = std::abs(force);
    state.counters["volume_change"] =
        measure_volume_change(u, cell_corners(lattice), lattice.cell_size()).relative_volume_change;
    state.counters["least_volume_ratio"] = result.min_cell_volume_ratio;
    state.counters["bytes_a_cell"] = bytes / static_cast<double>(lattice.cell_count());
    state.SetLabel(std::string(result.preconditioner));
}

std::string mesh_line(const std::string& name, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-44s %6.0f %6.0f %10.2f %10.0f %9.4f %9.0f %7.3f %7.0f", name.c_str(),
                   counter(run, "newton_iterations"), counter(run, "cg_iterations"),
                   counter(run, "microseconds_a_cell"), counter(run, "products"), 100 * counter(run, "volume_change"),
                   counter(run, "force"), counter(run, "least_volume_ratio"), counter(run, "bytes_a_cell"));
}

/// Backward Euler steps far above the critical one, beside explicit steps of the same body.
void measure_euler(benchmark::State& state, int edge, double poisson_ratio, int threads) {
    constexpr double kHeight = 5, kTimes = 100;
    constexpr int kTurn = 12; ///< steps in which the weight turns once
    const Lattice lattice = Lattice::box(edge, edge, edge, kHeight / edge);
    const Material material{.poisson_ratio = poisson_ratio};
    EquilibriumSolver<double> solver(lattice, material, plan_options(threads));
    ExplicitDynamics<double> dynamics(lattice, material, plan_options(threads));
    const double critical = dynamics.critical_time_step();
    Loading loading;
    for (const PrescribedNode& node : clamped_faces(lattice, 1)) {
        if (node.displacement[1] == 0) {
            loading.supports.push_back(node);
        }
    }
    EquilibriumOptions options;
    options.tolerance = 1e-6;
    const std::size_t nodes = solver.node_count();
    std::vector<double> u(3 * nodes), v(3 * nodes), times, explicit_times, newton, cg, residuals;
    for ([[maybe_unused]] auto _ : state) {
        std::fill(u.begin(), u.end(), 0.0);
        std::fill(v.begin(), v.end(), 0.0);
        for (int step = 0; step < 3 * kTurn; ++step) {
            // A strain of some 5 % where it holds the cube.
            const double weight = 0.05 * material.young_modulus / (material.density * kHeight) *
                                  std::min(1.0, static_cast<double>(step) / kTurn);
            const double turned = 2 * std::numbers::pi * step / kTurn;
            loading.acceleration = {weight * std::sin(turned), -weight * std::cos(turned), 0};
            auto start = Clock::now();
            const EquilibriumResult result =
                solver.step(loading, kTimes * critical, 0, VectorField<double>::aos(u.data(), nodes),
                            VectorField<double>::aos(v.data(), nodes), options);
            const double seconds = seconds_since(start);
            if (result.status != EquilibriumStatus::converged) {
                state.SkipWithError(result.message.c_str());
                return;
            }
            start = Clock::now();
            constexpr int kExplicit = 20;
            dynamics.step({.time_step = 0.5 * critical}, kExplicit);
            if (step >= kTurn) {
                explicit_times.push_back(seconds_since(start) / kExplicit);
                times.push_back(seconds);
                newton.push_back(result.newton_iterations);
                cg.push_back(static_cast<double>(result.cg_iterations));
                residuals.push_back(result.residual);
            }
        }
        state.SetIterationTime(median(times));
    }
    state.counters["seconds"] = median(times);
    state.counters["microseconds_a_cell"] = 1e6 * median(times) / static_cast<double>(lattice.cell_count());
    state.counters["explicit_steps"] = median(times) / median(explicit_times);
    state.counters["newton_iterations"] = median(newton);
    state.counters["cg_iterations"] = median(cg);
    state.counters["residual"] = *std::max_element(residuals.begin(), residuals.end());
    // What a solver that stops elsewhere within its tolerance must agree on.
    double size = 0;
    for (const double x : u) {
        size += x * x;
    }
    state.counters["root_mean_square"] = std::sqrt(size / static_cast<double>(nodes));
}

std::string euler_line(const std::string& name, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-44s %6.1f %6.1f %10.2f %10.0f %9.1e %12.8f", name.c_str(), counter(run, "newton_iterations"),
                   counter(run, "cg_iterations"), counter(run, "microseconds_a_cell"), counter(run, "explicit_steps"),
                   counter(run, "residual"), counter(run, "root_mean_square"));
}

/// What the equilibrium solver takes: iterations of conjugate gradients by mesh, Poisson's ratio and preconditioner,
/// and whole static solves beside the finite element program CalculiX. Cubes of 8^3 to 32^3 cells, and of 64^3 (of
/// mesh rows 96^3 too) where `choices.large`; `choices.threads` may have one count. Doubles.
Table solver_benchmark(const RowChoices& choices) {
    const int threads = choices.threads.empty() ? 1 : choices.threads.front();
    Table table{kIntroduction, {}};
    std::vector<int> edges = {8, 16, 32};
    if (choices.large) {
        edges.push_back(64);
    }
    const std::string cg_heading =
        printed("%-44s %10s %10s %10s %10s", "cg", "iterations", "setup ms", "solve ms", "products");
    for (double poisson_ratio : {0.0, 0.25, 0.49, 0.499, 0.4999}) {
        for (const PreconditionerKind kind : {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid}) {
            for (int edge : edges) {
                const std::string name = printed("cg/%dx%dx%d/nu:%g/%s/threads:%d", edge, edge, edge, poisson_ratio,
                                                 std::string(hybmss::name(kind)).c_str(), threads);
                table.rows.push_back(
                    {name, threads, cg_heading, edge > 16 ? 1 : 5,
                     [=](benchmark::State& state) { measure_cg(state, edge, poisson_ratio, kind, threads); },
                     [=](const auto& run) { return cg_line(name, run); }});
            }
        }
    }
    const std::string static_heading =
        printed("%-44s %10s %10s %10s %10s %8s", "static", "newton", "cg", "ms", "ccx s", "x ccx");
    for (double poisson_ratio : {0.0, 0.25, 0.499}) {
        for (const PreconditionerKind kind :
             {PreconditionerKind::block_jacobi, PreconditionerKind::multigrid, PreconditionerKind::automatic}) {
            const std::string name = printed("static/10x10x10/nu:%g/%s/threads:%d", poisson_ratio,
                                             std::string(hybmss::name(kind)).c_str(), threads);
            table.rows.push_back({name, threads, static_heading, 5,
                                  [=](benchmark::State& state) { measure_static(state, poisson_ratio, kind, threads); },
                                  [=](const auto& run) { return static_line(name, run); }});
        }
    }
    const std::string mesh_heading = printed("%-44s %6s %6s %10s %10s %9s %9s %7s %7s", "mesh", "newton", "cg",
                                             "us/cell", "products", "e %", "force N", "least", "B/cell");
    std::vector<int> mesh_edges = edges;
    if (choices.large) {
        mesh_edges.push_back(96);
    }
    for (double poisson_ratio : {0.0, 0.25, 0.4, 0.45, 0.49, 0.499}) {
        for (int edge : mesh_edges) {
            const std::string name =
                printed("mesh/%dx%dx%d/nu:%g/threads:%d", edge, edge, edge, poisson_ratio, threads);
            table.rows.push_back({name, threads, mesh_heading, edge > 16 ? 1 : 5,
                                  [=](benchmark::State& state) { measure_mesh(state, edge, poisson_ratio, threads); },
                                  [=](const auto& run) { return mesh_line(name, run); }});
        }
    }
    const std::string euler_heading = printed("%-44s %6s %6s %10s %10s %9s %12s", "euler", "newton", "cg", "us/cell",
                                              "steps", "residual", "rms of u, m");
    for (double poisson_ratio : {0.0, 0.25, 0.45, 0.49, 0.499}) {
        for (int edge : edges) {
            const std::string name =
                printed("euler/%dx%dx%d/nu:%g/threads:%d", edge, edge, edge, poisson_ratio, threads);
            table.rows.push_back({name, threads, euler_heading, 1,
                                  [=](benchmark::State& state) { measure_euler(state, edge, poisson_ratio, threads); },
                                  [=](const auto& run) { return euler_line(name, run); }});
        }
    }
    return table;
}

constexpr Benchmark kBenchmarks[] = {
    {"limits", "what the machine can do, and how much of it the lattice step takes", limits_benchmark},
    {"digits", "springs by displacements and positions, by estimated and exact roots: error and time", digit_benchmark},
    {"scaling", "cubes of 10^3 to 128^3 cells; with --large 256^3 too", scaling_benchmark},
    {"batch", "64 small bodies stepped side by side", batch_benchmark},
    {"pile", "cubes at rest on each other, against the same without contact", pile_benchmark},
    {"memory", "bytes per node and cell; times nothing", memory_table},
    {"ratios", "models, numberings and fillings, each against another body in the same rounds", ratio_benchmark},
    {"hessian", "second derivatives times a vector, against the step", hessian_benchmark},
    {"solvers", "equilibria by mesh, Poisson's ratio and preconditioner, beside CalculiX; with --large 64^3 cells too",
     solver_benchmark},
    {"cutting", "cells removed from moving bodies", cutting_benchmark},
    {"embedding", "calls in C, and over interleaved memory, against native ones", embedding_benchmark}};

} // namespace

void add_bench_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("bench", "measure what the program's own benchmark leaves out");
    command->require_subcommand(1);
    for (const Benchmark& benchmark : kBenchmarks) {
        const auto arguments = std::make_shared<BenchArguments>();
        CLI::App* one = command->add_subcommand(benchmark.name, benchmark.about);
        arguments->add_to(*one);
        one->add_flag("--large", arguments->large, "the largest bodies too, where a benchmark has some");
        one->callback([arguments, &benchmark] { run_benchmark(benchmark, *arguments); });
    }
}
