#pragma once

#include "plan/threads/staged_run.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace hybmss {

/// Threads of oneTBB that help with one run after the other.
///
/// A helper is asked for and not waited for. Between runs it stays for a moment, because to wake a thread up takes
/// longer than a step of a small body; then it goes back to oneTBB.
class Crew {
public:
    /// `threads` >= 2, the caller's included.
    explicit Crew(int threads);
    /// Sends helpers away; does not wait for them.
    ~Crew();
    Crew(const Crew&) = delete;
    Crew& operator=(const Crew&) = delete;

    /// Asks for help with a run of `threads` workers of which the caller is number 0. May be called from several
    /// threads at the same time: helpers go to the run that was called for last.
    void call(const std::shared_ptr<StagedRun>& run);

private:
    struct Arena;
    struct Invitation;
    /// What helpers see, and own together with the crew: they may leave after it has gone.
    struct Board {
        std::mutex mutex;
        std::uint64_t calls = 0; ///< how often a run was put up
        /// The same, set a little later: helpers that stay watch it, and the mutex is free by then.
        std::atomic<std::uint64_t> announced{0};
        std::shared_ptr<StagedRun> run; ///< null: go home
        std::vector<bool> taken;        ///< seats of helpers that are here or on their way
        bool linger = true;

        void help(std::size_t seat);
    };

    std::shared_ptr<Board> board_;
    std::unique_ptr<Arena> arena_;
};

} // namespace hybmss
