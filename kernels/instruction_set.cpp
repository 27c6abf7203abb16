#include "hybmss/instruction_set.hpp"

#include "kernels/kernel_table.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace hybmss {
namespace kernels {

// What table_kernels.cpp defines, in a namespace for each instruction set.
#define HYBMSS_INSTRUCTION_SET(set, ...)                                                                               \
    namespace set {                                                                                                    \
    extern const KernelTable<float> float_table, exact_float_table;                                                    \
    extern const KernelTable<double> double_table, exact_double_table;                                                 \
    }
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET

} // namespace kernels

namespace {

struct Entry {
    InstructionSet set;
    bool (*runs_here)();
    const kernels::KernelTable<float>&float_table, &exact_float_table;
    const kernels::KernelTable<double>&double_table, &exact_double_table;
};

constexpr Entry kEntries[] = {
#define HYBMSS_BUILT_ONLY
#define HYBMSS_INSTRUCTION_SET(set, type, ...)                                                                         \
    {InstructionSet::set,        []() -> bool { return __VA_ARGS__; },                                                                     \
     kernels::set::float_table,  kernels::set::exact_float_table,                                                      \
     kernels::set::double_table, kernels::set::exact_double_table},
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
#undef HYBMSS_BUILT_ONLY
};

constexpr std::pair<InstructionSet, std::string_view> kNames[] = {
    {InstructionSet::automatic, "automatic"},
#define HYBMSS_INSTRUCTION_SET(set, ...) {InstructionSet::set, #set},
#include "kernels/instruction_sets.inc"
#undef HYBMSS_INSTRUCTION_SET
};

} // namespace

std::string_view name(InstructionSet set) {
    for (const auto& [known, text] : kNames) {
        if (known == set) {
            return text;
        }
    }
    return "unknown";
}

InstructionSet parse_instruction_set(std::string_view text) {
    std::string allowed;
    for (const auto& [set, known] : kNames) {
        if (known == text) {
            return set;
        }
        allowed += (allowed.empty() ? "" : ", ") + std::string(known);
    }
    throw std::invalid_argument("instruction set \"" + std::string(text) + "\" is not known: it must be one of " +
                                allowed);
}

std::vector<InstructionSet> available_instruction_sets() {
    std::vector<InstructionSet> sets;
    for (const Entry& entry : kEntries) {
        if (entry.runs_here()) {
            sets.push_back(entry.set);
        }
    }
    return sets;
}

InstructionSet resolve(InstructionSet wanted) {
    const std::vector<InstructionSet> sets = available_instruction_sets();
    if (sets.empty()) {
        throw std::invalid_argument("this build has no kernels for this machine's processor");
    }
    if (wanted == InstructionSet::automatic) {
        const char* forced = std::getenv("HYBMSS_ISA");
        wanted = forced && *forced ? parse_instruction_set(forced) : InstructionSet::automatic;
        if (wanted == InstructionSet::automatic) {
            return sets.back();
        }
    }
    if (std::find(sets.begin(), sets.end(), wanted) == sets.end()) {
        std::string allowed;
        for (InstructionSet set : sets) {
            allowed += (allowed.empty() ? "" : ", ") + std::string(name(set));
        }
        throw std::invalid_argument("instruction set " + std::string(name(wanted)) +
                                    " is not available here: this machine and build have " + allowed);
    }
    return wanted;
}

namespace kernels {

template <class T>
const KernelTable<T>& kernel_table(InstructionSet set, Accuracy accuracy) {
    const bool exact = accuracy == Accuracy::exact;
    for (const Entry& entry : kEntries) {
        if (entry.set == set && entry.runs_here()) {
            if constexpr (std::is_same_v<T, float>) {
                return exact ? entry.exact_float_table : entry.float_table;
            } else {
                return exact ? entry.exact_double_table : entry.double_table;
            }
        }
    }
    throw std::invalid_argument("no kernels for the instruction set " + std::string(name(set)));
}

template const KernelTable<float>& kernel_table<float>(InstructionSet, Accuracy);
template const KernelTable<double>& kernel_table<double>(InstructionSet, Accuracy);

} // namespace kernels
} // namespace hybmss
