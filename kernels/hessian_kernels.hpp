#pragma once

#include "kernels/hessian_arguments.hpp"
#include "kernels/network/network_kernels.hpp"

namespace hybmss::kernels {

/// A sweep over a lattice that makes `components` values a node: layers of cells, the topmost plane, and planes where
/// two slabs meet.
template <class T, int components>
struct LatticeHessianSweep {
    using Layer = void (*)(const LatticeHessianLayer<T, components>&);
    Layer layer[2][kVolumeCount][kTangentCount]; ///< [face diagonals][volume][tangent_index()]
    Layer top[2][kTangentCount];                 ///< [face diagonals][tangent_index()]
    Layer join;                                  ///< partial += above
};

/// Second derivatives of a lattice in flat rows.
template <class T>
struct LatticeHessianKernels {
    LatticeHessianSweep<T, 3> product;
    LatticeHessianSweep<T, kBlockEntries> diagonal;
};

/// Second derivatives of a network whose nodes are packed; Springs and Cells as in NetworkKernels, entries [begin,
/// end).
template <class T, class Springs, class Cells>
struct NetworkHessianKernels {
    using Range = std::ptrdiff_t;
    void (*spring_product[kTangentCount])(const Springs*, const PackedHessian<T>&, Range begin, Range end);
    void (*cell_product[kVolumeCount])(const Cells*, const PackedHessian<T>&, Range begin, Range end); ///< none: null
    void (*spring_diagonal[kTangentCount])(const Springs*, const T* displacement, const DiagonalBlocks<T>&, Range begin,
                                           Range end);
    void (*cell_diagonal[kVolumeCount])(const Cells*, const T* displacement, const DiagonalBlocks<T>&, Range begin,
                                        Range end); ///< none: null
};

template <class T>
using PackedHessianKernels = NetworkHessianKernels<T, SpringBlock<T>, CellBlock<T>>;
/// Of one SpringRuns or CellRuns; the entries are runs.
template <class T>
using RunHessianKernels = NetworkHessianKernels<T, SpringRuns<T>, CellRuns<T>>;

/// Second derivatives of a network as structure of arrays; springs or cells [begin, end) of one colour.
template <class T>
struct SoaHessianKernels {
    using Range = std::ptrdiff_t;
    void (*spring_product[kTangentCount])(const NetworkSprings<T>&, const HessianArrays<T>&, Range begin, Range end);
    void (*cell_product[kVolumeCount])(const NetworkCells<T>&, const HessianArrays<T>&, Range begin,
                                       Range end); ///< none: null
    void (*spring_diagonal[kTangentCount])(const NetworkSprings<T>&, const HessianArrays<T>&, const DiagonalBlocks<T>&,
                                           Range begin, Range end);
    void (*cell_diagonal[kVolumeCount])(const NetworkCells<T>&, const HessianArrays<T>&, const DiagonalBlocks<T>&,
                                        Range begin, Range end); ///< none: null
};

} // namespace hybmss::kernels
