#include "studies/solvers/solver_benchmark.hpp"

#include "bench/interleaved.hpp"

#include "hybmss/equilibrium.hpp"
#include "plan/bodies/layout_table.hpp"
#include "solvers/multigrid/float_multigrid.hpp"
#include "solvers/newton/conjugate_gradients.hpp"
#include "solvers/newton/preconditioner.hpp"
#include "studies/calculix/program.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction =
    "cg: iterations of conjugate gradients for random forces on an undeformed cube with two opposite faces clamped, "
    "until\n"
    "the residual's norm sqrt(r . B r) has fallen to 1e-8, B the preconditioner; `products`: the same time in Hessian\n"
    "products; `setup` is paid once for several Newton steps. static: the cube compressed by 20 % between clamped "
    "plates\n"
    "from rest to a residual of 1e-8; `x ccx`: CalculiX (C3D8I, NLGEOM, same mesh, its own stepping, one thread) over "
    "it.\n"
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

} // namespace

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
    return table;
}

} // namespace hybmss::bench
