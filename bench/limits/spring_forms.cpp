#include "bench/limits/spring_forms.hpp"

#include <stdexcept>

namespace hybmss::bench {

#define HYBMSS_BUILT_ONLY
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    namespace set {                                                                                                    \
    extern const SpringForms spring_forms;                                                                             \
    }
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET

const SpringForms& spring_forms(InstructionSet wanted) {
    switch (wanted) {
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    case InstructionSet::set:                                                                                          \
        return set::spring_forms;
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
    default:
        throw std::invalid_argument("no loops for the instruction set " + std::string(name(wanted)));
    }
}

} // namespace hybmss::bench
