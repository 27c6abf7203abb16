#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "simulation/run/effect_list.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybmss::bench {

namespace {

constexpr int kEdge = 20;

constexpr const char* kIntroduction =
    "ns/cell: of a step without the effect and with it, medians of interleaved rounds; ratio: the median of a "
    "round's.\n"
    "`none called for`: the step with its seams for effects against the sweep of the cells alone. `denormal "
    "numbers`: a body that has\nall but come to rest, against one that moves.\n";

/// Rounds of the two, and the counters of their times.
void measure(benchmark::State& state, const Work& without, const Work& with) {
    const auto [with_times, without_times] = in_turns(state, with, without);
    const double cells = std::pow(kEdge, 3);
    state.counters["ns_per_cell_without"] = 1e9 * median(without_times) / cells;
    state.counters["ns_per_cell"] = 1e9 * median(with_times) / cells;
    state.counters["ratio"] = median_ratio(with_times, without_times);
}

/// After steps: some arrays are made by the first.
void count_bytes(benchmark::State& state, std::size_t without, std::size_t with) {
    state.counters["bytes_per_cell_added"] =
        (static_cast<double>(with) - static_cast<double>(without)) / std::pow(kEdge, 3);
}

PlanOptions options_of(InstructionSet set, int threads, Accuracy accuracy) {
    PlanOptions options;
    options.accuracy = accuracy;
    options.instruction_set = set;
    options.threads = threads;
    return options;
}

template <class T>
void measure_seams(benchmark::State& state, const PlanOptions& options) {
    const Lattice lattice = Lattice::box(kEdge, kEdge, kEdge, 0.5);
    const Material material;
    ExplicitDynamics<T> dynamics(lattice, material, options);
    const std::vector<T> u = random_displacements<T>(dynamics.node_count(), lattice.cell_size());
    dynamics.set_displacements(VectorField<const T>::aos(u.data(), dynamics.node_count()));
    const BareStep<T> bare = bare_step<T>(lattice, material, options, u);
    const StepParameters parameters = gentle_steps(dynamics);
    measure(
        state, [&](long steps) { bare.steps(parameters, steps); },
        [&](long steps) { dynamics.step(parameters, steps); });
    count_bytes(state, bare.bytes, dynamics.describe().bytes);
}

template <class T>
void measure_denormals(benchmark::State& state, const PlanOptions& options) {
    const Lattice lattice = Lattice::box(kEdge, kEdge, kEdge, 0.5);
    ExplicitDynamics<T> moving(lattice, {}, options), resting(lattice, {}, options);
    disturb(moving, lattice.cell_size());
    disturb(resting, 0.1 * static_cast<double>(std::numeric_limits<T>::min()) / kDisturbance);
    const StepParameters parameters = gentle_steps(moving);
    measure(
        state, [&](long steps) { moving.step(parameters, steps); },
        [&](long steps) { resting.step(parameters, steps); });
}

/// A box at rest: a step takes as long for zeros as for other numbers, unless they are denormal.
Scene plain_scene() {
    Scene scene;
    scene.body.cells = {kEdge, kEdge, kEdge};
    scene.body.cell_size = 0.5;
    scene.material.poisson_ratio = 0.25;
    scene.material.face_diagonal_ratio = 0;
    scene.solver.duration = 1e9;
    return scene;
}

void measure_effect(benchmark::State& state, const EffectRule& rule, Precision precision, const PlanOptions& plan) {
    const SimulationOptions options{precision, plan};
    Scene scene = plain_scene();
    rule.add(scene);
    Simulation with(scene, options), rest(without(scene, rule), options);
    measure(
        state, [&](long steps) { rest.step(steps); }, [&](long steps) { with.step(steps); });
    count_bytes(state, rest.describe().bytes, with.describe().bytes);
}

Row make_row(const std::string& effect, InstructionSet set, Precision precision, int threads, double seconds,
             std::function<void(benchmark::State&)> measured) {
    const std::string isa(name(set)), type(name(precision));
    std::string words = effect;
    std::replace(words.begin(), words.end(), ' ', '-');
    return {"effect/" + words + "/" + isa + "/" + type + "/threads:" + std::to_string(threads),
            threads,
            printed("%-20s %-7s %-6s %7s %12s %8s %8s %8s %12s", "effect", "isa", "type", "threads", "without ns",
                    "with ns", "added ns", "ratio", "added B/cell"),
            std::max(5L, std::lround(seconds / (2 * kSliceSeconds))),
            std::move(measured),
            [=](const auto& run) {
                const double with = counter(run, "ns_per_cell"), without = counter(run, "ns_per_cell_without");
                return printed("%-20s %-7s %-6s %7d %12.2f %8.2f %8.2f %8.3f %12.2f", effect.c_str(), isa.c_str(),
                               type.c_str(), threads, without, with, with - without, counter(run, "ratio"),
                               counter(run, "bytes_per_cell_added"));
            }};
}

} // namespace

Table effects_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({});
    const int threads = choices.threads.front();
    Table table{kIntroduction, {}};
    for (InstructionSet set : choices.instruction_sets) {
        for (Precision precision : choices.precisions) {
            const PlanOptions options = options_of(set, threads, choices.accuracy);
            const auto append = [&](const std::string& effect, std::function<void(benchmark::State&)> measured) {
                table.rows.push_back(make_row(effect, set, precision, threads, choices.seconds, std::move(measured)));
            };
            append("none called for", [=](benchmark::State& state) {
                precision == Precision::float32 ? measure_seams<float>(state, options)
                                                : measure_seams<double>(state, options);
            });
            append("denormal numbers", [=](benchmark::State& state) {
                precision == Precision::float32 ? measure_denormals<float>(state, options)
                                                : measure_denormals<double>(state, options);
            });
            for (const EffectRule& rule : effect_rules()) {
                if (rule.add) {
                    append(std::string(rule.name),
                           [=, &rule](benchmark::State& state) { measure_effect(state, rule, precision, options); });
                }
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
