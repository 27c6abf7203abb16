#pragma once

#include "hybmss/plan_options.hpp"
#include "hybmss/task_runner.hpp"
#include "plan/threads/staged_run.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace hybmss {

class HelperThreads;

/// A number of threads, the caller's among them, that run pieces of work. Helpers are oneTBB's or the
/// standard library's, and the caller waits for none that has not begun a piece; or they are those of a task runner.
///
/// What is called from within a piece runs on the calling thread alone: the others have pieces of their own.
class Workers {
public:
    /// `threads` >= 1. `runner` is copied; null: HelperThreads. `underflow`: within pieces.
    explicit Workers(int threads, const TaskRunner* runner = nullptr, Underflow underflow = Underflow::gradual);
    Workers(Workers&&) noexcept;
    ~Workers();

    int threads() const { return threads_; }

    /// The stages in their order, `rounds` times; each begins when all pieces of the one before are done. Returns when
    /// all are. worker < threads(). Which thread runs a piece is likely to be the same in every round. May be called
    /// from several threads at the same time.
    void run(std::span<const Stage> stages, long rounds) const;
    /// One stage.
    void run(std::size_t count, std::function<void(std::size_t index, std::size_t worker)> piece) const;

private:
    int threads_;
    std::unique_ptr<HelperThreads> helpers_; ///< null where there are none
    TaskRunner runner_;                      ///< the caller's; without functions where there is none
    Underflow underflow_;
};

/// A thread's share of a body, at least.
inline constexpr std::size_t kNodesPerThread = 2048;

/// The threads a body of `nodes` nodes takes, of those that the options allow: a small body's pieces are shorter than
/// the time it takes to hand them out, and one tile is one piece. Throws std::invalid_argument for less than 0 threads
/// and for a runner without functions or threads.
int useful_threads(const PlanOptions& options, std::size_t nodes);

} // namespace hybmss
