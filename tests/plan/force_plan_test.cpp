// The public face of plans: memory pictures, errors, concurrent use, forced instruction sets.

#include "tests/environment.hpp"
#include "tests/moving_body.hpp"
#include "tests/random_bodies.hpp"
#include "tests/refusal.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>
#include <string>
#include <thread>

namespace {
/// What this thread has taken from the heap.
thread_local long allocations = 0;
} // namespace

// Not inlined: compilers would take free() for a mistake.
[[gnu::noinline]] void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size > 0 ? size : 1)) {
        return memory;
    }
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}

namespace hybmss {
namespace {

using testing::refusal;

TEST(ForcePlan, AddsToAnyMemoryPicture) {
    testing::Random random(3);
    const Lattice lattice = testing::random_lattice(4, 3, 5, 0.5, random);
    const ForcePlan<float> plan(lattice, Material{});
    const std::size_t n = plan.node_count();
    const std::vector<float> u = testing::random_field<float>(n, 0.05, 1);
    std::vector<float> aos(3 * n, 0.0f);
    plan.add_forces(VectorField<const float>::aos(u.data(), n), VectorField<float>::aos(aos.data(), n));

    std::vector<float> x(n), y(n), z(n), fx(n, 1.0f), fy(n, 2.0f), fz(n, 3.0f);
    std::vector<float> u4(4 * n, -77.0f), f4(4 * n, -77.0f);
    for (std::size_t i = 0; i < n; ++i) {
        x[i] = u4[4 * i] = u[3 * i];
        y[i] = u4[4 * i + 1] = u[3 * i + 1];
        z[i] = u4[4 * i + 2] = u[3 * i + 2];
    }
    plan.add_forces(VectorField<const float>::soa(x.data(), y.data(), z.data(), n),
                    VectorField<float>::soa(fx.data(), fy.data(), fz.data(), n));
    plan.add_forces(VectorField<const float>::aos(u4.data(), n, 4), VectorField<float>::aos(f4.data(), n, 4));
    for (std::size_t i = 0; i < n; ++i) {
        EXPECT_EQ(fx[i], 1.0f + aos[3 * i]);
        EXPECT_EQ(fy[i], 2.0f + aos[3 * i + 1]);
        EXPECT_EQ(fz[i], 3.0f + aos[3 * i + 2]);
        EXPECT_EQ(f4[4 * i], -77.0f + aos[3 * i]);
        EXPECT_EQ(f4[4 * i + 3], -77.0f) << "the fourth component is not the plan's";
    }
}

TEST(ForcePlan, RefusesWhatItCannotDo) {
    const Lattice lattice = Lattice::box(2, 2, 2, 1.0);
    const ForcePlan<double> plan(lattice, Material{});
    std::vector<double> u(3 * 27, 0.0), f(3 * 27, 0.0);
    EXPECT_EQ(refusal([&] {
                  plan.add_forces(VectorField<const double>::aos(u.data(), 26), VectorField<double>::aos(f.data(), 27));
              }),
              "vector field of 26 nodes given: the body has 27");
    Material bad;
    bad.poisson_ratio = 0.5;
    EXPECT_EQ(refusal([&] { ForcePlan<double>(lattice, bad); }),
              "poisson_ratio = 0.5 is not allowed: it must be inside (-1, 0.5), both ends excluded");
    PlanOptions options;
    options.layout = "spaghetti";
    EXPECT_EQ(refusal([&] { ForcePlan<double>(lattice, Material{}, options); }),
              "layout \"spaghetti\" is not known for this body: it must be one of flat-rows, active-rows, network");
    options = {};
    options.threads = -2;
    EXPECT_EQ(refusal([&] { ForcePlan<double>(lattice, Material{}, options); }),
              "threads = -2 is not allowed: it must be at least 0 (0: all of the machine)");
    ExplicitDynamics<double> body(lattice, Material{});
    EXPECT_EQ(refusal([&] {
                  body.step({0.0, {0, 0, 0}, 0});
              }),
              "time_step = 0 is not allowed: it must be finite and above 0");
    EXPECT_EQ(refusal([&] {
                  body.step({1e-3, {0, 0, 0}, -1});
              }),
              "mass_damping = -1 is not allowed: it must be finite and at least 0");
    const PrescribedNode outside{27, 7, {0, 0, 0}, {0, 0, 0}};
    EXPECT_EQ(refusal([&] { body.prescribe({&outside, 1}); }), "prescribed node 27: the body has 27 nodes");
    const PrescribedNode fourth_axis{.node = 3, .axes = 9};
    EXPECT_EQ(refusal([&] {
                  body.prescribe({&fourth_axis, 1});
              }),
              "prescribed node 3: axes = 9 is not allowed: it must be a sum of 1, 2 and 4");
    EXPECT_EQ(refusal([&] { body.step({.time_step = 1e-4}, -5); }),
              "count = -5 is not allowed: it must be at least 0 steps");
}

TEST(ForcePlan, RefusesFieldsThatAreNone) {
    const ForcePlan<float> plan(Lattice::box(2, 2, 2, 1.0), Material{});
    const std::size_t n = plan.node_count();
    std::vector<float> u(3 * n, 0.01f), f(3 * n, 0.0f);
    const auto in = VectorField<const float>::aos(u.data(), n);
    const auto forces = [&](VectorField<const float> from, VectorField<float> to) {
        return refusal([&] { plan.add_forces(from, to); });
    };
    EXPECT_EQ(forces(in, VectorField<float>::soa(f.data(), nullptr, f.data() + 2 * n, n)), "vector field: y is null");
    EXPECT_EQ(forces({u.data(), u.data() + 1, nullptr, 3, n}, VectorField<float>::aos(f.data(), n)),
              "vector field: z is null");
    EXPECT_EQ(forces(VectorField<const float>::aos(u.data(), n, 0), VectorField<float>::aos(f.data(), n)),
              "vector field: stride = 0 is not allowed: every node has components of its own");
    // Interleaved memory with the stride of separate arrays: y of a node is x of the next.
    EXPECT_EQ(forces(in, VectorField<float>::aos(f.data(), n, 1)),
              "vector field: x, y and z must be different memory: with stride = 1 they share some");
    const std::string kApart = "vector field: what is written must be other memory than what is read";
    EXPECT_EQ(forces(in, VectorField<float>::aos(u.data(), n)), kApart);
    EXPECT_EQ(forces(VectorField<const float>::aos(f.data(), n - 1), VectorField<float>::aos(f.data() + 3, n - 1)),
              "vector field of 26 nodes given: the body has 27");
    std::vector<float> both(6 * n, 0.0f);
    EXPECT_EQ(forces(VectorField<const float>::aos(both.data(), n, 6), VectorField<float>::aos(both.data() + 3, n, 6)),
              "")
        << "u and f of a node side by side";
    EXPECT_EQ(forces(VectorField<const float>::aos(both.data() + 3, n, 3), VectorField<float>::aos(both.data(), n, 3)),
              kApart)
        << "a node further on";
    EXPECT_EQ(refusal([&] { plan.add_hessian_product(in, in, VectorField<float>::aos(u.data(), n)); }), kApart);
    EXPECT_EQ(u, std::vector<float>(3 * n, 0.01f));
    EXPECT_EQ(f, std::vector<float>(3 * n, 0.0f)) << "a refused call adds nothing";
    // What is only read may be the same memory three times, and may run backwards.
    EXPECT_EQ(
        forces(VectorField<const float>::soa(u.data(), u.data(), u.data(), n), VectorField<float>::aos(f.data(), n)),
        "");
    EXPECT_EQ(forces(in, VectorField<float>::aos(f.data() + 3 * n - 3, n, -3)), "");
}

// Every thread takes memory from the same heap: a small body's forces would wait for it.
TEST(ForcePlan, TakesNoMemoryForTheForcesOfASmallBody) {
    for (const char* layout : {"", "active-rows", "packed-xyzw", "coloured-soa"}) {
        for (const double stiffening : {0.0, 1.0}) {
            PlanOptions options;
            options.layout = layout;
            const ForcePlan<float> plan(Lattice::box(4, 4, 4, 1.0), Material{.stiffening = {stiffening, stiffening}},
                                        options);
            const std::size_t n = plan.node_count();
            std::vector<float> u(3 * n, 0.01f), f(3 * n, 0.0f);
            const auto forces = [&] {
                plan.add_forces(VectorField<const float>::aos(u.data(), n), VectorField<float>::aos(f.data(), n));
            };
            forces();
            const long before = allocations;
            forces();
            EXPECT_EQ(allocations - before, 0) << layout << ", stiffening " << stiffening;
        }
    }
}

TEST(ForcePlan, AnEmptyLatticeHasNoForces) {
    Lattice lattice = Lattice::box(3, 2, 1, 1.0);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 2; ++j) {
            lattice.set_cell_scale(i, j, 0, 0.0f);
        }
    }
    for (const std::string& layout : lattice_layouts()) {
        PlanOptions options;
        options.layout = layout;
        const ForcePlan<float> plan(lattice, Material{}, options);
        EXPECT_EQ(plan.node_count(), 0u);
        plan.add_forces({}, {});
        EXPECT_EQ(plan.energy({}).total(), 0.0);
    }
}

