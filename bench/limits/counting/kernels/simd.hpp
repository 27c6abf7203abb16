#pragma once

// A stand-in for the real kernels/simd.hpp: the same vector operations, which compute nothing and are counted. The one
// file that counts (operation_count.cpp) finds this header first, so that it is the kernels' own text that is counted.
//
// A value is a number: equal operations on equal operands give the same number and count once, as a compiler would
// compute them once; what is made of constants alone is free, as it moves out of the loop; a negation is free, as it
// becomes the sign of a neighbouring multiply-add.

#include "bench/limits/operation_count.hpp"
#include "hybmss/instruction_set.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#define HYBMSS_INLINE inline

namespace hybmss::kernels {
namespace {

/// What is counted, and which values are known.
struct Ledger {
    bench::OperationCount count;
    std::map<std::array<std::int64_t, 4>, std::int64_t> known; ///< operation and operands -> value
    std::map<std::int64_t, const void*> unused_loads;          ///< value -> address
    std::set<const void*> read, written;                       ///< first lanes' addresses
    std::int64_t next = 1;
    std::int64_t stores = 0;
};
Ledger ledger;

template <class T, InstructionSet set, bool alike>
struct Counted {
    std::int64_t value = 0; ///< below zero: a constant
};

enum Operation { kConstant, kLoad, kNegate, kMultiply, kMultiplyAdd, kAdd, kOther, kRoot, kDivide, kEstimate };

template <class T, InstructionSet set>
using Batch = Counted<T, set, false>;

enum class Seed { none, bits8, bits11, bits14 };

template <class V>
struct Traits;
template <class T, InstructionSet set, bool alike>
struct Traits<Counted<T, set, alike>> {
    using Scalar = T;
    static constexpr int kBytes = set == InstructionSet::avx512 ? 64 : set == InstructionSet::avx2 ? 32 : 16;
    static constexpr int kWidth = kBytes / static_cast<int>(sizeof(T));
    static constexpr bool kAlike = alike;
    static constexpr bool kAvx512 = set == InstructionSet::avx512;
    static constexpr bool kFloat = sizeof(T) == 4;
    static constexpr bool kManyRegisters = set == InstructionSet::avx512 || set == InstructionSet::neon;
    static constexpr bool kFused = set != InstructionSet::sse2 && !alike;
    static constexpr Seed kSeed = kAvx512                       ? Seed::bits14
                                  : !kFloat                     ? Seed::none
                                  : set == InstructionSet::neon ? Seed::bits8
                                                                : Seed::bits11;
    static constexpr InstructionSet kSet = set;
};
template <class V>
using Scalar = typename Traits<V>::Scalar;
template <class V>
inline constexpr int kWidth = Traits<V>::kWidth;
template <class V>
constexpr Seed seed_quality() {
    return Traits<V>::kSeed;
}

/// The value of `slots` operations of one kind; `kind` tells them from others that count under the same heading.
template <class V>
V evaluate(Operation operation, double bench::OperationCount::*heading, double slots, std::int64_t kind, V a, V b = {},
           V c = {}) {
    for (const V& operand : {a, b, c}) {
        const auto load = ledger.unused_loads.find(operand.value);
        if (load != ledger.unused_loads.end()) {
            ledger.read.insert(load->second);
            ledger.count.loads += 1;
            ledger.unused_loads.erase(load);
        }
    }
    const std::array<std::int64_t, 4> key = {100 * operation + kind, a.value, b.value, c.value};
    const auto [entry, is_new] = ledger.known.emplace(key, 0);
    if (is_new) {
        const bool constant = a.value <= 0 && b.value <= 0 && c.value <= 0;
        entry->second = constant ? -ledger.next++ : ledger.next++;
        if (!constant && heading != nullptr) {
            ledger.count.*heading += slots;
        }
    }
    return {entry->second};
}
template <class V>
void order(V& a, V& b) {
    if (b.value < a.value) {
        std::swap(a, b);
    }
}

template <class V>
V splat(Scalar<V> value) {
    std::int64_t bits = 0;
    std::memcpy(&bits, &value, sizeof value);
    const auto [entry, is_new] = ledger.known.emplace(std::array<std::int64_t, 4>{100 * kConstant, bits, 0, 0}, 0);
    if (is_new) {
        entry->second = -ledger.next++;
    }
    return {entry->second};
}
template <class V>
V load_lanes(const Scalar<V>* p) {
    const auto address = static_cast<std::int64_t>(reinterpret_cast<std::intptr_t>(p));
    const auto [entry, is_new] =
        ledger.known.emplace(std::array<std::int64_t, 4>{100 * kLoad, address, ledger.stores, 0}, 0);
    if (is_new) {
        entry->second = ledger.next++;
        ledger.unused_loads.emplace(entry->second, p); // it counts when somebody uses it
    }
    return {entry->second};
}
template <class V>
void store_lanes(Scalar<V>* p, V) {
    ledger.stores += 1;
    ledger.count.stores += 1;
    ledger.written.insert(p);
}

template <class T, InstructionSet set, bool alike>
Counted<T, set, alike> operator+(Counted<T, set, alike> a, Counted<T, set, alike> b) {
    order(a, b);
    return evaluate(kAdd, &bench::OperationCount::additions, 1, 0, a, b);
}
template <class T, InstructionSet set, bool alike>
Counted<T, set, alike> operator-(Counted<T, set, alike> a, Counted<T, set, alike> b) {
    return evaluate(kAdd, &bench::OperationCount::additions, 1, 1, a, b);
}
template <class T, InstructionSet set, bool alike>
Counted<T, set, alike> operator*(Counted<T, set, alike> a, Counted<T, set, alike> b) {
    order(a, b);
    return evaluate(kMultiply, &bench::OperationCount::multiplications, 1, 0, a, b);
}
template <class T, InstructionSet set, bool alike>
Counted<T, set, alike> operator-(Counted<T, set, alike> a) {
    return evaluate(kNegate, nullptr, 0, 0, a);
}

template <class V>
V fused(std::int64_t kind, V a, V b, V c) {
    order(a, b);
    return evaluate(kMultiplyAdd, &bench::OperationCount::multiplications, 1, kind, a, b, c);
}
template <class V>
V multiply_add(V a, V b, V c) {
    if constexpr (!Traits<V>::kFused) {
        return a * b + c;
    }
    return fused(0, a, b, c);
}
template <class V>
V subtract_product(V a, V b, V c) {
    if constexpr (!Traits<V>::kFused) {
        return c - a * b;
    }
    return fused(1, a, b, c);
}
template <class V>
V multiply_subtract(V a, V b, V c) {
    if constexpr (!Traits<V>::kFused) {
        return a * b - c;
    }
    return fused(2, a, b, c);
}

template <class V>
V minus_product_minus(V a, V b, V c) {
    if constexpr (!Traits<V>::kFused) {
        return -(a * b) - c;
    }
    return fused(3, a, b, c);
}

template <class V>
V other(std::int64_t kind, double slots, V a, V b = {}) {
    return evaluate(kOther, &bench::OperationCount::others, slots, kind, a, b);
}
template <class V>
V maximum(V a, V b) {
    order(a, b);
    return other(0, 1, a, b);
}
template <class V>
V square_root(V a) {
    return evaluate(kRoot, &bench::OperationCount::square_roots, 1, 0, a);
}
template <class V>
V divide(V a, V b) {
    return evaluate(kDivide, &bench::OperationCount::divisions, 1, 0, a, b);
}
template <class V>
V reciprocal_square_root_seed(V a) {
    return evaluate(kEstimate, &bench::OperationCount::estimates, 1, 0, a);
}
template <class V>
V reciprocal_seed(V a) {
    return evaluate(kEstimate, &bench::OperationCount::estimates, 1, 1, a);
}
/// How many instructions the real ones are: see there.
template <class V>
V shift_in(V previous, V current) {
    constexpr InstructionSet set = Traits<V>::kSet;
    return other(1,
                 set == InstructionSet::avx2                        ? 2
                 : set == InstructionSet::sse2 && Traits<V>::kFloat ? 3
                                                                    : 1,
                 previous, current);
}
template <int bits, class V>
V round_fraction(V a) {
    return other(2, 2, a);
}
template <class V>
V cube_root_seed(V a) {
    return other(3, Traits<V>::kFloat ? 3 : 6, a);
}
/// A comparison, which counts once for all values that it gates, and a selection.
template <class V>
V where_positive(V gate, V value) {
    return other(5, 1, other(4, 1, gate), value);
}
template <class V>
V one_where_positive(V gate) {
    return where_positive(gate, splat<V>(1));
}
inline std::ptrdiff_t forget(std::ptrdiff_t n) {
    return n;
}
template <class V>
double sum_in_double(V) {
    return 0;
}
template <class V>
void add_in_double(double&, V) {}

} // namespace
} // namespace hybmss::kernels
