#include "plan/threads/crew.hpp"

#include "plan/threads/spin_wait.hpp"

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
namespace {

// Longer than what a simulation does between two steps; short beside what a program would miss the core for.
constexpr std::chrono::microseconds kLinger{200};

/// Arenas live as long as the program, and crews share them: oneTBB never delivers what is left in an arena that is
/// destroyed, nor frees that arena's memory.
tbb::task_arena& arena_for(int threads) {
    struct Arenas {
        std::mutex mutex;
        std::map<int, tbb::task_arena> by_size;
    };
    static Arenas& arenas = *new Arenas; // outlives helpers that are still on their way when the program ends
    const std::lock_guard lock(arenas.mutex);
    return arenas.by_size.try_emplace(threads, threads).first->second;
}

} // namespace

struct Crew::Arena {
    // oneTBB starts no more threads than the machine has cores, and says so on stderr, unless it is told to.
    explicit Arena(int threads)
        : most(std::max(threads, tbb::info::default_concurrency())),
          limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(most)), arena(arena_for(most)) {}
    int most;
    tbb::global_control limit;
    tbb::task_arena& arena;
};

/// Brings a helper to its seat.
///
/// ThreadSanitizer cannot see that oneTBB, which is built without it, hands a task over before it starts: it is told
/// so, and does not look at how the task's one pointer is copied and read. Everything else is ordered by the board's
/// mutex and the run's atomics.
struct Crew::Invitation {
    std::shared_ptr<Board> board;
    std::size_t seat;

    static void accept(Invitation* given) {
#if defined(__SANITIZE_THREAD__)
        __tsan_acquire(given);
#endif
        const std::unique_ptr<Invitation> invitation(given);
        invitation->board->help(invitation->seat);
    }
    /// Takes the invitation over once it is on its way.
    static void send(tbb::task_arena& arena, std::unique_ptr<Invitation> invitation) {
#if defined(__SANITIZE_THREAD__)
        __tsan_release(invitation.get());
#endif
#if defined(__SANITIZE_ADDRESS__)
        // A program may end before oneTBB has delivered it, and LeakSanitizer does not look into oneTBB's memory.
        __lsan_ignore_object(invitation.get());
#endif
        arena.enqueue(Task{invitation.get()});
        static_cast<void>(invitation.release());
    }

    struct Task {
        Invitation* invitation;
        HYBMSS_NOT_FOR_TSAN void operator()() const { accept(invitation); }
    };
};

Crew::Crew(int threads) : board_(std::make_shared<Board>()), arena_(std::make_unique<Arena>(threads)) {
    board_->taken.assign(static_cast<std::size_t>(threads), false);
    board_->linger = threads <= tbb::info::default_concurrency();
}

Crew::~Crew() {
    const std::lock_guard lock(board_->mutex);
    board_->run = nullptr;
    board_->announced = ++board_->calls;
}

void Crew::Board::help(std::size_t seat) {
    using Clock = std::chrono::steady_clock;
    std::uint64_t answered = 0;
    for (;;) {
        std::shared_ptr<StagedRun> at_hand;
        {
            const std::lock_guard lock(mutex);
            if (calls == answered || !run) {
                taken[seat] = false;
                return;
            }
            answered = calls;
            at_hand = run;
        }
        at_hand->work(seat);
        at_hand.reset();
        const Clock::time_point leave = Clock::now() + kLinger;
        while (linger && announced.load(std::memory_order_relaxed) == answered && Clock::now() < leave) {
            SpinWait wait(100);
            for (int turn = 0; turn < 101 && announced.load(std::memory_order_relaxed) == answered; ++turn) {
                wait.turn();
            }
        }
    }
}

void Crew::call(const std::shared_ptr<StagedRun>& run) {
    std::vector<std::size_t> empty;
    std::uint64_t number = 0;
    {
        const std::lock_guard lock(board_->mutex);
        board_->run = run;
        number = ++board_->calls;
        for (std::size_t seat = 1; seat < board_->taken.size(); ++seat) {
            if (!board_->taken[seat]) {
                board_->taken[seat] = true;
                empty.push_back(seat);
            }
        }
    }
    board_->announced.store(number, std::memory_order_relaxed);
    for (const std::size_t seat : empty) {
        try {
            Invitation::send(arena_->arena, std::make_unique<Invitation>(Invitation{board_, seat}));
        } catch (const std::exception&) {
            // No memory or no threads: the run is on its way, and the caller can finish it alone.
            const std::lock_guard lock(board_->mutex);
            board_->taken[seat] = false;
        }
    }
}

} // namespace hybmss
