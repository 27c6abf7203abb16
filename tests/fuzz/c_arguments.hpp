#pragma once

/// \file
/// Arguments of the C interface drawn from a fuzzer's bytes. They keep the promises that no library can check (a
/// pointer leads to as much memory as the counts say, an object is alive) and break all others.

#include "hybmss/hybmss.h"

#include <fuzzer/FuzzedDataProvider.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace hybmss::fuzz {

class Arguments {
public:
    Arguments(const std::uint8_t* data, std::size_t size) : given_(data, size) {}

    bool left() { return given_.remaining_bytes() > 0; }
    bool seldom() { return given_.ConsumeIntegral<std::uint8_t>() % 16 == 0; }
    template <class T, std::size_t count>
    T one_of(const T (&all)[count]) {
        return all[static_cast<std::size_t>(below(static_cast<int>(count)))];
    }
    int below(int count) { return given_.ConsumeIntegralInRange(0, count - 1); }
    template <class Integer>
    Integer any() {
        return given_.ConsumeIntegral<Integer>();
    }

    /// Numbers that mean something, and those at the ends.
    double number();
    /// As it should be, seldom any.
    std::int32_t precision();
    hybmss_material material();
    hybmss_plan_options plan_options();
    std::vector<double> numbers(std::size_t count);

    /// A field of about `nodes` nodes over memory of its own, of either precision.
    template <class Field>
    Field field(std::size_t nodes);

    /// Zeros that live as long as this object; never null.
    void* memory(std::size_t bytes) {
        // To the byte, so that AddressSanitizer sees the end.
        return memory_.emplace_back(new char[bytes == 0 ? 1 : bytes]()).get();
    }

private:
    FuzzedDataProvider given_;
    std::vector<std::unique_ptr<char[]>> memory_;
    hybmss_task_runner runner_ = {};
};

/// A field's memory is at most so many components long.
inline constexpr std::size_t kLongestField = 1 << 14;

template <class Field>
Field Arguments::field(std::size_t nodes) {
    Field field = {};
    field.precision = precision();
    field.stride = seldom() ? any<std::int32_t>() : below(5);
    if (field.stride > 0 && nodes > kLongestField / static_cast<std::size_t>(field.stride)) {
        field.stride = 1; // of the right count, so far apart, they would be a field of memory that is not there
    }
    field.count = seldom() ? any<std::size_t>() : seldom() ? static_cast<std::size_t>(below(64)) : nodes;
    const std::size_t stride = field.stride > 0 ? static_cast<std::size_t>(field.stride) : 1;
    const bool too_long = field.count > kLongestField / stride;
    const std::size_t component = field.precision == HYBMSS_FLOAT ? sizeof(float) : sizeof(double);
    const std::size_t count = too_long || field.count == 0 ? 0 : (field.count - 1) * stride + 1;
    if (!seldom()) {
        // Of separate arrays each ends where its memory does; interleaved, z does.
        const bool interleaved = stride >= 3 && below(2) == 0;
        char* start = static_cast<char*>(memory(component * (count + (interleaved ? 2 : 0))));
        field.x = start;
        field.y = interleaved ? start + component : static_cast<char*>(memory(component * count));
        field.z = interleaved ? start + 2 * component : static_cast<char*>(memory(component * count));
        if (seldom()) {
            field.z = nullptr;
        } else if (seldom()) {
            field.y = start + 1;
        } else if (seldom()) {
            field.y = start;
        }
    }
    // A map of so long a field would lead to memory that is not there.
    if (!too_long && below(4) == 0) {
        auto* map = static_cast<std::uint32_t*>(memory(sizeof(std::uint32_t) * nodes));
        for (std::size_t n = 0; n < nodes; ++n) {
            map[n] = field.count == 0 || seldom() ? any<std::uint32_t>()
                                                  : static_cast<std::uint32_t>((n * 7 + nodes) % field.count);
        }
        field.map = map;
    }
    return field;
}

inline void* run_now(void (*task)(void*), void* context, void*) {
    task(context);
    return nullptr;
}
inline void nothing_to_finish(void*, void*) {}

inline double Arguments::number() {
    switch (below(12)) {
    case 0:
        return 0;
    case 1:
        return -1;
    case 2:
        return std::numeric_limits<double>::quiet_NaN();
    case 3:
        return std::numeric_limits<double>::infinity();
    case 4:
        return std::numeric_limits<double>::max();
    case 5:
        return std::numeric_limits<double>::denorm_min();
    case 6:
        return given_.ConsumeFloatingPoint<double>();
    case 7:
        return 1e4;
    default:
        return given_.ConsumeFloatingPointInRange(0.0, 1.0);
    }
}

inline std::int32_t Arguments::precision() {
    return seldom() ? any<std::int32_t>() : below(2);
}

inline hybmss_material Arguments::material() {
    hybmss_material material = hybmss_default_material();
    if (below(4) == 0) {
        material = {number(), number(), number(), number(), any<std::int8_t>(), number(), number(), any<std::int32_t>(),
                    number(), number()};
    } else {
        material.poisson_ratio = given_.ConsumeFloatingPointInRange(-0.99, 0.499);
        material.face_diagonal_ratio = below(3);
        material.volume_energy = below(4);
        material.springs = below(3);
    }
    return material;
}

inline hybmss_plan_options Arguments::plan_options() {
    static constexpr const char* kLayouts[] = {nullptr,        "",       "flat-rows", "active-rows", "packed-xyzw",
                                               "coloured-soa", "no such"};
    static constexpr const char* kSets[] = {nullptr, "automatic", "sse2", "avx2", "neon", "no such"};
    hybmss_plan_options options = hybmss_default_plan_options();
    options.layout = one_of(kLayouts);
    options.instruction_set = seldom() ? one_of(kSets) : nullptr;
    options.accuracy = seldom() ? any<std::int32_t>() : below(3);
    options.threads = seldom() ? any<std::int32_t>() : 1;
    // Measuring takes a third of a second, and the clock's word is not the input's.
    options.measure = seldom() ? 2 : 0;
    if (below(4) == 0) {
        runner_ = {seldom() ? any<std::int32_t>() : below(4), seldom() ? nullptr : &run_now,
                   seldom() ? nullptr : &nothing_to_finish, nullptr};
        options.task_runner = &runner_;
    }
    return options;
}

inline std::vector<double> Arguments::numbers(std::size_t count) {
    std::vector<double> all(count);
    for (double& value : all) {
        value = number();
    }
    return all;
}

} // namespace hybmss::fuzz
