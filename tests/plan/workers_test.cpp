// Stages on threads: every piece once a round, in the order of the stages, whoever turns up.

#include "hybmss/explicit_dynamics.hpp"
#include "plan/threads/workers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <limits>
#include <thread>
#include <vector>

#include <unistd.h>

namespace hybmss {
namespace {

/// Counts, in plain memory, how often every piece has run: a piece that runs twice at a time, or before the stage ahead
/// of it is done, is found by the numbers, or as a race by ThreadSanitizer.
struct Ledger {
    explicit Ledger(std::vector<std::size_t> pieces) {
        for (std::size_t s = 0; s < pieces.size(); ++s) {
            counts.emplace_back(pieces[s], 0);
        }
        for (std::size_t s = 0; s < pieces.size(); ++s) {
            stages.push_back({pieces[s], [this, s](std::size_t piece, std::size_t worker) {
                                  const long round = counts[s][piece];
                                  for (std::size_t other = 0; other < counts.size(); ++other) {
                                      for (const long count : counts[other]) {
                                          if (other != s && count != (other < s ? round + 1 : round)) {
                                              ++out_of_order;
                                          }
                                      }
                                  }
                                  ++counts[s][piece];
                                  if (busy[worker].exchange(true)) {
                                      ++shared_workers;
                                  }
                                  std::this_thread::yield();
                                  busy[worker] = false;
                              }});
        }
    }

    void expect_rounds(long rounds) const {
        EXPECT_EQ(out_of_order, 0);
        EXPECT_EQ(shared_workers, 0);
        for (const auto& stage : counts) {
            for (const long count : stage) {
                EXPECT_EQ(count, rounds);
            }
        }
    }

