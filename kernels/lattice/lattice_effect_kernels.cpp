// Compiled once for each instruction set.
#include "kernels/compiled_kernels.hpp"
#include "kernels/compiled_set.hpp"
#include "kernels/lattice/lattice_hessian_diagonal_impl.hpp"
#include "kernels/stiffening_energy_impl.hpp"

namespace hybmss::kernels {
namespace {

template <bool face_diagonals, Accuracy accuracy, SpringLaw law, class V>
constexpr void set_sweeps(LatticeHessianKernels<Scalar<V>>& table) {
    constexpr int a = tangent_index(accuracy), none = static_cast<int>(Volume::none);
    table.product.layer[face_diagonals][none][a] =
        lattice_hessian_product<face_diagonals, Volume::none, accuracy, V, law>;
    table.product.top[face_diagonals][a] = lattice_hessian_product_top<face_diagonals, accuracy, V, law>;
    if constexpr (law != SpringLaw::stiffening) {
        table.diagonal.layer[face_diagonals][none][a] =
            lattice_hessian_diagonal<face_diagonals, Volume::none, accuracy, V, law>;
        table.diagonal.top[face_diagonals][a] = lattice_hessian_diagonal_top<face_diagonals, accuracy, V, law>;
    }
}

template <SpringLaw law, class V>
constexpr void set_law(LatticeEffectKernels<Scalar<V>>& kernels) {
    LatticeHessianKernels<Scalar<V>>& table = kernels.law[effect_index(law)];
    set_sweeps<false, Accuracy::accurate, law, V>(table);
    set_sweeps<false, Accuracy::exact, law, V>(table);
    set_sweeps<true, Accuracy::accurate, law, V>(table);
    set_sweeps<true, Accuracy::exact, law, V>(table);
    table.product.join = lattice_hessian_join<3, V>;
    table.diagonal.join = lattice_hessian_join<kBlockEntries, V>;
}

template <class V>
constexpr LatticeEffectKernels<Scalar<V>> lattice_effect_kernels() {
    LatticeEffectKernels<Scalar<V>> kernels{};
    set_law<SpringLaw::damping, V>(kernels);
    set_law<SpringLaw::stiffening, V>(kernels);
    set_law<SpringLaw::stiffening_tangent, V>(kernels);
    kernels.stiffening_energy[false][false] = lattice_stiffening_energy<false, false, V>;
    kernels.stiffening_energy[false][true] = lattice_stiffening_energy<false, true, V>;
    kernels.stiffening_energy[true][false] = lattice_stiffening_energy<true, false, V>;
    kernels.stiffening_energy[true][true] = lattice_stiffening_energy<true, true, V>;
    return kernels;
}

} // namespace

constinit const LatticeEffectKernels<float> HYBMSS_KERNEL_SET::kLatticeEffectsFloat =
    lattice_effect_kernels<FloatBatch>();
constinit const LatticeEffectKernels<double> HYBMSS_KERNEL_SET::kLatticeEffectsDouble =
    lattice_effect_kernels<DoubleBatch>();

} // namespace hybmss::kernels
