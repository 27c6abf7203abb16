// Compiled once for each instruction set, like the kernels.
#include "kernels/compiled_set.hpp"
#include "kernels/volume_law.hpp"
#include "tests/kernels/simd_probe.hpp"

namespace hybmss::testing {
namespace {

using namespace hybmss::kernels;

template <class V, class Operation>
constexpr auto unary(Operation) {
    return +[](const Scalar<V>* a, Scalar<V>* out) { store_lanes(out, Operation{}(load_lanes<V>(a))); };
}
template <class V, class Operation>
constexpr auto binary(Operation) {
    return +[](const Scalar<V>* a, const Scalar<V>* b, Scalar<V>* out) {
        store_lanes(out, Operation{}(load_lanes<V>(a), load_lanes<V>(b)));
    };
}
template <class V, class Operation>
constexpr auto ternary(Operation) {
    return +[](const Scalar<V>* a, const Scalar<V>* b, const Scalar<V>* c, Scalar<V>* out) {
        store_lanes(out, Operation{}(load_lanes<V>(a), load_lanes<V>(b), load_lanes<V>(c)));
    };
}

template <class V>
constexpr SimdProbe<Scalar<V>> make_probe() {
    using T = Scalar<V>;
    SimdProbe<T> p{};
    p.instruction_set = InstructionSet::HYBMSS_KERNEL_SET;
    p.width = kWidth<V>;
    p.multiply_add = ternary<V>([](V a, V b, V c) { return kernels::multiply_add(a, b, c); });
    p.subtract_product = ternary<V>([](V a, V b, V c) { return kernels::subtract_product(a, b, c); });
    p.multiply_subtract = ternary<V>([](V a, V b, V c) { return kernels::multiply_subtract(a, b, c); });
    p.minus_product_minus = ternary<V>([](V a, V b, V c) { return kernels::minus_product_minus(a, b, c); });
    p.maximum = binary<V>([](V a, V b) { return kernels::maximum(a, b); });
    p.square_root = unary<V>([](V a) { return kernels::square_root(a); });
    p.divide = binary<V>([](V a, V b) { return kernels::divide(a, b); });
    p.shift_in = binary<V>([](V a, V b) { return kernels::shift_in(a, b); });
    p.gather = [](const T* base, const std::int32_t* index, T* out) { store_lanes(out, gather_lanes<V>(base, index)); };
    p.scatter = [](const T* values, T* base, const std::int32_t* index) {
        scatter_lanes(load_lanes<V>(values), base, index);
    };
    p.sum_in_double = [](const T* a) { return kernels::sum_in_double(load_lanes<V>(a)); };
    p.where_positive = binary<V>([](V gate, V value) { return kernels::where_positive(gate, value); });
    p.one_where_positive = unary<V>([](V a) { return kernels::one_where_positive(a); });
    p.round_fraction_to_11_bits = unary<V>([](V a) { return round_fraction<11>(a); });
    p.cube_root_seed = unary<V>([](V a) { return kernels::cube_root_seed(a); });
    if constexpr (seed_quality<V>() != Seed::none) {
        p.reciprocal_square_root_seed = unary<V>([](V a) { return kernels::reciprocal_square_root_seed(a); });
        p.reciprocal_seed = unary<V>([](V a) { return kernels::reciprocal_seed(a); });
        p.seed_error = seed_quality<V>() == Seed::bits14   ? 0x1p-14
                       : seed_quality<V>() == Seed::bits11 ? 1.5 * 0x1p-12
                                                           : 0x1p-8;
    }
    p.one_minus_rsqrt_fast = unary<V>([](V s) { return one_minus_rsqrt<Accuracy::fast>(s); });
    p.one_minus_rsqrt_accurate = unary<V>([](V s) { return one_minus_rsqrt<Accuracy::accurate>(s); });
    p.one_minus_rsqrt_exact = unary<V>([](V s) { return one_minus_rsqrt<Accuracy::exact>(s); });
    p.squared_strain = unary<V>([](V s) { return kernels::squared_strain(s); });
    p.cube_root_minus_one = unary<V>([](V j) { return kernels::cube_root_minus_one(j); });
    p.mean_stretch_slope = unary<V>([](V j) { return volume_slope<Volume::mean_stretch>(j); });
    p.mean_stretch_energy = unary<V>([](V j) { return volume_energy<Volume::mean_stretch>(j); });
    return p;
}

} // namespace

namespace HYBMSS_KERNEL_SET {
extern const SimdProbe<float> float_probe;
extern const SimdProbe<double> double_probe;
const SimdProbe<float> float_probe = make_probe<FloatBatch>();
const SimdProbe<double> double_probe = make_probe<DoubleBatch>();
} // namespace HYBMSS_KERNEL_SET

} // namespace hybmss::testing
