#include "plan/workers.hpp"

#include "plan/crew.hpp"

#include <oneapi/tbb/info.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace hybmss {

Workers::Workers(int threads) : threads_(threads), crew_(threads > 1 ? std::make_unique<Crew>(threads) : nullptr) {}
Workers::Workers(Workers&&) noexcept = default;
Workers::~Workers() = default;

void Workers::run(std::span<const Stage> stages, long rounds) const {
    const bool divisible = std::any_of(stages.begin(), stages.end(), [](const Stage& s) { return s.pieces > 1; });
    if (!crew_ || inside_piece() || !divisible || rounds <= 0) {
        run_alone(stages, rounds);
        return;
    }
    const auto run = std::make_shared<StagedRun>(stages, rounds, threads_);
    crew_->call(run);
    run->work(0);
}

void Workers::run(std::size_t count, std::function<void(std::size_t, std::size_t)> piece) const {
    const Stage stage = {count, std::move(piece)};
    run({&stage, 1}, 1);
}

int useful_threads(int wanted, std::size_t nodes) {
    if (wanted < 0) {
        throw std::invalid_argument("threads = " + std::to_string(wanted) +
                                    " is not allowed: it must be at least 0 (0: all of the machine)");
    }
    const auto useful = static_cast<int>(std::min<std::size_t>(1 + nodes / kNodesPerThread, 1024));
    return std::min(wanted == 0 ? tbb::info::default_concurrency() : wanted, useful);
}

} // namespace hybmss
