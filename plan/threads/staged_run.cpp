#include "plan/threads/staged_run.hpp"

#include <algorithm>
#include <thread>
#include <utility>

namespace hybmss {
namespace {

constexpr std::size_t kMostUnits = 65535;

// Some 40 microseconds: far above what a worker with a core of its own is late by.
constexpr int kPauses = 2000;
// With more workers than cores somebody waited for has none, and the next barrier comes soon.
constexpr int kPausesWithoutCore = 20;

thread_local bool at_work = false;

/// Marks the thread as being at work on pieces while it lives.
class AtWork {
public:
    explicit AtWork(Underflow underflow) : before_(std::exchange(at_work, true)), underflow_(underflow) {}
    ~AtWork() { at_work = before_; }
    AtWork(const AtWork&) = delete;
    AtWork& operator=(const AtWork&) = delete;

private:
    bool before_;
    UnderflowMode underflow_;
};

int pauses_of(int workers) {
    // The standard library reads a file to answer: longer than a step of a small body.
    static const unsigned cores = std::thread::hardware_concurrency();
    return static_cast<unsigned>(workers) > cores ? kPausesWithoutCore : kPauses;
}

std::uint64_t pack(std::uint32_t round, std::uint64_t begin, std::uint64_t end) {
    return std::uint64_t{round} << 32 | begin << 16 | end;
}

} // namespace

bool inside_piece() {
    return at_work;
}

void run_alone(std::span<const Stage> stages, long rounds, Underflow underflow) noexcept {
    const AtWork mark(underflow);
    for (long round = 0; round < rounds; ++round) {
        for (const Stage& stage : stages) {
            for (std::size_t piece = 0; piece < stage.pieces; ++piece) {
                stage.run(piece, 0);
            }
        }
    }
}

StagedRun::StagedRun(std::span<const Stage> stages, long rounds, int workers, Underflow underflow)
    : stages_(stages), workers_(static_cast<std::size_t>(workers)), pauses_(pauses_of(workers)), underflow_(underflow) {
    for (std::size_t s = 0; s < stages.size(); ++s) {
        const std::size_t pieces = stages[s].pieces;
        if (pieces > 0) {
            const std::size_t most = workers_ * kMostUnits, grain = (pieces + most - 1) / most;
            const std::size_t units = (pieces + grain - 1) / grain;
            round_units_ += units;
            plans_.push_back({s, pieces, grain, units, round_units_});
        }
    }
    total_units_ = round_units_ * static_cast<std::uint64_t>(std::max(rounds, 0L));
    shares_ = std::make_unique<Share[]>(workers_ * plans_.size());
}

std::size_t StagedRun::share_begin(const Plan& plan, std::size_t worker) const {
    return (plan.units * worker + workers_ - 1) / workers_;
}

std::size_t StagedRun::claim(std::size_t place, std::size_t owner, std::uint32_t round, bool first) noexcept {
    const Plan& plan = plans_[place];
    const std::size_t share = share_begin(plan, owner);
    std::atomic<std::uint64_t>& left = shares_[place * workers_ + owner].left;
    // Relaxed: what a piece reads was written before `done_` came to this stage.
    std::uint64_t seen = left.load(std::memory_order_relaxed);
    for (;;) {
        std::uint64_t begin = seen >> 16 & 0xffff, end = seen & 0xffff;
        const auto seen_round = static_cast<std::uint32_t>(seen >> 32);
        if (seen_round + 1 == round) {
            begin = 0;
            end = share_begin(plan, owner + 1) - share;
        } else if (seen_round != round) {
            return plan.units; // this worker was held up, and the others have gone on without it
        }
        if (begin == end) {
            return plan.units;
        }
        const auto unit = share + static_cast<std::size_t>(first ? begin++ : --end);
        if (left.compare_exchange_weak(seen, pack(round, begin, end), std::memory_order_relaxed)) {
            return unit;
        }
    }
}

std::uint64_t StagedRun::work_on(std::size_t place, std::uint32_t round, std::size_t worker) noexcept {
    const Plan& plan = plans_[place];
    std::uint64_t done = 0;
    for (std::size_t i = 0; i < workers_; ++i) {
        const std::size_t owner = (worker + i) % workers_;
        for (std::size_t unit; (unit = claim(place, owner, round, owner == worker)) < plan.units; ++done) {
            const std::size_t end = std::min((unit + 1) * plan.grain, plan.pieces);
            for (std::size_t piece = unit * plan.grain; piece < end; ++piece) {
                // Only now is the caller's memory touched: it waits for this piece.
                stages_[plan.stage].run(piece, worker);
            }
        }
    }
    return done;
}

void StagedRun::work(std::size_t worker) noexcept {
    const AtWork mark(underflow_);
    std::uint64_t done = done_.load(std::memory_order_acquire);
    while (done < total_units_) {
        const std::uint64_t round = done / round_units_, in_round = done % round_units_;
        const auto plan = std::upper_bound(plans_.begin(), plans_.end(), in_round,
                                           [](std::uint64_t unit, const Plan& p) { return unit < p.end; });
        const std::uint64_t end = round * round_units_ + plan->end;
        const std::uint64_t mine =
            work_on(static_cast<std::size_t>(plan - plans_.begin()), static_cast<std::uint32_t>(round + 1), worker);
        if (mine > 0) {
            done = done_.fetch_add(mine, std::memory_order_acq_rel) + mine;
        }
        for (SpinWait wait(pauses_); done < end; done = done_.load(std::memory_order_acquire)) {
            wait.turn();
        }
    }
}

} // namespace hybmss
