#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace hybmss {

/// Places where two pieces of a stage meet, once in every round: whoever comes second finishes what both have begun.
/// With one worker that is at once, while all of it lies in the caches; with more, nobody waits.
class Meetings {
public:
    explicit Meetings(std::size_t places) : places_(places) {}

    /// Whether the other piece was here before, in this round; what it wrote until then is seen.
    bool second_at(std::size_t place) {
        return places_[place].arrivals.fetch_add(1, std::memory_order_acq_rel) % 2 == 1;
    }

private:
    struct alignas(64) Place {
        std::atomic<unsigned> arrivals{0}; ///< in all rounds
    };
    std::vector<Place> places_;
};

} // namespace hybmss
