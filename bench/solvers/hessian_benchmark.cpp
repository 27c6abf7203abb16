#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "plan/bodies/layout_table.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction = "K p: second derivatives at a strain near 1e-2 times a direction; medians of "
                                      "interleaved rounds. `steps`: its time\n"
                                      "over that of an explicit step, `x ref`: its speed over the plain double "
                                      "array-of-structs loops for the same product,\n"
                                      "all measured in the same rounds.\n";

/// A body, displaced, with a direction.
template <class T>
struct Product {
    explicit Product(const BenchRow& row)
        : body(is_network(row)
                   ? make_body<T>(Network::from_lattice(row_lattice(row), row_material(row)), row_options(row))
                   : make_body<T>(row_lattice(row), row_material(row), row_options(row))),
          state(body->make_state(false)) {
        const std::size_t nodes = body->node_count();
        const std::vector<T> u = random_displacements<T>(nodes, row_lattice(row).cell_size());
        const auto field = VectorField<const T>::aos(u.data(), nodes);
        body->write(field, 1 / body->length_unit(), state.displacement);
        Body<T>::allocate_like(state.displacement, state.direction);
        body->write(field, -1 / body->length_unit(), state.direction);
    }
    void make() { body->hessian_product(state, state.direction, state.force); }
    bool is_finite() const {
        return std::all_of(state.force[0].data(), state.force[0].data() + state.force[0].size(),
                           [](T value) { return std::isfinite(value); });
    }

    std::unique_ptr<Body<T>> body;
    State<T> state;
};

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    const Lattice lattice = row_lattice(row);
    Product<T> product(row);
    const PlanDescription plan = product.body->describe();
    ExplicitDynamics<T> dynamics = row_dynamics<T>(row);
    const StepParameters parameters = gentle_steps(dynamics);
    const Yardstick yardstick = moving_yardstick(lattice, row_material(row));
    std::vector<Vector3> direction(yardstick.nodes.size(), {0.01, -0.02, 0.03}), yardstick_product;
    for (std::size_t n = 0; n < direction.size(); n += 2) {
        direction[n] = {-0.02, 0.01, 0.0};
    }
    const auto repeated = [](auto work) {
        return [work](long count) {
            for (long i = 0; i < count; ++i) {
                work();
            }
        };
    };
    Interleaved interleaved({timed(repeated([&] { product.make(); })),
                             timed([&](long count) { dynamics.step(parameters, count); }),
                             timed(repeated([&] { hessian_product(yardstick, direction, yardstick_product); }))},
                            kSliceSeconds);
    std::vector<double> products, steps, yardsticks;
    for ([[maybe_unused]] auto _ : state) {
        const std::vector<double> times = interleaved.next();
        products.push_back(times[0]);
        steps.push_back(times[1]);
        yardsticks.push_back(times[2]);
        state.SetIterationTime(times[0]);
    }
    if (!product.is_finite()) {
        state.SkipWithError("the product is not finite");
        return;
    }
    const auto cells = static_cast<double>(lattice.cell_count());
    state.counters["ns_per_cell"] = 1e9 * median(products) / cells;
    state.counters["step_ns_per_cell"] = 1e9 * median(steps) / cells;
    state.counters["yardstick_ns_per_cell"] = 1e9 * median(yardsticks) / cells;
    state.counters["cells_per_second"] = cells / median(products);
    state.counters["ratio_to_step"] = median_ratio(products, steps);
    state.counters["ratio_to_reference"] = median_ratio(yardsticks, products);
    state.counters["threads_used"] = plan.threads;
}

std::string heading() {
    return printed("%-14s %-9s %-12s %-7s %-6s %-8s %7s %5s %8s %10s %8s %6s %8s", "mesh", "model", "layout", "isa",
                   "type", "acc.", "threads", "used", "ns/cell", "Mcells/s", "step ns", "steps", "x ref");
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    return printed("%-14s %-9s %-12s %-7s %-6s %-8s %7d %5.0f %8.2f %10.1f %8.2f %6.2f %8.2f", mesh_name(row).c_str(),
                   name(row.model).c_str(), row.layout.c_str(), std::string(name(row.instruction_set)).c_str(),
                   std::string(name(row.precision)).c_str(), std::string(name(row.accuracy)).c_str(), row.threads,
                   counter(run, "threads_used"), counter(run, "ns_per_cell"), counter(run, "cells_per_second") / 1e6,
                   counter(run, "step_ns_per_cell"), counter(run, "ratio_to_step"), counter(run, "ratio_to_reference"));
}

} // namespace

Table hessian_benchmark(const RowChoices& choices) {
    Table table{kIntroduction, {}};
    for (const BenchRow& row : step_rows(choices.with_layouts({"lattice", "network"}))) {
        table.rows.push_back({name(row, "hessian"), row.threads, heading(),
                              std::max(3L, std::lround(choices.seconds / (3 * kSliceSeconds))),
                              [row](benchmark::State& state) {
                                  row.precision == Precision::float32 ? measure<float>(state, row)
                                                                      : measure<double>(state, row);
                              },
                              [row](const auto& run) { return line(row, run); }});
    }
    return table;
}

} // namespace hybmss::bench
