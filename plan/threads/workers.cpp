#include "plan/threads/workers.hpp"

#include "plan/threads/helper_threads.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybmss {

namespace {

/// A worker's part in a run, as a task of a runner.
struct Share {
    StagedRun* run;
    std::size_t worker;
    static void work(void* share) {
        const Share& mine = *static_cast<Share*>(share);
        mine.run->work(mine.worker);
    }
};

/// A runner's tasks for one run: all of them have run when the object goes.
class Tasks {
public:
    Tasks(const TaskRunner& runner, std::size_t threads) : runner_(runner), shares_(threads), handles_(threads) {}
    ~Tasks() {
        for (void* handle : handles_) {
            if (handle) {
                runner_.finish(handle, runner_.user);
            }
        }
    }
    Tasks(const Tasks&) = delete;
    Tasks& operator=(const Tasks&) = delete;

    void enqueue(StagedRun& run) {
        for (std::size_t worker = 1; worker < shares_.size(); ++worker) {
            shares_[worker] = {&run, worker};
            handles_[worker] = runner_.enqueue(&Share::work, &shares_[worker], runner_.user);
        }
    }

private:
    const TaskRunner& runner_;
    std::vector<Share> shares_;
    std::vector<void*> handles_;
};

} // namespace

Workers::Workers(int threads, const TaskRunner* runner, Underflow underflow)
    : threads_(threads), helpers_(threads > 1 && !runner ? std::make_unique<HelperThreads>(threads) : nullptr),
      runner_(runner ? *runner : TaskRunner{}), underflow_(underflow) {}
Workers::Workers(Workers&&) noexcept = default;
Workers::~Workers() = default;

void Workers::run(std::span<const Stage> stages, long rounds) const {
    const bool divisible = std::any_of(stages.begin(), stages.end(), [](const Stage& s) { return s.pieces > 1; });
    if (threads_ == 1 || inside_piece() || !divisible || rounds <= 0) {
        run_alone(stages, rounds, underflow_);
        return;
    }
    if (runner_.enqueue) {
        StagedRun run(stages, rounds, threads_, underflow_);
        Tasks tasks(runner_, static_cast<std::size_t>(threads_));
        tasks.enqueue(run);
        run.work(0);
        return;
    }
    const auto run = std::make_shared<StagedRun>(stages, rounds, threads_, underflow_);
    helpers_->join(run);
    run->work(0);
}

void Workers::run(std::size_t count, std::function<void(std::size_t, std::size_t)> piece) const {
    const Stage stage = {count, std::move(piece)};
    run({&stage, 1}, 1);
}

int useful_threads(const PlanOptions& options, std::size_t nodes) {
    const int wanted = options.threads;
    const TaskRunner* runner = options.task_runner;
    if (wanted < 0) {
        throw std::invalid_argument("threads = " + std::to_string(wanted) +
                                    " is not allowed: it must be at least 0 (0: all of the machine)");
    }
    if (runner && (!runner->enqueue || !runner->finish || runner->threads < 1)) {
        throw std::invalid_argument("task_runner: it needs enqueue, finish and at least 1 thread (threads = " +
                                    std::to_string(runner->threads) + ")");
    }
    if (options.one_tile) {
        return 1;
    }
    const auto useful = static_cast<int>(std::min<std::size_t>(1 + nodes / kNodesPerThread, 1024));
    const int all = runner ? runner->threads : default_threads();
    const int given = wanted == 0 ? all : runner ? std::min(wanted, all) : wanted;
    return std::min(given, useful);
}

} // namespace hybmss
