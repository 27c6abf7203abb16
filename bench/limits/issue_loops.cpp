#include "bench/limits/issue_loops.hpp"

namespace hybmss::bench {

const LimitLoops& limit_loops(InstructionSet set) {
#if defined(__x86_64__)
    switch (set) {
    case InstructionSet::avx512:
        return kAvx512Loops;
    case InstructionSet::avx2:
        return kAvx2Loops;
    default:
        return kSse2Loops;
    }
#else
    static_cast<void>(set);
    return kNeonLoops;
#endif
}

} // namespace hybmss::bench
