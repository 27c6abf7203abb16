#include "plan/workers.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#endif

namespace hybmss {
namespace {

/// Tells ThreadSanitizer of an order that oneTBB keeps: the sanitizer cannot see into a oneTBB built without it.
struct Order {
    char address = 0;
#if defined(__SANITIZE_THREAD__)
    void before() {
        __tsan_release(&address);
    }
    void after() {
        __tsan_acquire(&address);
    }
#else
    void before() {}
    void after() {}
#endif
};

} // namespace

struct Workers::Arena {
    // oneTBB starts no more threads than the machine has cores, and says so on stderr, unless it is told to.
    explicit Arena(int threads)
        : limit(tbb::global_control::max_allowed_parallelism,
                static_cast<std::size_t>(std::max(threads, tbb::info::default_concurrency()))),
          arena(threads) {}
    tbb::global_control limit;
    tbb::task_arena arena;
};

Workers::Workers(int threads) : threads_(threads) {
    if (threads > 1) {
        arena_ = std::make_unique<Arena>(threads);
    }
}
Workers::Workers(Workers&&) noexcept = default;
Workers::~Workers() = default;

void Workers::run(std::size_t count, const std::function<void(std::size_t, std::size_t)>& piece) const {
    if (!arena_ || count <= 1) {
        for (std::size_t i = 0; i < count; ++i) {
            piece(i, 0);
        }
        return;
    }
    Order begin, end;
    begin.before();
    arena_->arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, count, 1),
            [&](const tbb::blocked_range<std::size_t>& range) {
                begin.after();
                const auto worker = static_cast<std::size_t>(tbb::this_task_arena::current_thread_index());
                for (std::size_t i = range.begin(); i != range.end(); ++i) {
                    piece(i, worker);
                }
                end.before();
            },
            tbb::simple_partitioner());
    });
    end.after();
}

int useful_threads(int wanted, std::size_t nodes) {
    if (wanted < 0) {
        throw std::invalid_argument("threads = " + std::to_string(wanted) +
                                    " is not allowed: it must be at least 0 (0: all of the machine)");
    }
    constexpr std::size_t kNodesPerThread = 2048;
    const auto useful = static_cast<int>(std::min<std::size_t>(1 + nodes / kNodesPerThread, 1024));
    return std::min(wanted == 0 ? tbb::info::default_concurrency() : wanted, useful);
}

} // namespace hybmss
