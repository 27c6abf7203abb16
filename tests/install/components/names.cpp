// Every choice that has a name is linked, and is found again by its name.

#include "hybmss/accuracy.hpp"
#include "hybmss/equilibrium.hpp"
#include "hybmss/instruction_set.hpp"
#include "hybmss/plan_options.hpp"
#include "hybmss/precision.hpp"

int main() {
    using namespace hybmss;
    const bool same = parse_precision(name(Precision::float32)) == Precision::float32 &&
                      parse_accuracy(name(Accuracy::exact)) == Accuracy::exact &&
                      parse_effort(name(Effort::measure)) == Effort::measure &&
                      parse_preconditioner(name(PreconditionerKind{})) == PreconditionerKind{} &&
                      parse_instruction_set(name(InstructionSet::avx2)) == InstructionSet::avx2;
    return same ? 0 : 1;
}
