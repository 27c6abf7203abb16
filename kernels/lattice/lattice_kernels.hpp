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
    int width;                         ///< lanes of a vector
};

/// The kernels of a lattice in gather-rows; the energies are those of flat rows.
template <class T>
struct GatherKernels {
    /// Sets `partial` to the forces on the lower plane.
    using Plane = void (*)(const LatticeLayer<T>&);
    Plane plane[2][kVolumeCount][kAccuracyCount]; ///< [face diagonals][volume][accuracy]
    void (*integrate[2])(const LatticeLayer<T>&); ///< [driven]; of the plane's nodes, by the forces in `partial`
};

} // namespace hybmss::kernels
