#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"

#include "hybmss/allocator.hpp"
#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/force_plan.hpp"
#include "hybmss/hybmss.h"
#include "hybmss/skin.hpp"
#include "hybmss/stress.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction = "Forces in float on one thread over memory of the caller's; the least times of "
                                      "interleaved rounds, as all calls\n"
                                      "do the same work. `over`: how much longer one takes than what it is "
                                      "compared with.\n";

/// The forces of one box, asked for in all ways that are compared.
class Caller {
public:
    explicit Caller(int edge)
        : plan_(Lattice::box(edge, edge, edge, 0.1), Material{.poisson_ratio = 0.4}, one_thread()),
          nodes_(plan_.node_count()), u_(3 * nodes_), f_(3 * nodes_), order_(nodes_) {
        for (std::size_t i = 0; i < u_.size(); ++i) {
            u_[i] = 1e-3f * static_cast<float>(i % 7);
        }
        std::iota(order_.begin(), order_.end(), 0u);
        std::reverse(order_.begin(), order_.end());
        const std::int32_t cells[3] = {edge, edge, edge};
        hybmss_material material = hybmss_default_material();
        material.poisson_ratio = 0.4;
        hybmss_plan_options options = hybmss_default_plan_options();
        options.threads = 1;
        if (hybmss_lattice_create(cells, 0.1, nullptr, 0, &material, &body_) != HYBMSS_OK ||
            hybmss_plan_create(body_, HYBMSS_FLOAT, &options, &c_plan_) != HYBMSS_OK) {
            throw std::runtime_error(hybmss_last_error());
        }
    }
    Caller(const Caller&) = delete;
    Caller& operator=(const Caller&) = delete;
    ~Caller() {
        hybmss_plan_destroy(c_plan_);
        hybmss_body_destroy(body_);
    }

    void separate() {
        float *u = u_.data(), *f = f_.data();
        plan_.add_forces(VectorField<const float>::soa(u, u + nodes_, u + 2 * nodes_, nodes_),
                         VectorField<float>::soa(f, f + nodes_, f + 2 * nodes_, nodes_));
    }
    void interleaved() {
        plan_.add_forces(VectorField<const float>::aos(u_.data(), nodes_), VectorField<float>::aos(f_.data(), nodes_));
    }
    void interleaved_by_c(bool mapped) {
        hybmss_const_field u = hybmss_const_float_field(u_.data(), nodes_, 3);
        hybmss_field f = hybmss_float_field(f_.data(), nodes_, 3);
        u.map = f.map = mapped ? order_.data() : nullptr;
        if (hybmss_plan_add_forces(c_plan_, &u, &f) != HYBMSS_OK) {
            throw std::runtime_error(hybmss_last_error());
        }
    }
    bool finite() const {
        return std::all_of(f_.begin(), f_.end(), [](float value) { return std::isfinite(value); });
    }

private:
    static PlanOptions one_thread() {
        PlanOptions options;
        options.threads = 1;
        return options;
    }

    ForcePlan<float> plan_;
    std::size_t nodes_;
    std::vector<float> u_, f_;
    std::vector<std::uint32_t> order_;
    hybmss_body* body_ = nullptr;
    hybmss_plan* c_plan_ = nullptr;
};

/// A body that moves, in memory of an allocator that hands out whole pages or of the default.
class Moving {
public:
    Moving(int edge, bool pages, Integrator integrator) : dynamics_(make(edge, pages)) {
        step_ = {.time_step = 0.2 * dynamics_.critical_time_step(), .mass_damping = 1, .integrator = integrator};
        std::vector<float> u(3 * dynamics_.node_count());
        for (std::size_t i = 0; i < u.size(); ++i) {
            u[i] = 1e-5f * static_cast<float>(i % 7);
        }
        dynamics_.set_displacements(VectorField<const float>::aos(u.data(), dynamics_.node_count()));
    }
    /// A call for each.
    void step(long count) {
        for (; count > 0; --count) {
            dynamics_.step(step_);
        }
    }

private:
    static void* take(std::size_t bytes, std::size_t, void*) {
        return std::aligned_alloc(kPage, (bytes + kPage - 1) / kPage * kPage);
    }
    static void give(void* memory, std::size_t, std::size_t, void*) { std::free(memory); }
    static ExplicitDynamics<float> make(int edge, bool pages) {
        set_allocator(pages ? Allocator{&take, &give, nullptr} : Allocator{});
        PlanOptions options;
        options.threads = 1;
        ExplicitDynamics<float> dynamics(Lattice::box(edge, edge, edge, 0.1), Material{.poisson_ratio = 0.4}, options);
        set_allocator({});
        return dynamics;
    }

    static constexpr std::size_t kPage = 4096;
    ExplicitDynamics<float> dynamics_;
    StepParameters step_;
};

/// What is read of a body beside its forces: a mesh of 100,000 vertices on its surface, the stresses of its cells.
class Read {
public:
    explicit Read(int edge)
        : lattice_(Lattice::box(edge, edge, edge, 0.1)), skin_(lattice_, surface(0.1 * edge), one_thread()),
          stress_(lattice_, {}, one_thread()), u_(3 * stress_.node_count()), positions_(3 * kVertices),
          normals_(3 * kVertices), stresses_(stress_.cell_count()), von_mises_(stress_.cell_count()) {
        for (std::size_t i = 0; i < u_.size(); ++i) {
            u_[i] = 1e-3f * static_cast<float>(i % 7);
        }
    }
    void skin(bool normals) {
        skin_.update(displacement(), VectorField<float>::aos(positions_.data(), kVertices),
                     normals ? VectorField<float>::aos(normals_.data(), kVertices) : VectorField<float>{});
    }
    void stress() { stress_.read(displacement(), stresses_); }
    void von_mises() {
        StressArrays<float> arrays;
        arrays.von_mises = von_mises_.data();
        stress_.read(displacement(), arrays);
    }

private:
    static constexpr std::size_t kVertices = 100000;

