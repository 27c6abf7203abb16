#pragma once

#include "kernels/arguments.hpp"

namespace hybmss::kernels {

/// The kernels of a lattice in flat rows.
template <class T>
struct LatticeKernels {
    using Layer = void (*)(const LatticeLayer<T>&);
    using Energy = LayerEnergy (*)(const LatticeLayer<T>&);

    Layer layer[2][kVolumeCount][kAccuracyCount][kFinishCount]; ///< [face diagonals][volume][accuracy][finish]
    Layer top[2][kAccuracyCount][kFinishCount];
    Layer join[kFinishCount];
    Energy energy[2][kVolumeCount][2]; ///< [face diagonals][volume][top]
};

} // namespace hybmss::kernels
