#include "bench/limits/issue_loops.hpp"

#include <stdexcept>

namespace hybmss::bench {

#define HYBMSS_BUILT_ONLY
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    namespace set {                                                                                                    \
    extern const LimitLoops limit_loops;                                                                               \
    }
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET

const LimitLoops& limit_loops(InstructionSet wanted) {
    switch (wanted) {
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    case InstructionSet::set:                                                                                          \
        return set::limit_loops;
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
    default:
        throw std::invalid_argument("no loops for the instruction set " + std::string(name(wanted)));
    }
}

} // namespace hybmss::bench
