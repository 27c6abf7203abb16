#pragma once

#include "plan/threads/staged_run.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace hybmss {

/// Threads that oneTBB works with, the caller's included; without it, those that the machine runs at a time.
int default_threads();

/// Threads of oneTBB, or of the standard library where that is not there (HYBMSS_ONETBB), that help with one run after
/// the other.
///
/// A helper is asked for and not waited for. Between runs it stays for a moment, because to wake a thread up takes
/// longer than a step of a small body; then it goes back to where it came from.
class HelperThreads {
public:
    /// `threads` >= 2, the caller's included.
    explicit HelperThreads(int threads);
    /// Sends helpers away; does not wait for them.
    ~HelperThreads();
    HelperThreads(const HelperThreads&) = delete;
    HelperThreads& operator=(const HelperThreads&) = delete;

    /// Asks for help with a run of `threads` workers of which the caller is number 0. May be called from several
    /// threads at the same time: helpers go to the run that was begun last.
    void join(const std::shared_ptr<StagedRun>& run);

private:
    struct Arena;
    /// What helpers see, and own too: they may leave after the object has gone.
    struct Shared {
        std::mutex mutex;
        std::uint64_t runs = 0; ///< how many were begun
        /// The same, set a little later: helpers that stay watch it, and the mutex is free by then.
        std::atomic<std::uint64_t> announced{0};
        std::shared_ptr<StagedRun> run; ///< the last; null: go home
        std::vector<bool> present;      ///< by worker: a helper is here or on its way
        bool stays = true;

        void help(std::size_t worker);
    };

    std::shared_ptr<Shared> shared_;
    std::unique_ptr<Arena> arena_;
};

} // namespace hybmss