    std::vector<std::vector<long>> counts;
    std::vector<Stage> stages;
    std::atomic<long> out_of_order{0}, shared_workers{0};
    std::atomic<bool> busy[64] = {};
};

TEST(Workers, EveryPieceRunsOnceARoundAndStagesKeepTheirOrder) {
    for (const int threads : {1, 2, 3, 8}) {
        const Workers workers(threads);
        Ledger ledger({7, 1, 0, 16, 2});
        workers.run(ledger.stages, 300);
        for (int call = 0; call < 50; ++call) {
            workers.run(ledger.stages, 1);
        }
        ledger.expect_rounds(350);
    }
}

TEST(Workers, NoRoundsAndNoPiecesEnd) {
    const Workers workers(2);
    Ledger ledger({3, 2}), empty({0, 0});
    workers.run(ledger.stages, 0);
    workers.run(ledger.stages, -1);
    workers.run(empty.stages, 1000);
    workers.run(std::span<const Stage>(), 1000);
    ledger.expect_rounds(0);
}

TEST(Workers, MayBeUsedFromSeveralThreadsAtATime) {
    const Workers workers(3);
    std::vector<std::thread> callers;
    for (int c = 0; c < 4; ++c) {
        callers.emplace_back([&] {
            Ledger ledger({5, 4});
            for (int call = 0; call < 30; ++call) {
                workers.run(ledger.stages, 5);
            }
            ledger.expect_rounds(150);
        });
    }
    for (std::thread& caller : callers) {
        caller.join();
    }
}

TEST(Workers, APieceRunsItsOwnStagesAlone) {
    const Workers outer(2), inner(2);
    std::atomic<int> elsewhere{0}, runs{0};
    outer.run(8, [&](std::size_t, std::size_t) {
        const std::thread::id here = std::this_thread::get_id();
        inner.run(8, [&](std::size_t, std::size_t worker) {
            elsewhere += std::this_thread::get_id() != here || worker != 0;
            ++runs;
        });
    });
    EXPECT_EQ(elsewhere, 0);
    EXPECT_EQ(runs, 64);
    EXPECT_FALSE(inside_piece());
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
long resident_kilobytes() {
    std::ifstream statm("/proc/self/statm");
    long pages = 0, resident = 0;
    statm >> pages >> resident;
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

// Helpers may still be on their way when their workers are gone; what they were called with is freed all the same.
TEST(Workers, LeaveNothingBehind) {
    const auto come_and_go = [](int times) {
        for (int i = 0; i < times; ++i) {
            std::atomic<int> done = 0;
            Workers(2).run(64, [&](std::size_t, std::size_t) { ++done; });
            ASSERT_EQ(done, 64);
        }
    };
    come_and_go(200);
    const long before = resident_kilobytes();
    come_and_go(3000);
    EXPECT_LT(resident_kilobytes() - before, 6000);
}
#endif

TEST(StagedRun, OneWorkerOfManyGetsEverythingDone) {
    for (const std::size_t worker : {0u, 1u, 3u}) {
        Ledger ledger({7, 1, 2});
        StagedRun run(ledger.stages, 20, 4);
        run.work(worker);
        ledger.expect_rounds(20);
    }
}

TEST(StagedRun, WorkersMayComeLateAndAfterTheEnd) {
    Ledger ledger({9, 3});
    StagedRun run(ledger.stages, 400, 4);
    std::vector<std::thread> late;
    for (std::size_t worker = 1; worker < 4; ++worker) {
        late.emplace_back([&run, worker] {
            std::this_thread::sleep_for(std::chrono::microseconds(worker * 300));
            run.work(worker);
        });
    }
    run.work(0);
    ledger.expect_rounds(400);
    run.work(0);
    for (std::thread& thread : late) {
        thread.join();
    }
    ledger.expect_rounds(400);
}

TEST(StagedRun, AWorkerThatIsHeldUpInAPieceIsWaitedFor) {
    std::atomic<bool> held{false}, stage_after_began{false}, began_early{false};
    std::atomic<int> pieces{0};
    const std::vector<Stage> stages = {{4,
                                        [&](std::size_t, std::size_t worker) {
                                            if (worker == 1) {
                                                held = true;
                                                std::this_thread::sleep_for(std::chrono::milliseconds(20));
                                                began_early = began_early || stage_after_began;
                                            } else {
                                                while (!held) {
                                                    std::this_thread::yield();
                                                }
                                            }
                                            ++pieces;
                                        }},
                                       {2, [&](std::size_t, std::size_t) { stage_after_began = true; }}};
    StagedRun run(stages, 1, 2);
    std::thread other([&] { run.work(1); });
    run.work(0);
    other.join();
    EXPECT_EQ(pieces, 4);
    EXPECT_FALSE(began_early);
}

TEST(StagedRun, MorePiecesThanAShareCanCountAreRunInBundles) {
    std::vector<unsigned char> counts(200'001, 0);
    const Stage stage = {counts.size(), [&](std::size_t piece, std::size_t) { ++counts[piece]; }};
    const Workers workers(2);
    workers.run({&stage, 1}, 3);
    EXPECT_EQ(counts, std::vector<unsigned char>(counts.size(), 3));
}

float tenth_of_smallest_normal() {
    volatile float smallest = std::numeric_limits<float>::min();
    return smallest * 0.1f;
}

TEST(Underflow, HoldsInPiecesAloneAndOnEveryThread) {
    for (const Underflow wanted : {Underflow::gradual, Underflow::to_zero}) {
        for (const int threads : {1, 3}) {
            const Workers workers(threads, nullptr, wanted);
            std::atomic<int> zeros = 0, nested = 0;
            workers.run(64, [&](std::size_t, std::size_t) {
                zeros += tenth_of_smallest_normal() == 0 ? 1 : 0;
                Workers(1).run(1, [&](std::size_t, std::size_t) { nested += tenth_of_smallest_normal() > 0 ? 1 : 0; });
            });
            EXPECT_EQ(zeros, wanted == Underflow::to_zero ? 64 : 0) << threads;
            EXPECT_EQ(nested, 64) << "workers within a piece keep to their own";
            EXPECT_GT(tenth_of_smallest_normal(), 0) << "the caller's mode is as it was";
        }
    }
}

/// A body that has all but come to rest.
TEST(Underflow, ExactBodiesKeepWhatOthersFlush) {
    for (const Accuracy accuracy : {Accuracy::accurate, Accuracy::exact}) {
        PlanOptions options;
        options.accuracy = accuracy;
        ExplicitDynamics<float> body(Lattice::box(4, 4, 4, 1.0), Material{}, options);
        std::vector<float> u(3 * body.node_count(), 0.0f);
        u[3] = 1e-41f;
        body.set_displacements(VectorField<const float>::aos(u.data(), body.node_count()));
        body.step({0.5 * body.critical_time_step()}, 3);
        body.get_displacements(VectorField<float>::aos(u.data(), body.node_count()));
        EXPECT_EQ(std::any_of(u.begin(), u.end(), [](float x) { return x != 0; }), accuracy == Accuracy::exact);
    }
}

} // namespace
} // namespace hybmss
