#pragma once

/// \file
/// Another program's threads in place of oneTBB's.

namespace hybmss {

/// How a plan asks a program's own task system for help. Name it in PlanOptions::task_runner.
///
/// For every call that is worth sharing, the library enqueues up to `threads` - 1 tasks, does its own share on the
/// calling thread, and then finishes each task. Every task can do all the work that is left, so nothing waits for a
/// task that has not begun, and a runner may run it at any time: within enqueue, on another thread, or as late as
/// within finish. Results are the same to the bit. The functions may be called from several threads at the same time,
/// and must not throw.
struct TaskRunner {
    /// Threads at most that work on one call, the caller's included; >= 1.
    int threads = 1;
    /// Arranges that task(context) runs exactly once, at the latest within finish. Returns a handle for finish, or null
    /// where the task has already run, serially, within this call.
    void* (*enqueue)(void (*task)(void* context), void* context, void* user) = nullptr;
    /// Returns when the task has run. Called once for every handle that is not null, on the thread that enqueued it.
    void (*finish)(void* handle, void* user) = nullptr;
    void* user = nullptr; ///< handed back to both functions
};

} // namespace hybmss
