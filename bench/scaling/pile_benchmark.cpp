#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/moving_body.hpp"

#include "hybmss/world.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss::bench {
namespace {

constexpr const char* kIntroduction = "Cubes of 10^3 cells of 1 cm (100 kPa, nu 0.3) that have come to rest on a plane "
                                      "and on each other, three by three, "
                                      "with friction;\n"
                                      "`x alone`: a step of the world over the same bodies' steps without contact to "
                                      "each other, in interleaved rounds.\n";

constexpr int kEdge = 10;
constexpr double kCell = 0.01; // m

template <class T>
World<T> make_pile(const BenchRow& row, int bodies, bool touch) {
    constexpr double kFriction = 0.3;
    const Lattice lattice = Lattice::box(kEdge, kEdge, kEdge, kCell);
    BenchRow single = row;
    single.threads = 1;
    World<T> world(row.threads);
    std::vector<BodyContact> contacts;
    for (int b = 0; b < bodies; ++b) {
        // A little out of line, so that none lies cell on cell.
        const double jitter = 1e-3 * (b * 7 % 5), pitch = 1.05 * kEdge * kCell;
        const std::array<double, 3> origin = {pitch * (b % 3) + jitter, 1.01 * kEdge * kCell * (b / 9),
                                              pitch * (b / 3 % 3) + 1e-3 * (b * 3 % 5)};
        const std::size_t body = world.add(
            ExplicitDynamics<T>(lattice, Material{.young_modulus = 1e5, .poisson_ratio = 0.3}, row_options(single)),
            lattice, origin);
        world.body(body).set_obstacles(surface_nodes(lattice, origin),
                                       std::array{Obstacle{.shape = PlaneShape{}, .friction = kFriction}});
        for (std::size_t other = 0; touch && other < body; ++other) {
            contacts.push_back({.first = other, .second = body, .friction = kFriction});
        }
    }
    world.set_contacts(contacts);
    return world;
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row, int bodies) {
    World<T> pile = make_pile<T>(row, bodies, true), alone = make_pile<T>(row, bodies, false);
    const StepParameters parameters{0.5 * pile.critical_time_step(), {0, -9.81, 0}, 3};
    pile.step(parameters, std::lround(4 / parameters.time_step));
    for (std::size_t b = 0; b < pile.body_count(); ++b) {
        alone.body(b).set_exact_state(pile.body(b).exact_state());
    }
    // Of those alone a step is long over before they have fallen apart.
    const auto [together, apart] = in_turns(
        state, [&](long steps) { pile.step(parameters, steps); },
        [&](long steps) {
            for (; steps > 0; --steps) {
                alone.step(parameters);
            }
        });
    double depth = 0;
    std::size_t nodes = 0;
    for (const BodyContactReading& reading : pile.contact_readings()) {
        depth = std::max(depth, reading.greatest_depth);
        nodes += reading.nodes;
    }
    for (std::size_t b = 0; b < pile.body_count(); ++b) {
        if (!pile.body(b).finite()) {
            state.SkipWithError("the displacements are not finite after the last step");
            return;
        }
    }
    state.counters["bodies"] = bodies;
    state.counters["ns_per_cell"] = 1e9 * median(together) / (bodies * std::pow(kEdge, 3));
    state.counters["touching_nodes"] = static_cast<double>(nodes);
    state.counters["greatest_depth_cells"] = depth / kCell;
    state.counters["x_alone"] = median_ratio(together, apart);
}

} // namespace

Table pile_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({"lattice"});
    Table table{kIntroduction, {}};
    for (const int bodies : {2, 9, 27}) {
        for_rows(choices, {kEdge, kEdge, kEdge}, Model::hybmss, 0, [&](const BenchRow& row) {
            const std::string isa(name(row.instruction_set)), type(name(row.precision));
            table.rows.push_back(
                {printed("pile/%d/%s/%s/threads:%d", bodies, isa.c_str(), type.c_str(), row.threads), row.threads,
                 printed("%6s %-7s %-6s %7s %8s %9s %10s %8s", "bodies", "isa", "type", "threads", "ns/cell",
                         "touching", "deepest", "x alone"),
                 std::max(5L, std::lround(choices.seconds / (2 * kSliceSeconds))),
                 [=](benchmark::State& state) {
                     row.precision == Precision::float32 ? measure<float>(state, row, bodies)
                                                         : measure<double>(state, row, bodies);
                 },
                 [=](const auto& run) {
                     return printed("%6d %-7s %-6s %7d %8.2f %9.0f %10.3f %8.2f", bodies, isa.c_str(), type.c_str(),
                                    row.threads, counter(run, "ns_per_cell"), counter(run, "touching_nodes"),
                                    counter(run, "greatest_depth_cells"), counter(run, "x_alone"));
                 }});
        });
    }
    return table;
}

} // namespace hybmss::bench
