#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"
#include "hybmss/force_plan.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

constexpr int kEdge = 20;
constexpr double kStrains[] = {1e-2, 1e-5};

std::string error_key(double strain) {
    return printed("error_at_%g", strain);
}

/// The largest error of a node's force over the root mean square of all forces, by the scalar reference at the very
/// displacements that the plan gets: random ones, of about that strain.
template <class T>
double force_error(const ForcePlan<T>& plan, const reference::Body& body, double cell_size, double strain) {
    const std::size_t nodes = plan.node_count();
    std::vector<T> u = random_displacements<T>(nodes, cell_size), f(3 * nodes, T(0));
    std::vector<reference::Vector3d> at(nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            T& component = u[3 * n + a];
            component = static_cast<T>(component * (strain / kDisturbance));
            at[n][static_cast<Eigen::Index>(a)] = static_cast<double>(component);
        }
    }
    plan.add_forces(VectorField<const T>::aos(u.data(), nodes), VectorField<T>::aos(f.data(), nodes));
    double error = 0, squares = 0;
    const std::vector<reference::Vector3d> exact = reference::forces(body, at);
    for (std::size_t n = 0; n < nodes; ++n) {
        const reference::Vector3d found(f[3 * n], f[3 * n + 1], f[3 * n + 2]);
        error = std::max(error, (found - exact[n]).norm());
        squares += exact[n].squaredNorm();
    }
    return error / std::sqrt(squares / static_cast<double>(nodes));
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row) {
    const Lattice lattice = row_lattice(row);
    const Material material = row_material(row);
    const ForcePlan<T> plan(lattice, material, row_options(row));
    const reference::Body body = reference::assemble(lattice, material);
    for (const double strain : kStrains) {
        state.counters[error_key(strain)] = force_error(plan, body, lattice.cell_size(), strain);
    }
    ExplicitDynamics<T> dynamics = row_dynamics<T>(row);
    Yardstick yardstick = moving_yardstick(lattice, material);
    const StepParameters parameters = gentle_steps(dynamics);
    const auto [times, yardstick_times] = in_turns(
        state, [&](long steps) { dynamics.step(parameters, steps); }, steps_of(yardstick, parameters));
    if (!all_finite(dynamics)) {
        state.SkipWithError("the displacements are not finite after the last step");
        return;
    }
    state.counters["ns_per_cell"] = 1e9 * median(times) / static_cast<double>(lattice.cell_count());
    state.counters["ratio_to_reference"] = median_ratio(yardstick_times, times);
}

std::string heading() {
    std::string text = printed("%-7s %-6s %-8s", "isa", "type", "acc.");
    for (const double strain : kStrains) {
        text += printed(" %22s", printed("force error at %.0e", strain).c_str());
    }
    return text + printed(" %14s %6s", "step, ns/cell", "x ref");
}

std::string line(const BenchRow& row, const benchmark::BenchmarkReporter::Run& run) {
    std::string text = printed("%-7s %-6s %-8s", std::string(name(row.instruction_set)).c_str(),
                               std::string(name(row.precision)).c_str(), std::string(name(row.accuracy)).c_str());
    for (const double strain : kStrains) {
        text += printed(" %22.1e", counter(run, error_key(strain).c_str()));
    }
    return text + printed(" %14.2f %6.1f", counter(run, "ns_per_cell"), counter(run, "ratio_to_reference"));
}

} // namespace

Table accuracy_benchmark(const RowChoices& asked) {
    RowChoices choices = asked.with_layouts({"lattice"});
    if (asked.threads.empty()) {
        choices.threads = {1};
    }
    Table table;
    const auto append = [&](const BenchRow& each) {
        for (const Accuracy accuracy : {Accuracy::fast, Accuracy::accurate, Accuracy::exact}) {
            BenchRow row = each;
            row.accuracy = accuracy;
            table.rows.push_back({name(row, "accuracy"), row.threads, heading(),
                                  std::max(3L, std::lround(choices.seconds / (2 * kSliceSeconds))),
                                  [row](benchmark::State& state) {
                                      row.precision == Precision::float32 ? measure<float>(state, row)
                                                                          : measure<double>(state, row);
                                  },
                                  [row](const auto& run) { return line(row, run); }});
        }
    };
    for_rows(choices, {kEdge, kEdge, kEdge}, Model::hybmss, 0, append);
    return table;
}

} // namespace hybmss::bench
