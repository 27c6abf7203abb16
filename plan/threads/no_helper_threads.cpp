// Instead of helper_threads.cpp where the library is built without oneTBB: nobody comes to help, and a run's caller,
// who waits for nobody, gets everything done.
#include "plan/threads/helper_threads.hpp"

namespace hybmss {

int default_threads() {
    return 1;
}

struct HelperThreads::Arena {};

HelperThreads::HelperThreads(int) {}
HelperThreads::~HelperThreads() = default;

void HelperThreads::join(const std::shared_ptr<StagedRun>&) {}

} // namespace hybmss
