#include "hybmss/instruction_set.hpp"

#include "kernels/compiled_kernels.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace hybmss {
namespace {

struct Entry {
    InstructionSet set;
    std::string_view name;
    bool (*runs_here)();
    kernels::KernelTable<float> single;
    kernels::KernelTable<double> twice;
};

// The tables of an instruction set for both precisions.
#define HYBMSS_TABLES(set)                                                                                             \
    {InstructionSet::set,                                                                                              \
     &kernels::set::kLatticeFloat,                                                                                     \
     &kernels::set::kActiveFloat,                                                                                      \
     &kernels::set::kLatticeHessianFloat,                                                                              \
     &kernels::set::kSoaFloat,                                                                                         \
     &kernels::set::kPackedFloat,                                                                                      \
     &kernels::set::kRunsFloat,                                                                                        \
     &kernels::set::kSoaHessianFloat,                                                                                  \
     &kernels::set::kPackedHessianFloat,                                                                               \
     &kernels::set::kRunsHessianFloat,                                                                                 \
     &kernels::set::kLatticeEffectsFloat,                                                                              \
     &kernels::set::kNetworkEffectsFloat},                                                                             \
    {                                                                                                                  \
        InstructionSet::set, &kernels::set::kLatticeDouble, &kernels::set::kActiveDouble,                              \
            &kernels::set::kLatticeHessianDouble, &kernels::set::kSoaDouble, &kernels::set::kPackedDouble,             \
            &kernels::set::kRunsDouble, &kernels::set::kSoaHessianDouble, &kernels::set::kPackedHessianDouble,         \
            &kernels::set::kRunsHessianDouble, &kernels::set::kLatticeEffectsDouble,                                   \
            &kernels::set::kNetworkEffectsDouble                                                                       \
    }

// Every instruction set that this build has kernels for, weakest first. xsimd's own detection misreads some bits, hence
// the compiler's.
const Entry kEntries[] = {
#if defined(HYBMSS_HAS_SSE2)
    {InstructionSet::sse2, "sse2", [] { return true; }, HYBMSS_TABLES(sse2)},
#endif
#if defined(HYBMSS_HAS_AVX2)
    {InstructionSet::avx2, "avx2", [] { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); },
     HYBMSS_TABLES(avx2)},
#endif
#if defined(HYBMSS_HAS_AVX512)
    {InstructionSet::avx512, "avx512",
     [] {
         return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
                __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
                __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("fma");
     },
     HYBMSS_TABLES(avx512)},
#endif
#if defined(HYBMSS_HAS_NEON)
    {InstructionSet::neon, "neon", [] { return true; }, HYBMSS_TABLES(neon)},
#endif
};

constexpr std::pair<InstructionSet, std::string_view> kNames[] = {{InstructionSet::automatic, "automatic"},
                                                                  {InstructionSet::sse2, "sse2"},
                                                                  {InstructionSet::avx2, "avx2"},
                                                                  {InstructionSet::avx512, "avx512"},
                                                                  {InstructionSet::neon, "neon"}};

#undef HYBMSS_TABLES

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
const KernelTable<T>& kernel_table(InstructionSet set) {
    for (const Entry& entry : kEntries) {
        if (entry.set == set && entry.runs_here()) {
            if constexpr (std::is_same_v<T, float>) {
                return entry.single;
            } else {
                return entry.twice;
            }
        }
    }
    throw std::invalid_argument("no kernels for the instruction set " + std::string(name(set)));
}

template const KernelTable<float>& kernel_table<float>(InstructionSet);
template const KernelTable<double>& kernel_table<double>(InstructionSet);

} // namespace kernels
} // namespace hybmss