TEST(ForcePlan, MayRunManyTimesAtOnce) {
    const Lattice lattice = Lattice::box(12, 12, 60, 0.1);
    Material material;
    material.poisson_ratio = 0.4;
    PlanOptions options;
    options.threads = 2;
    const ForcePlan<float> plan(lattice, material, options);
    const std::size_t n = plan.node_count();
    std::vector<std::vector<float>> u, alone(4, std::vector<float>(3 * n, 0.0f)), together = alone;
    for (unsigned i = 0; i < 4; ++i) {
        u.push_back(testing::random_field<float>(n, 0.01, i));
        plan.add_forces(VectorField<const float>::aos(u[i].data(), n), VectorField<float>::aos(alone[i].data(), n));
    }
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < 4; ++i) {
        threads.emplace_back([&, i] {
            for (int repeat = 0; repeat < 5; ++repeat) {
                std::fill(together[i].begin(), together[i].end(), 0.0f);
                plan.add_forces(VectorField<const float>::aos(u[i].data(), n),
                                VectorField<float>::aos(together[i].data(), n));
            }
        });
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    EXPECT_EQ(together, alone);
}

TEST(InstructionSets, TheForcedOneRuns) {
    const Lattice lattice = Lattice::box(2, 2, 2, 1.0);
    for (InstructionSet set : available_instruction_sets()) {
        const testing::Variable forced("HYBMSS_ISA", std::string(name(set)).c_str());
        EXPECT_EQ(ForcePlan<float>(lattice, Material{}).describe().instruction_set, set);
        EXPECT_EQ(ExplicitDynamics<double>(lattice, Material{}).describe().instruction_set, set);
    }
    {
        const testing::Variable unknown("HYBMSS_ISA", "mmx");
        EXPECT_EQ(refusal([&] { ForcePlan<float>(lattice, Material{}); }),
                  "instruction set \"mmx\" is not known: it must be one of automatic, sse2, avx2, avx512, neon");
    }
    const testing::Variable unforced("HYBMSS_ISA", nullptr);
    EXPECT_EQ(resolve(InstructionSet::automatic), available_instruction_sets().back());
    const bool arm = available_instruction_sets().back() == InstructionSet::neon;
    const InstructionSet foreign = arm ? InstructionSet::avx512 : InstructionSet::neon;
    EXPECT_NE(refusal([&] {
                  resolve(foreign);
              }).find("instruction set " + std::string(name(foreign)) + " is not available here"),
              std::string::npos);
}

