#pragma once

#include "plan/threads/workers.hpp"

#include <cstddef>
#include <exception>
#include <limits>
#include <vector>

namespace hybmss {

/// Whole bodies, or pairs of them, shared out among threads.
class SharedOut {
public:
    /// `threads`: at most, >= 0; 0 for all of the machine. Throws std::invalid_argument where it is negative.
    explicit SharedOut(int threads)
        : workers_(useful_threads(options(threads), std::numeric_limits<std::size_t>::max())) {}

    const Workers& workers() const { return workers_; }

    /// Calls work(i) for every i below `count`. What one of them throws (there may be no memory) is thrown again in the
    /// end.
    template <class Work>
    void run(std::size_t count, const Work& work) const {
        std::vector<std::exception_ptr> thrown(count);
        workers_.run(count, [&](std::size_t i, std::size_t) {
            try {
                work(i);
            } catch (...) {
                thrown[i] = std::current_exception();
            }
        });
        for (const std::exception_ptr& exception : thrown) {
            if (exception) {
                std::rethrow_exception(exception);
            }
        }
    }

private:
    static PlanOptions options(int threads) {
        PlanOptions options;
        options.threads = threads;
        return options;
    }

    Workers workers_;
};

} // namespace hybmss
