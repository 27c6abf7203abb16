// One plan from many threads, and another program's threads in place of oneTBB's.

#include "hybmss/explicit_dynamics.hpp"
#include "hybmss/force_plan.hpp"
#include "hybmss/hybmss.h"
#include "hybmss/task_runner.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace hybmss {
namespace {

/// Large enough for several threads.
const Lattice kCube = Lattice::box(24, 24, 24, 0.1);
const Material kMaterial{.young_modulus = 1e4, .poisson_ratio = 0.4};

std::vector<double> random_displacements(std::size_t nodes, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-0.01, 0.01);
    std::vector<double> u(3 * nodes);
    for (double& value : u) {
        value = uniform(engine);
    }
    return u;
}

std::vector<double> forces(const ForcePlan<double>& plan, const std::vector<double>& u) {
    std::vector<double> f(u.size());
    plan.add_forces(VectorField<const double>::aos(u.data(), plan.node_count()),
                    VectorField<double>::aos(f.data(), plan.node_count()));
    return f;
}

struct Count {
    std::atomic<long> enqueued{0}, finished{0}, ran{0};
};

/// A task that a runner has not run yet, or runs on a thread of its own.
struct Pending {
    void (*task)(void*);
    void* context;
    Count* count;
    std::thread thread;
    void run() {
        task(context);
        ++count->ran;
    }
};

void* enqueue_serially(void (*task)(void*), void* context, void* user) {
    Count& count = *static_cast<Count*>(user);
    ++count.enqueued;
    task(context);
    ++count.ran;
    return nullptr;
}
void* enqueue_for_later(void (*task)(void*), void* context, void* user) {
    auto* count = static_cast<Count*>(user);
    ++count->enqueued;
    return new Pending{task, context, count, {}};
}
void* enqueue_on_a_thread(void (*task)(void*), void* context, void* user) {
    auto* pending = static_cast<Pending*>(enqueue_for_later(task, context, user));
    pending->thread = std::thread([pending] { pending->run(); });
    return pending;
}
void finish(void* handle, void*) {
    auto* pending = static_cast<Pending*>(handle);
    if (pending->thread.joinable()) {
        pending->thread.join();
    } else {
        pending->run();
    }
    ++pending->count->finished;
    delete pending;
}

using Enqueue = void* (*)(void (*)(void*), void*, void*);

TEST(TaskRunner, WhereverTasksRunResultsAreTheSameBits) {
    PlanOptions alone;
    alone.threads = 1;
    const ForcePlan<double> expected_plan(kCube, kMaterial, alone);
    ExplicitDynamics<double> expected_motion(kCube, kMaterial, alone);
    const std::vector<double> u = random_displacements(expected_plan.node_count(), 1);
    const std::vector<double> expected = forces(expected_plan, u);
    const StepParameters step{expected_motion.critical_time_step() / 2, {0, -10, 0}, 1};
    const auto moved = [&](ExplicitDynamics<double>& motion) {
        motion.set_displacements(VectorField<const double>::aos(u.data(), motion.node_count()));
        motion.step(step, 20);
        std::vector<double> out(u.size());
        motion.get_displacements(VectorField<double>::aos(out.data(), motion.node_count()));
        return out;
    };
    const std::vector<double> expected_state = moved(expected_motion);

    for (const Enqueue enqueue : {&enqueue_serially, &enqueue_for_later, &enqueue_on_a_thread}) {
        Count count;
        const TaskRunner runner{3, enqueue, &finish, &count};
        PlanOptions options;
        options.task_runner = &runner;
        const ForcePlan<double> plan(kCube, kMaterial, options);
        EXPECT_EQ(plan.describe().threads, 3);
        EXPECT_EQ(forces(plan, u), expected);
        EXPECT_GT(count.enqueued, 0);
        ExplicitDynamics<double> motion(kCube, kMaterial, options);
        EXPECT_EQ(moved(motion), expected_state);
        EXPECT_EQ(count.ran, count.enqueued);
        EXPECT_EQ(count.finished, enqueue == &enqueue_serially ? 0 : count.enqueued.load());
    }
}

TEST(TaskRunner, AnIncompleteOneIsRefused) {
    Count count;
    for (const TaskRunner& runner :
         {TaskRunner{0, &enqueue_serially, &finish, &count}, TaskRunner{2, nullptr, &finish, &count},
          TaskRunner{2, &enqueue_serially, nullptr, &count}}) {
        PlanOptions options;
        options.task_runner = &runner;
        EXPECT_THROW(ForcePlan<float>(kCube, kMaterial, options), std::invalid_argument);
    }
}

TEST(CInterface, OnePlanIsExecutedByManyThreadsAtOnce) {
    const std::int32_t cells[3] = {9, 8, 7};
    const hybmss_material material = hybmss_default_material();
    hybmss_body* body = nullptr;
    ASSERT_EQ(hybmss_lattice_create(cells, 0.1, nullptr, 0, &material, &body), HYBMSS_OK);
    hybmss_plan* plan = nullptr;
    ASSERT_EQ(hybmss_plan_create(body, HYBMSS_DOUBLE, nullptr, &plan), HYBMSS_OK);
    hybmss_body_destroy(body);
    constexpr std::size_t kNodes = 10 * 9 * 8;
    std::vector<std::uint32_t> map(kNodes);
    for (std::size_t n = 0; n < kNodes; ++n) {
        map[n] = static_cast<std::uint32_t>((n * 7) % kNodes); // 7 and 720 have no factor in common
    }

    // Every thread has displacements of its own, every other one in another order, and one in four gets an error.
    const auto execute = [&](std::size_t thread) {
        const std::vector<double> u = random_displacements(kNodes, static_cast<unsigned>(thread));
        std::vector<double> f(u.size());
        hybmss_const_field in = hybmss_const_double_field(u.data(), kNodes, 3);
        hybmss_field out = hybmss_double_field(f.data(), kNodes, 3);
        in.map = out.map = thread % 2 == 0 ? map.data() : nullptr;
        EXPECT_EQ(hybmss_plan_add_forces(plan, &in, &out), HYBMSS_OK);
        if (thread % 4 == 3) {
            in.stride = -static_cast<std::ptrdiff_t>(thread);
            EXPECT_EQ(hybmss_plan_add_forces(plan, &in, &out), HYBMSS_INVALID_ARGUMENT);
            EXPECT_NE(std::string(hybmss_last_error()).find("stride = -" + std::to_string(thread) + " "),
                      std::string::npos);
        }
        return f;
    };
    constexpr std::size_t kThreads = 8;
    std::vector<std::vector<double>> expected, found(kThreads);
    for (std::size_t t = 0; t < kThreads; ++t) {
        expected.push_back(execute(t));
    }
    for (int round = 0; round < 5; ++round) {
        std::vector<std::thread> threads;
        for (std::size_t t = 0; t < kThreads; ++t) {
            threads.emplace_back([&, t] { found[t] = execute(t); });
        }
        for (std::thread& thread : threads) {
            thread.join();
        }
        EXPECT_EQ(found, expected);
    }
    hybmss_plan_destroy(plan);
}

} // namespace
} // namespace hybmss