// Near rest no assembly of cells vibrates faster than one cell alone. For a single cell the bound is sharp: a step just
// below stays bounded, one just above does not.
TEST(ExplicitDynamics, TheCriticalTimeStepParts) {
    for (double nu : {0.0, 0.25, 0.45}) {
        Material material;
        material.poisson_ratio = nu;
        const Lattice cell = Lattice::box(1, 1, 1, 0.5);
        for (double factor : {0.99, 1.02}) {
            ExplicitDynamics<double> body(cell, material);
            const std::vector<double> u = testing::random_field<double>(8, 1e-9, 4);
            body.set_displacements(VectorField<const double>::aos(u.data(), 8));
            const double start = body.potential_energy().total();
            body.step({factor * body.critical_time_step(), {0, 0, 0}, 0}, 500);
            const double ratio = (body.potential_energy().total() + body.kinetic_energy()) / start;
            if (factor < 1) {
                EXPECT_LT(ratio, 200) << nu;
            } else {
                EXPECT_FALSE(ratio < 1e6) << nu; // or not a number
            }
        }
    }
}

TEST(ExplicitDynamics, StartsCleanAfterAMotionThatEndedInNaN) {
    const Lattice lattice = Lattice::box(5, 4, 9, 0.5);
    for (const std::string& layout : lattice_layouts()) {
        PlanOptions options;
        options.layout = layout;
        ExplicitDynamics<float> body(lattice, Material{}, options);
        const double critical = body.critical_time_step();
        const StepParameters step{0.3 * critical, {0, 0, 0}, 0};
        const std::uint64_t fresh = testing::bits_after(body, 0.5, step, 10);
        // Far beyond the stable step the motion runs away to infinity and NaN.
        const StepParameters too_long{100 * critical, {0, 0, 0}, 0};
        body.step(too_long, 100);
        ASSERT_FALSE(std::isfinite(body.kinetic_energy())) << layout;
        const std::vector<float> zero(3 * body.node_count(), 0.0f);
        body.set_velocities(VectorField<const float>::aos(zero.data(), body.node_count()));
        EXPECT_EQ(testing::bits_after(body, 0.5, step, 10), fresh) << layout;
    }
}

} // namespace
} // namespace hybmss