    VectorField<const float> displacement() const {
        return VectorField<const float>::aos(u_.data(), stress_.node_count());
    }
    static PlanOptions one_thread() {
        PlanOptions options;
        options.threads = 1;
        return options;
    }
    /// In any order; triangles of three in a row.
    static TriangleMesh surface(double edge) {
        std::mt19937 engine(1);
        std::uniform_real_distribution<double> draw(0, edge);
        TriangleMesh mesh;
        for (std::uint32_t n = 0; n < kVertices; ++n) {
            std::array<double, 3> x = {draw(engine), draw(engine), draw(engine)};
            x[n % 3] = n % 2 == 0 ? 0 : edge;
            mesh.vertices.push_back(x);
            if (n % 3 == 2) {
                mesh.triangles.push_back({n - 2, n - 1, n});
            }
        }
        return mesh;
    }

    Lattice lattice_;
    Skin<float> skin_;
    StressMeter stress_;
    std::vector<float> u_, positions_, normals_;
    std::vector<CellStress> stresses_;
    std::vector<float> von_mises_;
};

struct Comparison {
    const char* name;
    int edge;                                   ///< cells
    std::function<void(Caller&)> work, against; ///< empty: steps as follows, against those by default
    const char* words;
    bool pages = false;
    Integrator integrator = Integrator::symplectic_euler;
    std::function<void(Read&)> read = {}, read_against = {};
};

void time(benchmark::State& state, const Work& work, const Work& against) {
    const auto [times, times_against] = in_turns(state, work, against);
    const double least = *std::min_element(times.begin(), times.end());
    const double least_against = *std::min_element(times_against.begin(), times_against.end());
    state.counters["microseconds"] = 1e6 * least;
    state.counters["microseconds_over"] = 1e6 * (least - least_against);
    state.counters["percent_over"] = 100 * (least / least_against - 1);
}

void measure(benchmark::State& state, const Comparison& comparison) {
    if (comparison.read) {
        Read read(comparison.edge);
        const auto repeated = [&](const std::function<void(Read&)>& call) {
            return [&](long count) {
                for (; count > 0; --count) {
                    call(read);
                }
            };
        };
        time(state, repeated(comparison.read), repeated(comparison.read_against));
        return;
    }
    if (!comparison.work) {
        Moving moving(comparison.edge, comparison.pages, comparison.integrator), usual(comparison.edge, false, {});
        time(
            state, [&](long count) { moving.step(count); }, [&](long count) { usual.step(count); });
        return;
    }
    Caller caller(comparison.edge);
    const auto repeated = [&](const std::function<void(Caller&)>& call) {
        return [&](long count) {
            for (; count > 0; --count) {
                call(caller);
            }
        };
    };
    time(state, repeated(comparison.work), repeated(comparison.against));
    if (!caller.finite()) {
        state.SkipWithError("the forces are not finite");
    }
}

} // namespace

Table embedding_benchmark(const RowChoices& choices) {
    const auto separate = [](Caller& caller) { caller.separate(); };
    const auto interleaved = [](Caller& caller) { caller.interleaved(); };
    const auto by_c = [](Caller& caller) { caller.interleaved_by_c(false); };
    const auto mapped = [](Caller& caller) { caller.interleaved_by_c(true); };
    const Comparison comparisons[] = {
        {"embedding/1x1x1/C", 1, by_c, interleaved, "a call in C, against C++"},
        {"embedding/32x32x32/AoS", 32, interleaved, separate, "float3 memory, against separate arrays"},
        {"embedding/32x32x32/AoS-C", 32, by_c, separate, "the same in C"},
        {"embedding/32x32x32/map-C", 32, mapped, separate, "float3 in reverse order by a map, in C"},
        {"embedding/30x30x30/pages", 30, {}, {}, "a step in an allocator's whole pages", true},
        {"embedding/30x30x30/leapfrog", 30, {}, {}, "a leapfrog step", false, Integrator::leapfrog},
        {"embedding/32x32x32/normals",
         32,
         {},
         {},
         "a skin of 100,000 with normals, without",
         false,
         {},
         [](Read& read) { read.skin(true); },
         [](Read& read) { read.skin(false); }},
        {"embedding/32x32x32/stress",
         32,
         {},
         {},
         "all stresses of all cells, against the next",
         false,
         {},
         [](Read& read) { read.stress(); },
         [](Read& read) { read.von_mises(); }},
        {"embedding/32x32x32/von-mises",
         32,
         {},
         {},
         "von Mises stress of all cells, against a skin",
         false,
         {},
         [](Read& read) { read.von_mises(); },
         [](Read& read) { read.skin(true); }}};
    const std::string heading = printed("%-10s %-40s %10s %12s %8s", "mesh", "what", "us/call", "us over", "% over");
    Table table{kIntroduction, {}};
    for (const Comparison& comparison : comparisons) {
        table.rows.push_back(
            {comparison.name, 1, heading, std::max(5L, std::lround(choices.seconds / (2 * kSliceSeconds))),
             [comparison](benchmark::State& state) { measure(state, comparison); },
             [comparison](const auto& run) {
                 const std::string mesh = printed("%dx%dx%d", comparison.edge, comparison.edge, comparison.edge);
                 return printed("%-10s %-40s %10.3f %12.3f %8.1f", mesh.c_str(), comparison.words,
                                counter(run, "microseconds"), counter(run, "microseconds_over"),
                                counter(run, "percent_over"));
             }});
    }
    return table;
}

} // namespace hybmss::bench
