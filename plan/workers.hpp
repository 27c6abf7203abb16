#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace hybmss {

/// A fixed number of threads that run independent pieces of work.
class Workers {
public:
    /// `threads` >= 1.
    explicit Workers(int threads);
    Workers(Workers&&) noexcept;
    ~Workers();

    int threads() const { return threads_; }

    /// Calls piece(index, worker) for every index below `count`, each once, in any order; worker < threads() is the
    /// same for at most one piece at a time. Returns when all are done. May be called from several threads at the same
    /// time.
    void run(std::size_t count, const std::function<void(std::size_t index, std::size_t worker)>& piece) const;

private:
    struct Arena;
    int threads_;
    std::unique_ptr<Arena> arena_;
};

/// The threads a body of `nodes` nodes takes, of the `wanted` (0: all of the machine): a small body's pieces are
/// shorter than the time it takes to hand them out.
int useful_threads(int wanted, std::size_t nodes);

} // namespace hybmss
