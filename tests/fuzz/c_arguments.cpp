#include "tests/fuzz/c_arguments.hpp"

namespace hybmss::fuzz {
namespace {

void* run_now(void (*task)(void*), void* context, void*) {
    task(context);
    return nullptr;
}
void nothing_to_finish(void*, void*) {}

} // namespace

double Arguments::number() {
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

std::int32_t Arguments::precision() {
    return seldom() ? any<std::int32_t>() : below(2);
}

hybmss_material Arguments::material() {
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

hybmss_plan_options Arguments::plan_options() {
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

std::vector<double> Arguments::numbers(std::size_t count) {
    std::vector<double> all(count);
    for (double& value : all) {
        value = number();
    }
    return all;
}

} // namespace hybmss::fuzz
