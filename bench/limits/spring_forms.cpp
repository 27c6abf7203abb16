#include "bench/limits/spring_forms.hpp"

namespace hybmss::bench {

const SpringForms& spring_forms(InstructionSet set) {
#if defined(__x86_64__)
    switch (set) {
    case InstructionSet::avx512:
        return kAvx512Forms;
    case InstructionSet::avx2:
        return kAvx2Forms;
    default:
        return kSse2Forms;
    }
#else
    static_cast<void>(set);
    return kNeonForms;
#endif
}

} // namespace hybmss::bench
