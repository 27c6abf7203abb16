#pragma once

// Springs' laws beyond the elastic one, as passes of their own: a body whose springs neither damp nor stiffen has no
// trace of them.

#include "kernels/hessian_kernels.hpp"

namespace hybmss::kernels {

/// The laws here, as indices of tables: SpringLaw without `elastic`.
inline constexpr int kEffectLawCount = 3;
constexpr int effect_index(SpringLaw law) {
    return static_cast<int>(law) - 1;
}

/// Of lattices in any of their layouts. The sweeps are those of second derivatives with another law, without volume;
/// `stiffening` has no diagonal.
template <class T>
struct LatticeEffectKernels {
    LatticeHessianKernels<T> law[kEffectLawCount];
    /// The stiffening energy of a layer's springs, in units of force times h; [face diagonals][topmost plane]
    double (*stiffening_energy[2][2])(const LatticeHessianLayer<T, 3>&);
};

/// Of networks: as LatticeEffectKernels, without cells. Energies are in J, over [begin, end).
template <class T>
struct NetworkEffectKernels {
    using Range = std::ptrdiff_t;
    SoaHessianKernels<T> soa[kEffectLawCount];
    PackedHessianKernels<T> packed[kEffectLawCount];
    RunHessianKernels<T> runs[kEffectLawCount];
    double (*soa_energy)(const NetworkSprings<T>&, const HessianArrays<T>&, Range begin, Range end);
    double (*packed_energy)(const SpringBlock<T>*, const PackedHessian<T>&, Range begin, Range end);
    double (*runs_energy)(const SpringRuns<T>*, const PackedHessian<T>&, Range begin, Range end);
    /// velocity -= factor * inverse_mass * product, product = 0, over [begin, end), multiples of kMaxWidth. Returns
    /// what this takes out of sum m v^2 / 2, by the unit of velocity^2 / inverse_mass.
    double (*kick)(T* velocity, T* product, const T* inverse_mass, T factor, Range begin, Range end);
};

} // namespace hybmss::kernels
