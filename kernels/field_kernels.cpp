// Compiled once for each instruction set: passes over whole fields, whatever their layout.
#include "kernels/compiled_set.hpp"

namespace hybmss::kernels {
namespace {

/// v <- v - factor p/m, p <- 0. The energy taken out is m (v_old^2 - v_new^2)/2 = factor p (v_old + v_new)/2.
template <class V>
double kick(Scalar<V>* velocity, Scalar<V>* product, const Scalar<V>* inverse_mass, Scalar<V> factor,
            std::ptrdiff_t begin, std::ptrdiff_t end) {
    V sum = splat<V>(0);
    double alike_sum = 0;
    for (std::ptrdiff_t n = begin; n < end; n += kWidth<V>) {
        const V impulse = splat<V>(factor) * load_lanes<V>(product + n), before = load_lanes<V>(velocity + n);
        const V after = subtract_product(load_lanes<V>(inverse_mass + n), impulse, before);
        if constexpr (Traits<V>::kAlike) {
            add_in_double(alike_sum, impulse * (before + after));
        } else {
            sum = multiply_add(impulse, before + after, sum);
        }
        store_lanes(velocity + n, after);
        store_lanes(product + n, splat<V>(0));
    }
    return 0.5 * (Traits<V>::kAlike ? alike_sum : sum_in_double(sum));
}

/// sum <- sum + sign more, more <- 0; sign is 1 or -1, so that the product is exact.
template <class V>
void move_into(Scalar<V>* sum, Scalar<V>* more, Scalar<V> sign, Range begin, Range end) {
    for (Range n = begin; n < end; n += kWidth<V>) {
        store_lanes(sum + n, multiply_add(splat<V>(sign), load_lanes<V>(more + n), load_lanes<V>(sum + n)));
        store_lanes(more + n, splat<V>(0));
    }
}

} // namespace

HYBMSS_DEFINE_ORDERED_KERNEL(kick);
HYBMSS_DEFINE_COMMON_KERNEL(move_into);

} // namespace hybmss::kernels
