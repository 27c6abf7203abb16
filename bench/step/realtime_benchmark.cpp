#include "bench/benchmarks.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "layouts/messages.hpp"

#include <ctime>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

namespace hybmss::bench {
namespace {

constexpr const char* kIntroduction =
    "The largest cube of soft tissue (10 kPa, 1000 kg/m^3, nu 0.45) whose frames take at most the time that they "
    "simulate, 99 of 100.\n"
    "ms a frame, of all frames from the first on, each begun when it is due. core: the caller's time on a core, less "
    "than the wall's\n"
    "where other programs ran.\n";

constexpr int kLargestEdge = 160;
/// Of the critical step, which is one near rest: pressed together, cells are stiffer.
constexpr double kShareOfCritical = 0.9;

struct Target {
    double cell_size; ///< m
    int frames_a_second;
    bool contact; ///< a cube on a plane under gravity; else one held at its bottom and dragged by a node of its top
};

/// One thread's time on a core, s.
double core_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A cube of soft tissue, and what a program does with it in a frame.
template <class T>
class Game {
public:
    Game(const BenchRow& row, const Target& target, int edge)
        : lattice_(Lattice::box(edge, edge, edge, target.cell_size)), body_(lattice_, tissue(), row_options(row)),
          target_(target) {
        const double frame = 1.0 / target.frames_a_second;
        steps_ = std::lround(std::ceil(frame / (kShareOfCritical * body_.critical_time_step())));
        parameters_ = {frame / static_cast<double>(steps_), {0, 0, 0}, 2.0};
        if (target.contact) {
            parameters_.acceleration[1] = -9.81;
            body_.set_obstacles(surface_nodes(lattice_), std::array{Obstacle{.shape = PlaneShape{}, .friction = 0.5}});
            return;
        }
        for (int k = 0; k <= edge; ++k) {
            for (int i = 0; i <= edge; ++i) {
                given_.push_back({static_cast<std::uint32_t>(lattice_.grid_node_index(i, 0, k))});
            }
        }
        given_.push_back({static_cast<std::uint32_t>(lattice_.grid_node_index(edge / 2, edge, edge / 2))});
    }

    void frame() {
        if (!target_.contact) {
            constexpr double kOmega = 2 * std::numbers::pi;
            time_ += 1.0 / target_.frames_a_second;
            given_.back().displacement[1] = target_.cell_size * std::sin(kOmega * time_);
            given_.back().velocity[1] = kOmega * target_.cell_size * std::cos(kOmega * time_);
            body_.prescribe(given_);
        }
        body_.step(parameters_, steps_);
    }

    long steps() const { return steps_; }
    bool finite() const { return body_.finite(); }

private:
    static Material tissue() {
        Material material;
        material.young_modulus = 1e4;
        material.poisson_ratio = 0.45;
        material.density = 1000;
        return material;
    }

    Lattice lattice_;
    ExplicitDynamics<T> body_;
    Target target_;
    long steps_ = 0;
    StepParameters parameters_;
    std::vector<PrescribedNode> given_;
    double time_ = 0;
};

/// Of all frames; s.
struct Frames {
    int edge = 0;
    long steps = 0;
    std::vector<double> wall, core; ///< ascending
    double first = 0;

