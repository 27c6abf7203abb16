// Compiled once for each instruction set.
#include "kernels/compiled_set.hpp"

namespace hybmss::kernels {
namespace {

/// v <- v - factor p/m, p <- 0. The energy taken out is m (v_old^2 - v_new^2)/2 = factor p (v_old + v_new)/2.
template <class V>
double kick(Scalar<V>* velocity, Scalar<V>* product, const Scalar<V>* inverse_mass, Scalar<V> factor,
            std::ptrdiff_t begin, std::ptrdiff_t end) {
    V sum = splat<V>(0);
    for (std::ptrdiff_t n = begin; n < end; n += kWidth<V>) {
        const V impulse = splat<V>(factor) * load_lanes<V>(product + n), before = load_lanes<V>(velocity + n);
        const V after = subtract_product(load_lanes<V>(inverse_mass + n), impulse, before);
        sum = multiply_add(impulse, before + after, sum);
        store_lanes(velocity + n, after);
        store_lanes(product + n, splat<V>(0));
    }
    return 0.5 * sum_in_double(sum);
}

} // namespace

HYBMSS_DEFINE_KERNEL(kick);

} // namespace hybmss::kernels
