#pragma once

#include "kernels/arguments.hpp"

namespace hybmss::kernels {

/// The kernels that sweep a lattice layer by layer: flat-rows and active-rows each have a table of them.
template <class T>
struct LatticeKernels {
    using Layer = void (*)(const LatticeLayer<T>&);
    using Energy = LayerEnergy (*)(const LatticeLayer<T>&);

    Layer layer[2][kVolumeCount][kAccuracyCount][kFinishCount]; ///< [face diagonals][volume][accuracy][finish]
    Layer top[2][kAccuracyCount][kFinishCount];
    Layer join[kFinishCount];
    Energy energy[2][kVolumeCount][2]; ///< [face diagonals][volume][top]
    Layer integrate[2];                ///< [driven]; of the plane's nodes, by the forces in `partial`
    int width;                         ///< lanes of a vector
};

} // namespace hybmss::kernels
