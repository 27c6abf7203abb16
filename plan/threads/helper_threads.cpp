#include "plan/threads/helper_threads.hpp"

#if !HYBMSS_ONETBB

// Nobody comes to help, and a run's caller, who waits for nobody, gets everything done.
namespace hybmss {

int default_threads() {
    return 1;
}

struct HelperThreads::Arena {};

HelperThreads::HelperThreads(int) {}
HelperThreads::~HelperThreads() = default;

void HelperThreads::join(const std::shared_ptr<StagedRun>&) {}

} // namespace hybmss

#else

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#define HYBMSS_NOT_FOR_TSAN __attribute__((no_sanitize_thread))
#else
#define HYBMSS_NOT_FOR_TSAN
#endif

namespace hybmss {

int default_threads() {
    return tbb::info::default_concurrency();
}

namespace {

// Longer than what a simulation does between two steps; short beside what a program would miss the core for.
constexpr std::chrono::microseconds kStay{200};

/// Arenas live as long as the program, and all objects share them: oneTBB never delivers what is left in an arena that
/// is destroyed, nor frees that arena's memory.
tbb::task_arena& arena_for(int threads) {
    struct Arenas {
        std::mutex mutex;
        std::map<int, tbb::task_arena> by_size;
    };
    static Arenas& arenas = *new Arenas; // outlives helpers that are still on their way when the program ends
    const std::lock_guard lock(arenas.mutex);
    return arenas.by_size.try_emplace(threads, threads).first->second;
}

/// oneTBB starts no more threads than the machine has cores, and says so on stderr, unless it is told to; of several
/// who tell it, it takes the smallest number. So one speaks for all, and for good: for the most that was ever asked
/// for.
void allow(int threads) {
    static std::mutex& mutex = *new std::mutex;
    static std::unique_ptr<tbb::global_control>& limit = *new std::unique_ptr<tbb::global_control>;
    static int allowed = default_threads();
    const std::lock_guard lock(mutex);
    if (threads > allowed) {
        limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                      static_cast<std::size_t>(threads));
        allowed = threads;
    }
}

} // namespace

struct HelperThreads::Arena {
    explicit Arena(int threads) : arena(arena_for(std::max(threads, default_threads()))) { allow(threads); }
    tbb::task_arena& arena;
};

/// Makes a thread of oneTBB a helper.
///
/// ThreadSanitizer cannot see that oneTBB, which is built without it, hands a task over before it starts: it is told
/// so, and does not look at how the task's one pointer is copied and read. Everything else is ordered by the shared
/// mutex and the run's atomics.
struct HelperThreads::Task {
    std::shared_ptr<Shared> shared;
    std::size_t worker;

    static void run(Task* given) {
#if defined(__SANITIZE_THREAD__)
        __tsan_acquire(given);
#endif
        const std::unique_ptr<Task> task(given);
        task->shared->help(task->worker);
    }
    /// Takes the task over once it is on its way.
    static void enqueue(tbb::task_arena& arena, std::unique_ptr<Task> task) {
#if defined(__SANITIZE_THREAD__)
        __tsan_release(task.get());
#endif
#if defined(__SANITIZE_ADDRESS__)
        // A program may end before oneTBB has delivered it, and LeakSanitizer does not look into oneTBB's memory.
        __lsan_ignore_object(task.get());
#endif
        arena.enqueue(Call{task.get()});
        static_cast<void>(task.release());
    }

    struct Call {
        Task* task;
        HYBMSS_NOT_FOR_TSAN void operator()() const { run(task); }
    };
};

HelperThreads::HelperThreads(int threads)
    : shared_(std::make_shared<Shared>()), arena_(std::make_unique<Arena>(threads)) {
    shared_->present.assign(static_cast<std::size_t>(threads), false);
    shared_->stays = threads <= default_threads();
}

HelperThreads::~HelperThreads() {
    const std::lock_guard lock(shared_->mutex);
    shared_->run = nullptr;
    shared_->announced = ++shared_->runs;
}

void HelperThreads::Shared::help(std::size_t worker) {
    using Clock = std::chrono::steady_clock;
    std::uint64_t joined = 0;
    for (;;) {
        std::shared_ptr<StagedRun> at_hand;
        {
            const std::lock_guard lock(mutex);
            if (runs == joined || !run) {
                present[worker] = false;
                return;
            }
            joined = runs;
            at_hand = run;
        }
        at_hand->work(worker);
        at_hand.reset();
        const Clock::time_point leave = Clock::now() + kStay;
        while (stays && announced.load(std::memory_order_relaxed) == joined && Clock::now() < leave) {
            SpinWait wait(100);
            for (int turn = 0; turn < 101 && announced.load(std::memory_order_relaxed) == joined; ++turn) {
                wait.turn();
            }
        }
    }
}

void HelperThreads::join(const std::shared_ptr<StagedRun>& run) {
    std::vector<std::size_t> absent;
    std::uint64_t number = 0;
    {
        const std::lock_guard lock(shared_->mutex);
        shared_->run = run;
        number = ++shared_->runs;
        for (std::size_t worker = 1; worker < shared_->present.size(); ++worker) {
            if (!shared_->present[worker]) {
                shared_->present[worker] = true;
                absent.push_back(worker);
            }
        }
    }
    shared_->announced.store(number, std::memory_order_relaxed);
    for (const std::size_t worker : absent) {
        try {
            Task::enqueue(arena_->arena, std::make_unique<Task>(Task{shared_, worker}));
        } catch (const std::exception&) {
            // No memory or no threads: the run is on its way, and the caller can finish it alone.
            const std::lock_guard lock(shared_->mutex);
            shared_->present[worker] = false;
        }
    }
}

} // namespace hybmss

#endif
