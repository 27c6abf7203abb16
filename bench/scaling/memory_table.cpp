#include "bench/benchmarks.hpp"
#include "bench/standard_bodies.hpp"

#include "hybmss/explicit_dynamics.hpp"

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction =
    "Bytes held by a plan (layout, constants, scratch) and by explicit dynamics (the plan and the state).\n";

enum class Shape { box, hollow_ball };

std::string name(Shape shape) {
    return shape == Shape::box ? "32x32x32" : "hollow-ball-64";
}

Lattice make_lattice(Shape shape) {
    return shape == Shape::box ? Lattice::box(32, 32, 32, 0.5) : hollow_ball(64, 4, 0.5);
}

template <class T>
void fill(benchmark::State& state, Shape shape, const BenchRow& row) {
    for ([[maybe_unused]] auto _ : state) {
        state.SetIterationTime(0);
    }
    const Lattice lattice = make_lattice(shape);
    const Material material = row_material(row);
    const PlanOptions options = row_options(row);
    PlanDescription plan, dynamics;
    if (is_network(row)) {
        const Network network = Network::from_lattice(lattice, material);
        plan = ForcePlan<T>(network, options).describe();
        dynamics = ExplicitDynamics<T>(network, options).describe();
    } else {
        plan = ForcePlan<T>(lattice, material, options).describe();
        dynamics = ExplicitDynamics<T>(lattice, material, options).describe();
    }
    const double nodes = static_cast<double>(plan.nodes), cells = static_cast<double>(lattice.cell_count());
    state.counters["nodes"] = nodes;
    state.counters["cells"] = cells;
    state.counters["plan_bytes_per_node"] = static_cast<double>(plan.bytes) / nodes;
    state.counters["plan_bytes_per_cell"] = static_cast<double>(plan.bytes) / cells;
    state.counters["dynamics_bytes_per_node"] = static_cast<double>(dynamics.bytes) / nodes;
    state.counters["dynamics_bytes_per_cell"] = static_cast<double>(dynamics.bytes) / cells;
    state.SetLabel(dynamics.layout);
}

} // namespace

Table memory_table(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts(row_layouts());
    const std::string heading =
        printed("%-16s %-12s %-18s %-6s %9s %9s %14s %14s %14s %14s", "body", "asked for", "layout", "type", "nodes",
                "cells", "plan B/node", "plan B/cell", "dynamics/node", "dynamics/cell");
    Table table{kIntroduction, {}};
    for (Shape shape : {Shape::box, Shape::hollow_ball}) {
        for (const std::string& layout : choices.layouts) {
            for (Precision precision : choices.precisions) {
                BenchRow row;
                row.layout = layout;
                row.instruction_set = choices.instruction_sets.back();
                row.precision = precision;
                table.rows.push_back(
                    {"memory/" + name(shape) + "/" + layout + "/" + std::string(name(precision)), 1, heading, 1,
                     [=](benchmark::State& state) {
                         precision == Precision::float32 ? fill<float>(state, shape, row)
                                                         : fill<double>(state, shape, row);
                     },
                     [=](const auto& run) {
                         return printed("%-16s %-12s %-18s %-6s %9.0f %9.0f %14.1f %14.1f %14.1f %14.1f",
                                        name(shape).c_str(), layout.c_str(), run.report_label.c_str(),
                                        std::string(name(precision)).c_str(), counter(run, "nodes"),
                                        counter(run, "cells"), counter(run, "plan_bytes_per_node"),
                                        counter(run, "plan_bytes_per_cell"), counter(run, "dynamics_bytes_per_node"),
                                        counter(run, "dynamics_bytes_per_cell"));
                     }});
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
