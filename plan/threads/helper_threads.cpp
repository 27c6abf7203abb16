#include "plan/threads/helper_threads.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>

#if HYBMSS_ONETBB

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

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

using Work = std::function<void()>;

/// How oneTBB is given its work.
///
/// ThreadSanitizer cannot see that oneTBB, which is built without it, hands a task over before it starts: it is told
/// so, and does not look at how the task's one pointer is copied and read. Everything else is ordered by the shared
/// mutex and the run's atomics.
struct Call {
    Work* work;
    HYBMSS_NOT_FOR_TSAN void operator()() const { run(work); }
    static void run(Work* given) {
#if defined(__SANITIZE_THREAD__)
        __tsan_acquire(given);
#endif
        (*std::unique_ptr<Work>(given))();
    }
};

} // namespace

struct HelperThreads::Arena {
    explicit Arena(int threads) : arena(arena_for(std::max(threads, default_threads()))) { allow(threads); }
    void enqueue(Work given) {
        auto work = std::make_unique<Work>(std::move(given));
#if defined(__SANITIZE_THREAD__)
        __tsan_release(work.get());
#endif
#if defined(__SANITIZE_ADDRESS__)
        // A program may end before oneTBB has delivered it, and LeakSanitizer does not look into oneTBB's memory.
        __lsan_ignore_object(work.get());
#endif
        arena.enqueue(Call{work.get()});
        static_cast<void>(work.release());
    }
    tbb::task_arena& arena;
};

#else

#include <condition_variable>
#include <deque>
#include <thread>

namespace hybmss {

int default_threads() {
    // The standard library reads a file to answer.
    static const int cores = std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
    return cores;
}

/// Threads of the standard library, started as they are first needed. They live as long as the program, and all objects
/// share them.
struct HelperThreads::Arena {
    explicit Arena(int threads) {
        const std::lock_guard lock(pool().mutex);
        pool().most = std::max(pool().most, static_cast<std::size_t>(threads) - 1);
    }
    void enqueue(std::function<void()> work) {
        Pool& all = pool();
        const std::lock_guard lock(all.mutex);
        all.waiting.push_back(std::move(work));
        if (all.waiting.size() > all.idle && all.started < all.most) {
            try {
                std::thread(serve).detach();
                ++all.started;
            } catch (const std::exception&) {
                if (all.started == 0) {
                    all.waiting.pop_back();
                    throw;
                }
            }
        }
        all.work.notify_one();
    }

private:
    struct Pool {
        std::mutex mutex;
        std::condition_variable work;
        std::deque<std::function<void()>> waiting;
        std::size_t idle = 0, started = 0, most = 0;
    };
    static Pool& pool() {
        static Pool& pool = *new Pool; // outlives the threads, which end with the program
        return pool;
    }
    static void serve() {
        Pool& all = pool();
        std::unique_lock lock(all.mutex);
        for (;;) {
            ++all.idle;
            all.work.wait(lock, [&all] { return !all.waiting.empty(); });
            --all.idle;
            const std::function<void()> mine = std::move(all.waiting.front());
            all.waiting.pop_front();
            lock.unlock();
            mine();
            lock.lock();
        }
    }
};

#endif

// Longer than what a simulation does between two steps; short beside what a program would miss the core for.
constexpr std::chrono::microseconds kStay{200};

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
            arena_->enqueue([shared = shared_, worker] { shared->help(worker); });
        } catch (const std::exception&) {
            // No memory or no threads: the run is on its way, and the caller can finish it alone.
            const std::lock_guard lock(shared_->mutex);
            shared_->present[worker] = false;
        }
    }
}

} // namespace hybmss