    static double quantile(const std::vector<double>& ascending, double part) {
        return ascending[static_cast<std::size_t>(std::ceil(part * static_cast<double>(ascending.size()))) - 1];
    }
};

/// Ends as soon as more than one of a hundred frames was too long, with nothing in it.
template <class T>
Frames run_frames(const BenchRow& row, const Target& target, int edge, std::size_t count) {
    using Clock = std::chrono::steady_clock;
    const double most = 1.0 / target.frames_a_second;
    const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(most));
    Game<T> game(row, target, edge);
    Frames frames{edge, game.steps(), {}, {}, 0};
    std::size_t late = 0;
    for (Clock::time_point due = Clock::now(); frames.wall.size() < count; due = std::max(due + period, Clock::now())) {
        std::this_thread::sleep_until(due);
        const double core = core_seconds();
        const Clock::time_point start = Clock::now();
        game.frame();
        frames.wall.push_back(std::chrono::duration<double>(Clock::now() - start).count());
        frames.core.push_back(core_seconds() - core);
        late += frames.wall.back() > most ? 1 : 0;
        if (100 * late > count) {
            return {};
        }
    }
    if (!game.finite()) {
        throw std::runtime_error("the displacements are not finite after the last frame");
    }
    frames.first = frames.wall.front();
    std::sort(frames.wall.begin(), frames.wall.end());
    std::sort(frames.core.begin(), frames.core.end());
    return frames;
}

/// By bisection. A size that fails has a second try: other programs disturb.
template <class T>
Frames largest_that_holds(const BenchRow& row, const Target& target, std::size_t count) {
    Frames best;
    for (int fails = kLargestEdge + 1; fails - best.edge > 1;) {
        const int edge = (best.edge + fails) / 2;
        Frames frames = run_frames<T>(row, target, edge, count);
        if (frames.edge == 0) {
            frames = run_frames<T>(row, target, edge, count);
        }
        if (frames.edge == 0) {
            fails = edge;
        } else {
            best = std::move(frames);
        }
    }
    return best;
}

template <class T>
void measure(benchmark::State& state, const BenchRow& row, const Target& target, std::size_t count) {
    Frames frames;
    for ([[maybe_unused]] auto _ : state) {
        frames = largest_that_holds<T>(row, target, count);
        if (frames.edge == 0) {
            throw std::runtime_error("not even one cell holds");
        }
        state.SetIterationTime(Frames::quantile(frames.wall, 0.5));
    }
    state.counters["edge"] = frames.edge;
    state.counters["cells"] = std::pow(frames.edge, 3);
    state.counters["steps_a_frame"] = static_cast<double>(frames.steps);
    state.counters["frame_ms"] = 1e3 / target.frames_a_second;
    state.counters["median_ms"] = 1e3 * Frames::quantile(frames.wall, 0.5);
    state.counters["p99_ms"] = 1e3 * Frames::quantile(frames.wall, 0.99);
    state.counters["worst_ms"] = 1e3 * frames.wall.back();
    state.counters["first_ms"] = 1e3 * frames.first;
    state.counters["core_p99_ms"] = 1e3 * Frames::quantile(frames.core, 0.99);
    state.counters["core_worst_ms"] = 1e3 * frames.core.back();
}

Row make_row(const BenchRow& row, const Target& target, bool quick) {
    const std::string scene = target.contact ? "contact" : "dragged", isa(name(row.instruction_set)),
                      type(name(row.precision));
    const int millimetres = static_cast<int>(std::lround(1e3 * target.cell_size));
    return {
        printed("realtime/%dmm/%dHz/%s/%s/%s/threads:%d", millimetres, target.frames_a_second, scene.c_str(),
                isa.c_str(), type.c_str(), row.threads),
        row.threads,
        printed("%3s %5s %-8s %-7s %-6s %7s %5s %8s %6s %8s %8s %8s %8s %9s %10s", "mm", "Hz", "scene", "isa", "type",
                "threads", "edge", "cells", "steps", "median", "99 %", "worst", "first", "core 99 %", "core worst"),
        1,
        [=](benchmark::State& state) {
            const std::size_t count = quick ? 60 : 600;
            row.precision == Precision::float32 ? measure<float>(state, row, target, count)
                                                : measure<double>(state, row, target, count);
        },
        [=](const auto& run) {
            const auto value = [&](const char* key) { return counter(run, key); };
            return printed("%3d %5d %-8s %-7s %-6s %7d %5.0f %8.0f %6.0f %8.3f %8.3f %8.3f %8.3f %9.3f %10.3f",
                           millimetres, target.frames_a_second, scene.c_str(), isa.c_str(), type.c_str(), row.threads,
                           value("edge"), value("cells"), value("steps_a_frame"), value("median_ms"), value("p99_ms"),
                           value("worst_ms"), value("first_ms"), value("core_p99_ms"), value("core_worst_ms"));
        }};
}

} // namespace

Table realtime_benchmark(const RowChoices& asked) {
    const RowChoices choices = asked.with_layouts({"lattice"});
    Table table{kIntroduction, {}};
    for (const double cell_size : {5e-3, 10e-3}) {
        for (const int rate : {60, 1000}) {
            for (const bool contact : {true, false}) {
                for_rows(choices, {0, 0, 0}, Model::hybmss, 0, [&](const BenchRow& row) {
                    table.rows.push_back(make_row(row, {cell_size, rate, contact}, choices.quick));
                });
            }
        }
    }
    return table;
}

} // namespace hybmss::bench
