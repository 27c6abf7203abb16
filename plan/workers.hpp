#pragma once

#include "plan/staged_run.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace hybmss {

class Crew;

/// A number of threads, the caller's among them, that run pieces of work. Helpers are oneTBB's; the caller waits for
/// none that has not begun a piece.
///
/// What is called from within a piece runs on the calling thread alone: the others have pieces of their own.
class Workers {
public:
    /// `threads` >= 1.
    explicit Workers(int threads);
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
    std::unique_ptr<Crew> crew_;
};

/// A thread's share of a body, at least.
inline constexpr std::size_t kNodesPerThread = 2048;

/// The threads a body of `nodes` nodes takes, of the `wanted` (0: all of the machine): a small body's pieces are
/// shorter than the time it takes to hand them out.
int useful_threads(int wanted, std::size_t nodes);

} // namespace hybmss
