// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/stiffening_energy_impl.hpp"

namespace hybmss::kernels {
namespace {

template <SpringLaw law, class V>
constexpr void set_law(NetworkEffectKernels<Scalar<V>>& kernels) {
    constexpr int l = effect_index(law), accurate = tangent_index(Accuracy::accurate),
                  exact = tangent_index(Accuracy::exact);
    kernels.soa[l].spring_product[accurate] = network_spring_product<Accuracy::accurate, V, law>;
    kernels.soa[l].spring_product[exact] = network_spring_product<Accuracy::exact, V, law>;
    kernels.packed[l].spring_product[accurate] = packed_spring_product<Accuracy::accurate, V, law>;
    kernels.packed[l].spring_product[exact] = packed_spring_product<Accuracy::exact, V, law>;
    kernels.runs[l].spring_product[accurate] = run_spring_product<Accuracy::accurate, V, law>;
    kernels.runs[l].spring_product[exact] = run_spring_product<Accuracy::exact, V, law>;
    if constexpr (law != SpringLaw::stiffening) {
        kernels.soa[l].spring_diagonal[accurate] = network_spring_diagonal<Accuracy::accurate, V, law>;
        kernels.soa[l].spring_diagonal[exact] = network_spring_diagonal<Accuracy::exact, V, law>;
        kernels.packed[l].spring_diagonal[accurate] = packed_spring_diagonal<Accuracy::accurate, V, law>;
        kernels.packed[l].spring_diagonal[exact] = packed_spring_diagonal<Accuracy::exact, V, law>;
        kernels.runs[l].spring_diagonal[accurate] = run_spring_diagonal<Accuracy::accurate, V, law>;
        kernels.runs[l].spring_diagonal[exact] = run_spring_diagonal<Accuracy::exact, V, law>;
    }
}

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

template <class V>
constexpr NetworkEffectKernels<Scalar<V>> network_effect_kernels() {
    NetworkEffectKernels<Scalar<V>> kernels{};
    set_law<SpringLaw::damping, V>(kernels);
    set_law<SpringLaw::stiffening, V>(kernels);
    set_law<SpringLaw::stiffening_tangent, V>(kernels);
    kernels.soa_energy = soa_stiffening_energy<V>;
    kernels.packed_energy = packed_stiffening_energy<V>;
    kernels.runs_energy = run_stiffening_energy<V>;
    kernels.kick = kick<V>;
    return kernels;
}

} // namespace

constinit const NetworkEffectKernels<float> HYBMSS_KERNEL_SET::kNetworkEffectsFloat =
    network_effect_kernels<FloatBatch>();
constinit const NetworkEffectKernels<double> HYBMSS_KERNEL_SET::kNetworkEffectsDouble =
    network_effect_kernels<DoubleBatch>();

} // namespace hybmss::kernels
