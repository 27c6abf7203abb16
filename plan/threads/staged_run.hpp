#pragma once

#include "plan/threads/underflow.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <span>
#include <thread>
#include <vector>

namespace hybmss {

/// Independent pieces of work: run(piece, worker) once for every piece below `pieces`, in any order, several at a time.
/// `worker` is the same for at most one piece at a time. Must not throw.
struct Stage {
    std::size_t pieces = 0;
    std::function<void(std::size_t piece, std::size_t worker)> run;
};

/// Appends stages to others.
inline void append(std::vector<Stage> more, std::vector<Stage>& stages) {
    stages.insert(stages.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

/// The stages in their order, `rounds` times, on the calling thread alone, as worker 0.
void run_alone(std::span<const Stage> stages, long rounds, Underflow underflow = Underflow::gradual) noexcept;

/// Whether the calling thread is at work on a piece.
bool inside_piece();

/// Stages, one after the other, again and again, for any number of workers that turn up and go as they like: each
/// claims pieces of the stage at hand, and when the last one is done all go on to the next. Nobody waits for a worker
/// that holds no piece, so one alone gets everything done.
///
///     stage 0, round 0    stage 1, round 0    stage 0, round 1   ...
///     0 1 2 3 4 5 6 7     8 9                 10 11 ...              <- pieces, counted through: `done_` says where
///     worker 0 > < worker 1                                             everybody is
///
/// Every worker has a share of each stage, the same in every round, so that a piece finds the caches as the worker left
/// them; it takes its own share from the front, then the others' from the back. (To wait a moment before looking at the
/// others' shares saves transfers of cache lines, but gained nothing in a step.)
class StagedRun {
public:
    /// `stages` must outlive the rounds, not the object. `workers` >= 1.
    StagedRun(std::span<const Stage> stages, long rounds, int workers, Underflow underflow = Underflow::gradual);

    /// Works until all rounds are done, by whomever. worker < workers, nobody else's meanwhile.
    void work(std::size_t worker) noexcept;

private:
    /// What is left of a worker's share of a stage: the round's number (from 1; in 32 bits), and the first and the last
    /// but one unit left (16 bits each). Still that of the round before where nobody has claimed in this one. On a
    /// cache line of its own: in most rounds nobody but its worker writes it.
    struct alignas(64) Share {
        std::atomic<std::uint64_t> left{0};
    };
    struct Plan {
        std::size_t stage; ///< in stages_
        std::size_t pieces;
        std::size_t grain; ///< pieces a unit: a share has at most 65535 units
        std::size_t units;
        std::uint64_t end; ///< units of this stage and those before it
    };

    std::size_t share_begin(const Plan& plan, std::size_t worker) const;
    /// Claims one unit of `owner`'s share, first or last; `units` where none is left.
    std::size_t claim(std::size_t place, std::size_t owner, std::uint32_t round, bool first) noexcept;
    /// Claims and does what is left of a stage; returns how many units that were.
    std::uint64_t work_on(std::size_t place, std::uint32_t round, std::size_t worker) noexcept;

    std::span<const Stage> stages_;
    std::size_t workers_;
    int pauses_;
    Underflow underflow_;
    std::vector<Plan> plans_; ///< of the stages that have pieces
    std::uint64_t round_units_ = 0, total_units_ = 0;
    std::unique_ptr<Share[]> shares_; ///< workers_ for every plan
    alignas(64) std::atomic<std::uint64_t> done_{0};
};

/// Places where two pieces of a stage meet, once in every round: whoever comes second finishes what both have begun.
/// With one worker that is at once, while all of it lies in the caches; with more, nobody waits.
class Meetings {
public:
    explicit Meetings(std::size_t places) : places_(places) {}

    /// Whether the other piece was here before, in this round; what it wrote until then is seen.
    bool second_at(std::size_t place) {
        return places_[place].arrivals.fetch_add(1, std::memory_order_acq_rel) % 2 == 1;
    }

private:
    struct alignas(64) Place {
        std::atomic<unsigned> arrivals{0}; ///< in all rounds
    };
    std::vector<Place> places_;
};

/// Tells the core that this thread only waits.
inline void pause_core() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// One turn after the other of a wait for another thread: pauses at first, since what is waited for is nearly always a
/// fraction of a microsecond away; then lets other threads run, since the one waited for may be without a core.
class SpinWait {
public:
    /// `pauses`: turns before the thread lets others run.
    explicit SpinWait(int pauses) : pauses_(pauses) {}
    void turn() {
        if (pauses_ > 0) {
            --pauses_;
            pause_core();
        } else {
            std::this_thread::yield();
        }
    }

private:
    int pauses_;
};

} // namespace hybmss
