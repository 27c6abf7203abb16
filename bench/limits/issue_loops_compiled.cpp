// Compiled once for each instruction set: the loops behind issue_loops.hpp. Everything is in an anonymous namespace for
// the reason that kernels/simd.hpp gives.
#include "bench/limits/issue_loops.hpp"
#include "kernels/compiled_set.hpp"

#include <utility>

namespace hybmss::bench {
namespace {

using namespace hybmss::kernels;

/// Hides where a value comes from, and that nobody needs it: the compiler can neither fold nor drop what made it.
template <class V>
HYBMSS_INLINE void opaque(V& v) {
#if defined(__x86_64__)
    asm volatile("" : "+v"(v.data));
#else
    asm volatile("" : "+w"(v.data));
#endif
}

/// Independent chains hide an operation's latency; with the constant they fill sixteen registers. Eight multiply-adds
/// of four cycles' latency can start twice a cycle; so can seven additions of three.
constexpr int kMultiplyChains = 8, kAddChains = 7, kChains = kMultiplyChains + kAddChains;

/// Calls step(chain) for each, spelled out: left as a loop, the compiler would keep the chains in memory.
template <class V, class Step, int... chains>
HYBMSS_INLINE void for_chains(V* a, Step step, std::integer_sequence<int, chains...>) {
    (step(a[chains]), ...);
}

template <class V>
struct Chains {
    HYBMSS_INLINE Chains() {
        each([](V& v) {
            v = splat<V>(Scalar<V>(1.25));
            opaque(v);
        });
        opaque(b);
    }
    HYBMSS_INLINE ~Chains() {
        each([](V& v) { opaque(v); });
    }
    template <class Step>
    HYBMSS_INLINE void each(Step step) {
        for_chains(a, step, std::make_integer_sequence<int, kChains>{});
    }
    V a[kChains];
    V b = splat<V>(Scalar<V>(0.5));
};

// a -> a / 2 + 1/2 stays near one: normal numbers throughout. Without FMA the multiplications alone, by one.
template <class V>
HYBMSS_INLINE void multiply_step(V& a, V b) {
#if defined(__FMA__) || defined(__aarch64__)
    a = multiply_add(a, b, b);
#else
    a = a * b;
#endif
}

template <class V>
HYBMSS_INLINE void unit_factor([[maybe_unused]] V& b) {
#if !defined(__FMA__) && !defined(__aarch64__)
    b = splat<V>(1);
    opaque(b);
#endif
}

template <class V>
void issue_multiply_add(long operations, void*) {
    Chains<V> c;
    unit_factor(c.b);
    for (long done = 0; done < operations; done += kChains) {
        c.each([&](V& a) { multiply_step(a, c.b); });
    }
}

template <class V>
void issue_add(long operations, void*) {
    Chains<V> c;
    for (long done = 0; done < operations; done += kChains) {
        c.each([&](V& a) { a = a + c.b; });
    }
}

/// A multiply-add and an addition, each on the chain whose turn it is; every `period` pairs a store, unless 0.
template <int pair, int period, class V>
HYBMSS_INLINE void mixed_pair(Chains<V>& c, [[maybe_unused]] Scalar<V>* scratch) {
    multiply_step(c.a[pair % kMultiplyChains], c.b);
    V& sum = c.a[kMultiplyChains + pair % kAddChains];
    sum = sum + c.b;
    if constexpr (period > 0 && pair % (period > 0 ? period : 1) == 0) {
        store_lanes(scratch + (pair / period) * kWidth<V>, sum);
        asm volatile("" ::: "memory");
    }
}

/// kMixed operations, spelled out: left as a loop, the compiler would keep the chains in memory.
template <int stores, class V, int... pairs>
HYBMSS_INLINE void mix(Chains<V>& c, Scalar<V>* scratch, std::integer_sequence<int, pairs...>) {
    constexpr int kPairs = sizeof...(pairs);
    // A multiple of both numbers of chains, so that all chains grow alike.
    static_assert(kPairs % kMultiplyChains == 0 && kPairs % kAddChains == 0);
    constexpr int kPeriod = stores > 0 ? kPairs / stores : 0;
    (mixed_pair<pairs, kPeriod>(c, scratch), ...);
}

template <class V, int stores>
void issue_mixed(long operations, void* scratch) {
    Chains<V> c;
    unit_factor(c.b);
    for (long done = 0; done < operations; done += kMixed) {
        mix<stores>(c, static_cast<Scalar<V>*>(scratch), std::make_integer_sequence<int, kMixed / 2>{});
    }
}

template <class V>
void issue_store(long operations, void* scratch) {
    const V value = splat<V>(Scalar<V>(1));
    for (long done = 0; done < operations; done += 16) {
        for (int i = 0; i < 16; ++i) {
            value.store_aligned(static_cast<Scalar<V>*>(scratch) + i * kWidth<V>);
        }
        asm volatile("" ::: "memory");
    }
}

template <class V>
void issue_square_root(long operations, void*) {
    Chains<V> c;
    for (long done = 0; done < operations; done += kChains) {
        c.each([&](V& a) {
            a = square_root(a);
            opaque(a);
        });
    }
}

template <class V>
void issue_divide(long operations, void*) {
    Chains<V> c;
    for (long done = 0; done < operations; done += kChains) {
        c.each([&](V& a) {
            a = divide(c.b, a);
            opaque(a);
        });
    }
}

template <class V>
void issue_reciprocal_square_root(long operations, void*) {
    Chains<V> c;
    for (long done = 0; done < operations; done += kChains) {
        c.each([&](V& a) {
            a = reciprocal_square_root_seed(a);
            opaque(a);
        });
    }
}

template <class V>
constexpr IssueLoops issue_loops() {
    IssueLoops loops{kWidth<V>,
                     {issue_multiply_add<V>, issue_add<V>, issue_mixed<V, 0>, issue_mixed<V, kStoresInMix>,
                      issue_mixed<V, kSpillsInMix>, issue_store<V>, issue_square_root<V>, issue_divide<V>, nullptr}};
    if constexpr (seed_quality<V>() != Seed::none) {
        loops.issue[static_cast<int>(Issue::reciprocal_square_root)] = issue_reciprocal_square_root<V>;
    }
    return loops;
}

/// Calls step(first element) for 16 vectors at a time.
template <class V, class Step>
HYBMSS_INLINE void for_vectors(std::size_t bytes, Step step) {
    constexpr std::size_t kVectors = 16;
    const std::size_t count = bytes / sizeof(Scalar<V>);
    for (std::size_t n = 0; n < count; n += kVectors * static_cast<std::size_t>(kWidth<V>)) {
        for (std::size_t i = 0; i < kVectors; ++i) {
            step(n + i * static_cast<std::size_t>(kWidth<V>));
        }
    }
}

template <class V>
void stream_read(const void* from, std::size_t bytes) {
    const auto* in = static_cast<const Scalar<V>*>(from);
    for_vectors<V>(bytes, [&](std::size_t n) {
        V v = V::load_aligned(in + n);
        opaque(v);
    });
}

template <class V>
void stream_write(void* to, std::size_t bytes) {
    auto* out = static_cast<Scalar<V>*>(to);
    const V v = splat<V>(Scalar<V>(1));
    for_vectors<V>(bytes, [&](std::size_t n) { v.store_aligned(out + n); });
    asm volatile("" ::: "memory");
}

template <class V>
void stream_copy(const void* from, void* to, std::size_t bytes) {
    const auto* in = static_cast<const Scalar<V>*>(from);
    auto* out = static_cast<Scalar<V>*>(to);
    for_vectors<V>(bytes, [&](std::size_t n) {
        V v = V::load_aligned(in + n);
        opaque(v); // or the compiler would call memcpy
        v.store_aligned(out + n);
    });
    asm volatile("" ::: "memory");
}

template <class V>
void stream_update(void* data, std::size_t bytes) {
    stream_copy<V>(data, data, bytes);
}

} // namespace

namespace HYBMSS_KERNEL_SET {
extern const LimitLoops limit_loops;
constinit const LimitLoops limit_loops = {
    .instruction_set = InstructionSet::HYBMSS_KERNEL_SET,
    .float_loops = issue_loops<FloatBatch>(),
    .double_loops = issue_loops<DoubleBatch>(),
    .stream = {stream_read<FloatBatch>, stream_write<FloatBatch>, stream_copy<FloatBatch>, stream_update<FloatBatch>}};
} // namespace HYBMSS_KERNEL_SET

} // namespace hybmss::bench
